// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_report.hpp"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <map>
#include <opencv2/core/version.hpp>

#include "bench/harness/bench_figures.hpp"

namespace {

constexpr int kNameWidth = 30;

double allowance_percent(const bench_outcome &one) {
    return 100 * static_cast<double>(one.memory_bytes) / static_cast<double>(one.allowance_bytes());
}

void print_errors(const bench_outcome &one, double best_mode_bad_1px) {
    if (!one.has_truth) {
        std::printf(" %7s %7s %7s %6s %8s %6s %5s", "-", "-", "-", "-", "-", "-", "-");
        return;
    }
    const evaluate_score &score = one.error.all.filled_visible;
    std::printf(" %7.2f %7.2f %7.2f", score.bad_percent[1], one.filled_bad_1px,
                score.bad_percent[2]);
    if (best_mode_bad_1px > 0) {
        std::printf(" %6.2f", score.bad_percent[1] / best_mode_bad_1px);
    } else {
        std::printf(" %6s", "-");
    }
    std::printf(" %7.1f%% %6.2f", one.error.visible.density_percent,
                one.error.visible.bad_3px_percent);
    bench_print_value(5, 2, one.z_rms);
}

void print_times(const bench_outcome &one) {
    const auto single = one.times.find(1);
    if (single != one.times.end()) {
        const bench_spread ratio = bench_spread_of(single->second.ratios);
        std::printf(" %9.1f  %5.2f (%.2f-%.2f)", bench_quantile(single->second.wall_ms, 0.5),
                    ratio.median, ratio.low, ratio.high);
    }
    if (!one.speedups.empty()) {
        std::printf("   %5.2f", bench_spread_of(one.speedups).median);
    }
}

// Pairs with similar counts of searched disparities, over which times are pooled.
struct group {
    const char *name;
    int min, max;
};
constexpr group groups[] = {{"below 48", 1, 47},
                            {"64 (48..96)", 48, 96},
                            {"97..127", 97, 127},
                            {"128 and more", 128, 1024}};

// All outcomes of one method on recorded pairs.
struct summary {
    std::string method;
    bool is_ours = false;
    int pairs = 0;   // pairs with ground truth; the means are over these
    int behind = 0;  // pairs with ground truth on which OpenCV is better
    double bad_1px = 0, filled_bad_1px = 0, bad_2px = 0, density = 0, kept_bad_1px = 0,
           kept_bad_3px = 0;
    std::vector<double> noise_bad_1px;
    std::vector<std::string> sets;  // names in the order of first appearance
    std::map<std::string, std::vector<double>> bad_1px_of_set;
    double worst_of_allowance_percent = 0;
    std::vector<double> ratios[std::size(groups)], speedups;
    int group_pairs[std::size(groups)] = {};
};

void append(std::vector<double> &to, const std::vector<double> &from) {
    to.insert(to.end(), from.begin(), from.end());
}

void add(summary &sum, const bench_outcome &one) {
    if (one.has_truth) {
        const evaluate_score &filled = one.error.all.filled_visible;
        sum.pairs++;
        sum.bad_1px += filled.bad_percent[1];
        sum.filled_bad_1px += one.filled_bad_1px;
        sum.bad_2px += filled.bad_percent[2];
        sum.density += one.error.visible.density_percent;
        sum.kept_bad_1px += one.error.all.kept_visible.bad_percent[1];
        sum.kept_bad_3px += one.error.visible.bad_3px_percent;
        append(sum.noise_bad_1px, one.noise_bad_1px);
        if (sum.bad_1px_of_set.count(one.set) == 0) {
            sum.sets.push_back(one.set);
        }
        sum.bad_1px_of_set[one.set].push_back(filled.bad_percent[1]);
    }
    sum.worst_of_allowance_percent =
        std::max(sum.worst_of_allowance_percent, allowance_percent(one));
    append(sum.speedups, one.speedups);
    const auto single = one.times.find(1);
    for (std::size_t i = 0; single != one.times.end() && i < std::size(groups); i++) {
        if (one.disparities >= groups[i].min && one.disparities <= groups[i].max) {
            append(sum.ratios[i], single->second.ratios);
            sum.group_pairs[i]++;
        }
    }
}

std::vector<summary> summaries_of(const std::vector<bench_outcome> &outcomes) {
    std::vector<summary> all;
    for (const bench_outcome &one : outcomes) {
        auto at = std::find_if(all.begin(), all.end(),
                               [&](const summary &sum) { return sum.method == one.method; });
        if (at == all.end()) {
            at = all.insert(all.end(), summary{});
            at->method = one.method;
            at->is_ours = one.is_ours;
        }
        add(*at, one);
    }
    return all;
}

// Counts the pairs on which a mode of OpenCV is better than each of our methods.
void compare_with_opencv(const std::vector<bench_outcome> &outcomes,
                         std::vector<summary> &summaries) {
    std::map<std::string, double> best_percent;  // OpenCV's best result; key: pair
    for (const bench_outcome &one : outcomes) {
        if (one.has_truth && !one.is_ours) {
            const double bad_percent = one.error.all.filled_visible.bad_percent[1];
            const auto at = best_percent.try_emplace(one.pair, bad_percent).first;
            at->second = std::min(at->second, bad_percent);
        }
    }
    for (const bench_outcome &one : outcomes) {
        const auto at = std::find_if(summaries.begin(), summaries.end(),
                                     [&](const summary &sum) { return sum.method == one.method; });
        if (one.has_truth && one.is_ours) {
            at->behind +=
                one.error.all.filled_visible.bad_percent[1] > best_percent.at(one.pair) ? 1 : 0;
        }
    }
}

double mean(const std::vector<double> &values) {
    double sum = 0;
    for (const double value : values) {
        sum += value;
    }
    return sum / static_cast<double>(values.size());
}

void print_error_summary(const std::vector<summary> &summaries) {
    const int pairs = summaries.front().pairs;
    std::printf("\nmean of %d pairs with ground truth\n  %-*s %7s %7s %7s %8s %7s %7s %7s %7s\n",
                pairs, kNameWidth, "", "bad-1.0", "filled", "bad-2.0", "density", "kept-1",
                "kept-3", "noise", "behind");
    for (const summary &sum : summaries) {
        std::printf("  %-*s %7.2f %7.2f %7.2f %7.1f%% %7.2f %7.2f", kNameWidth, sum.method.c_str(),
                    sum.bad_1px / pairs, sum.filled_bad_1px / pairs, sum.bad_2px / pairs,
                    sum.density / pairs, sum.kept_bad_1px / pairs, sum.kept_bad_3px / pairs);
        if (sum.noise_bad_1px.empty()) {
            std::printf(" %7s", "-");
        } else {
            std::printf(" %7.2f", mean(sum.noise_bad_1px));
        }
        if (sum.is_ours) {
            std::printf(" %7d", sum.behind);
        }
        std::printf("\n");
    }
    std::printf(
        "  bad-t: percent off by more than t px, filled, non-occluded; filled: bad-1.0 as --fill "
        "of\n"
        "  vergence reconstruct fills; density: kept of "
        "non-occluded\n"
        "  pixels; kept-t: bad-t of the kept; noise: bad-1.0 with noise of 1 %% exposure; behind:\n"
        "  pairs on which a mode of OpenCV has the lower bad-1.0\n");
}

// Parameters are chosen on the other sets' figure, and judged on the set's own.
void print_sets(const std::vector<summary> &summaries) {
    const std::vector<std::string> &sets = summaries.front().sets;
    if (sets.size() < 2) {
        return;
    }
    std::printf("\nbad-1.0 with one set left out: its own (that of the others)\n  %-*s", kNameWidth,
                "");
    for (const std::string &set : sets) {
        std::printf(" %15s", set.c_str());
    }
    std::printf("\n");
    for (const summary &sum : summaries) {
        std::printf("  %-*s", kNameWidth, sum.method.c_str());
        for (const std::string &set : sets) {
            std::vector<double> others;
            for (const auto &[name, values] : sum.bad_1px_of_set) {
                if (name != set) {
                    append(others, values);
                }
            }
            std::printf("  %6.2f (%5.2f)", mean(sum.bad_1px_of_set.at(set)), mean(others));
        }
        std::printf("\n");
    }
}

void print_cost_summary(const std::vector<summary> &summaries) {
    std::printf("\ntime and memory\n  %-*s", kNameWidth, "");
    for (std::size_t i = 0; i < std::size(groups); i++) {
        if (const int pairs = summaries.front().group_pairs[i]; pairs > 0) {
            const std::string title = std::string(groups[i].name) + ", pairs: ";
            std::printf("   %-20s", (title + std::to_string(pairs)).c_str());
        }
    }
    std::printf("  %9s  2 threads\n", "memory");
    for (const summary &sum : summaries) {
        std::printf("  %-*s", kNameWidth, sum.method.c_str());
        for (const std::vector<double> &ratios : sum.ratios) {
            if (!ratios.empty()) {
                const bench_spread ratio = bench_spread_of(ratios);
                std::printf("   %6.2f (%5.2f-%5.2f)", ratio.median, ratio.low, ratio.high);
            }
        }
        std::printf("  %8.0f%%", sum.worst_of_allowance_percent);
        if (!sum.speedups.empty()) {
            std::printf("  %.2f", bench_spread_of(sum.speedups).median);
        }
        std::printf("\n");
    }
    std::printf(
        "  time over that of %s on 1 thread, by disparities searched: median (quartiles)\n"
        "  of the ratios in interleaved rounds; memory beyond the images: most of\n"
        "  24 x width x disparities + 64 x width bytes; 2 threads: how many times faster than 1\n",
        bench_reference);
}

std::vector<bench_region_scores> region_scores_of(const std::vector<bench_outcome> &outcomes,
                                                  const std::string &without_part) {
    std::vector<bench_region_scores> methods;
    for (const bench_outcome &one : outcomes) {
        if (one.regions.empty() || (!one.part.empty() && one.part == without_part)) {
            continue;
        }
        auto at = std::find_if(
            methods.begin(), methods.end(),
            [&](const bench_region_scores &scores) { return scores.method == one.method; });
        if (at == methods.end()) {
            at = methods.insert(methods.end(), bench_region_scores{one.method, {}});
        }
        at->views.push_back(one.regions);
    }
    return methods;
}

// With and without the part for checking.
void print_scene_summaries(const std::vector<bench_outcome> &outcomes) {
    const auto all = region_scores_of(outcomes, "");
    const auto develop = region_scores_of(outcomes, "check");
    const auto print = [](const char *which, const std::vector<bench_region_scores> &scores) {
        std::printf("\nmean of %zu rendered view%s%s\n", scores.front().views.size(),
                    scores.front().views.size() > 1 ? "s" : "", which);
        bench_print_regions(scores, bench_best_mode);
    };
    print("", all);
    if (!develop.empty() && develop.front().views.size() < all.front().views.size()) {
        print(" without those for checking", develop);
    }
    std::printf(
        "  percent of the object's pixels that both cameras see. right: kept, off by at most 1 "
        "px;\n"
        "  tex-rt, tex-wr: right, and kept but off by more, of the textured pixels; bad-t: of the "
        "kept,\n"
        "  off by more than t px; worst-t: the same, largest of the views; median: of the error in "
        "px, of\n"
        "  the kept with texture; behind HH4: views on which HH4 has more right textured pixels\n");
}

}  // namespace

