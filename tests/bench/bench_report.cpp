// SPDX-License-Identifier: Apache-2.0
#include "bench/bench_report.hpp"

#include <cmath>
#include <cstdio>
#include <opencv2/core/version.hpp>

#include "bench/bench_method.hpp"

void bench_print_table(const bench_pair &pair, const std::vector<bench_outcome> &outcomes) {
    std::printf(
        "\n%s  %dx%d, %d disparities%s%s\n", pair.name.c_str(), pair.left.cols, pair.left.rows,
        pair.disparity_count,
        pair.truth_px.empty() ? ", no ground truth" : (", occlusions " + pair.mask_origin).c_str(),
        pair.round_disparity ? ", rounded (truth in whole pixels)" : "");
    std::printf("  %-22s %7s %7s %7s %9s %9s", "", "bad-1.0", "bad-2.0", "avg px", "density",
                "memory MB");
    for (const auto &[threads, unused] : outcomes.front().timing_by_threads) {
        (void)unused;
        std::printf("   %d thread%s: ms  ratio (spread)   ", threads, threads == 1 ? "" : "s");
    }
    std::printf("\n");
    for (const bench_outcome &one : outcomes) {
        const evaluate_score &score = one.errors.filled_visible;
        std::printf("  %-22s", one.method.c_str());
        if (one.has_truth) {
            std::printf(" %7.2f %7.2f %7.3f", score.bad_percent[1], score.bad_percent[2],
                        score.average_px);
        } else {
            std::printf(" %7s %7s %7s", "-", "-", "-");
        }
        std::printf(" %8.1f%% %9.2f", one.density_percent,
                    static_cast<double>(one.memory_bytes) / 1e6);
        for (const auto &[threads, timing] : one.timing_by_threads) {
            (void)threads;
            std::printf("  %9.1f  %5.2f (%.2f-%.2f)     ", timing.best_ms, timing.ratio,
                        timing.ratio_low, timing.ratio_high);
        }
        std::printf("\n");
    }
    std::fflush(stdout);
}

void bench_print_means(const std::vector<bench_outcome> &all) {
    struct mean {
        double bad1 = 0, bad2 = 0, log_ratio = 0;
        int with_truth = 0, timed = 0;
    };
    std::vector<std::string> order;
    std::map<std::string, mean> means;
    for (const bench_outcome &one : all) {
        if (means.find(one.method) == means.end()) {
            order.push_back(one.method);
        }
        mean &sum = means[one.method];
        if (one.has_truth) {
            sum.bad1 += one.errors.filled_visible.bad_percent[1];
            sum.bad2 += one.errors.filled_visible.bad_percent[2];
            sum.with_truth++;
        }
        const auto single = one.timing_by_threads.find(1);
        if (single != one.timing_by_threads.end()) {
            sum.log_ratio += std::log(single->second.ratio);
            sum.timed++;
        }
    }
    std::printf(
        "\nmean of all pairs (filled, non-occluded; time: geometric mean of the ratios to %s "
        "on 1 thread)\n",
        bench_reference);
    for (const std::string &name : order) {
        const mean &sum = means[name];
        std::printf("  %-22s", name.c_str());
        if (sum.with_truth > 0) {
            std::printf(" bad-1.0 %5.2f  bad-2.0 %5.2f", sum.bad1 / sum.with_truth,
                        sum.bad2 / sum.with_truth);
        }
        if (sum.timed > 0) {
            std::printf("  time %.2f", std::exp(sum.log_ratio / sum.timed));
        }
        std::printf("\n");
    }
}

namespace {

// A JSON string. Folder names may hold anything.
std::string quoted(const std::string &text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') {
            result += '\\';
            result += c;
        } else if (static_cast<unsigned char>(c) < 0x20) {
            char code[8];
            std::snprintf(code, sizeof code, "\\u%04x", static_cast<unsigned>(c));
            result += code;
        } else {
            result += c;
        }
    }
    return result + '"';
}

void print_outcome(const bench_outcome &one) {
    std::printf("    {\"pair\": %s, \"method\": %s,\n", quoted(one.pair).c_str(),
                quoted(one.method).c_str());
    std::printf("     \"width\": %d, \"height\": %d, \"disparities\": %d,\n", one.width, one.height,
                one.disparities);
    if (one.has_truth) {
        const evaluate_score &score = one.errors.filled_visible;
        std::printf("     ");
        for (int i = 0; i < EVALUATE_THRESHOLDS; i++) {
            std::printf("\"bad_%.1f_percent\": %.4f, ", evaluate_thresholds_px[i],
                        score.bad_percent[i]);
        }
        std::printf("\"average_px\": %.4f,\n     \"kept_bad_1.0_percent\": %.4f,\n",
                    score.average_px, one.errors.kept_visible.bad_percent[1]);
    }
    std::printf("     \"time\": [");
    const char *separator = "";
    for (const auto &[threads, timing] : one.timing_by_threads) {
        std::printf(
            "%s{\"threads\": %d, \"best_ms\": %.3f, \"ratio\": %.4f, "
            "\"ratio_quartiles\": [%.4f, %.4f]}",
            separator, threads, timing.best_ms, timing.ratio, timing.ratio_low, timing.ratio_high);
        separator = ", ";
    }
    std::printf("],\n     \"density_percent\": %.4f, \"memory_bytes\": %zu}", one.density_percent,
                one.memory_bytes);
}

}  // namespace

void bench_print_json(const std::vector<bench_outcome> &all, int rounds, bool padded) {
    std::printf(
        "{\n  \"opencv\": \"%s\", \"reference\": %s, \"rounds\": %d, \"padded\": %s,\n"
        "  \"results\": [\n",
        CV_VERSION, quoted(bench_reference).c_str(), rounds, padded ? "true" : "false");
    for (std::size_t i = 0; i < all.size(); i++) {
        print_outcome(all[i]);
        std::printf(i + 1 < all.size() ? ",\n" : "\n");
    }
    std::printf("  ]\n}\n");
}
