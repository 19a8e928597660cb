// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_settings.hpp"

#include <algorithm>
#include <cstdio>
#include <opencv2/core/version.hpp>
#include <stdexcept>

#include "bench/harness/bench_run.hpp"
#include "bench/harness/bench_worker.hpp"
#include "daemon/base/json.h"

namespace {

constexpr std::size_t kShown = 6;

bench_setting_score score_of(const opencv_setting &setting, const std::vector<bench_pair> &pairs,
                             const bench_choice &choice, opencv_worker *worker) {
    bench_setting_score score{setting, 0, 0};
    int count = 0;
    for (const bench_pair &pair : pairs) {
        if (pair.truth_px.empty()) {
            continue;
        }
        const auto method = worker == nullptr ? opencv_make(pair, setting, choice.padded)
                                              : worker->make(pair, setting, choice.padded);
        method->run(1);
        const bench_error error = bench_error_of(pair, method->disparity_px());
        score.bad_1px += error.all.filled_visible.bad_percent[1];
        score.bad_2px += error.all.filled_visible.bad_percent[2];
        count++;
    }
    if (count == 0) {
        throw std::runtime_error("settings can be compared only on pairs with ground truth");
    }
    score.bad_1px /= count;
    score.bad_2px /= count;
    return score;
}

bench_setting_search search(opencv_mode mode, const std::vector<bench_pair> &pairs,
                            const bench_choice &choice) {
    bench_setting_search result;
    result.mode = mode;
    for (const opencv_setting &setting : opencv_candidates(mode)) {
        result.scores.push_back(score_of(setting, pairs, choice, nullptr));
    }
    std::stable_sort(result.scores.begin(), result.scores.end(),
                     [](const auto &a, const auto &b) { return a.bad_1px < b.bad_1px; });
    result.built_in = score_of(opencv_default(mode), pairs, choice, nullptr);
    if (choice.worker != nullptr) {
        for (const opencv_setting &setting :
             {result.scores.front().setting, opencv_default(mode)}) {
            result.of_worker.push_back(score_of(setting, pairs, choice, choice.worker.get()));
        }
    }
    return result;
}

void print_table(const bench_setting_search &one) {
    std::printf("\n%s: best %zu of %zu settings, left-right check on\n", opencv_mode_name(one.mode),
                std::min(kShown, one.scores.size()), one.scores.size());
    const auto line = [](const char *lead, const bench_setting_score &score) {
        std::printf("  %-9s bad-1.0 %6.2f  bad-2.0 %6.2f  %s\n", lead, score.bad_1px, score.bad_2px,
                    opencv_setting_text(score.setting).c_str());
    };
    for (std::size_t i = 0; i < std::min(kShown, one.scores.size()); i++) {
        line("", one.scores[i]);
    }
    line("built in", one.built_in);
    for (const bench_setting_score &score : one.of_worker) {
        line("PyPI's", score);
    }
    std::printf("  the built-in setting is %.3f above the best\n",
                one.built_in.bad_1px - one.scores.front().bad_1px);
}

void put_score(json *out, const char *name, const bench_setting_score &score) {
    json_open_object(out, name);
    json_text(out, "settings", opencv_setting_text(score.setting).c_str());
    json_real(out, "bad_1.0_percent", score.bad_1px, 6);
    json_real(out, "bad_2.0_percent", score.bad_2px, 6);
    json_close_object(out);
}

void put_search(json *out, const bench_setting_search &one) {
    json_open_object(out, nullptr);
    json_text(out, "mode", opencv_mode_name(one.mode));
    json_open_array(out, "tried");
    for (const bench_setting_score &score : one.scores) {
        put_score(out, nullptr, score);
    }
    json_close_array(out);
    put_score(out, "built_in", one.built_in);
    json_open_array(out, "of_pypi");
    for (const bench_setting_score &score : one.of_worker) {
        put_score(out, nullptr, score);
    }
    json_close_array(out);
    json_real(out, "built_in_above_best", one.built_in.bad_1px - one.scores.front().bad_1px, 6);
    json_close_object(out);
}

}  // namespace

std::vector<bench_setting_search> bench_search_settings(const std::vector<bench_pair> &pairs,
                                                        const bench_choice &choice) {
    std::vector<bench_setting_search> all;
    for (const opencv_mode mode : opencv_modes) {
        if (std::string(opencv_mode_name(mode)).find(choice.only) == std::string::npos) {
            continue;
        }
        all.push_back(search(mode, pairs, choice));
    }
    return all;
}

void bench_print_settings(const std::vector<bench_setting_search> &searches, bool json_wanted) {
    if (!json_wanted) {
        for (const bench_setting_search &one : searches) {
            print_table(one);
        }
        return;
    }
    json out;
    json_begin(&out, stdout);
    json_open_object(&out, nullptr);
    json_text(&out, "opencv", CV_VERSION);
    json_open_array(&out, "settings");
    for (const bench_setting_search &one : searches) {
        put_search(&out, one);
    }
    json_close_array(&out);
    json_close_object(&out);
    json_end(&out);
}