void bench_print_methods(const std::vector<bench_method_entry> &methods) {
    std::printf("OpenCV %s\n", CV_VERSION);
    for (const bench_method_entry &entry : methods) {
        std::printf("  %-*s %s\n", kNameWidth, entry.name.c_str(), entry.settings.c_str());
    }
    std::fflush(stdout);
}

void bench_print_table(const bench_pair &pair, const std::vector<bench_outcome> &outcomes) {
    std::printf(
        "\n%s  %dx%d, %d disparities%s%s\n", pair.name.c_str(), pair.left.cols, pair.left.rows,
        pair.disparity_count,
        pair.truth_px.empty() ? ", no ground truth" : (", occlusions " + pair.mask_origin).c_str(),
        pair.round_disparity ? ", rounded (truth in whole pixels)" : "");
    std::printf("  %-*s %7s %7s %7s %6s %8s %6s %5s %9s %8s", kNameWidth, "", "bad-1.0", "filled",
                "bad-2.0", "/HH4", "density", "bad-3", "z", "memory MB", "allowed");
    if (!outcomes.front().times.empty()) {
        std::printf(" %9s  %-17s %s", "ms", "ratio (quartiles)",
                    outcomes.front().speedups.empty() ? "" : "2 threads");
    }
    std::printf("\n");
    double best_mode_bad_1px = 0;
    for (const bench_outcome &one : outcomes) {
        if (one.method == bench_best_mode && one.has_truth) {
            best_mode_bad_1px = one.error.all.filled_visible.bad_percent[1];
        }
    }
    for (const bench_outcome &one : outcomes) {
        std::printf("  %-*s", kNameWidth, one.method.c_str());
        print_errors(one, best_mode_bad_1px);
        std::printf(" %9.2f %7.0f%%", static_cast<double>(one.memory_bytes) / 1e6,
                    allowance_percent(one));
        print_times(one);
        std::printf("\n");
    }
    if (pair.is_rendered()) {
        bench_print_regions(region_scores_of(outcomes, ""), bench_best_mode);
    }
    std::fflush(stdout);
}

void bench_print_summaries(const std::vector<bench_outcome> &outcomes) {
    std::vector<bench_outcome> recorded;
    std::copy_if(outcomes.begin(), outcomes.end(), std::back_inserter(recorded),
                 [](const bench_outcome &one) { return one.regions.empty(); });
    if (!recorded.empty()) {
        std::vector<summary> summaries = summaries_of(recorded);
        if (summaries.front().pairs > 0) {
            compare_with_opencv(recorded, summaries);
            print_error_summary(summaries);
            print_sets(summaries);
        }
        if (!recorded.front().times.empty()) {
            print_cost_summary(summaries);
        }
    }
    if (recorded.size() < outcomes.size()) {
        print_scene_summaries(outcomes);
    }
    bench_print_figures(outcomes);
}
