// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_report.hpp"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <opencv2/core/version.hpp>

namespace {

constexpr int kNameWidth = 30;

double allowance_percent(const bench_outcome &one) {
    return 100 * static_cast<double>(one.memory_bytes) / static_cast<double>(one.allowance_bytes());
}

void print_errors(const bench_outcome &one, double best_mode_bad_1px) {
    if (!one.has_truth) {
        std::printf(" %7s %7s %6s %8s %6s", "-", "-", "-", "-", "-");
        return;
    }
    const evaluate_score &score = one.error.all.filled_visible;
    std::printf(" %7.2f %7.2f", score.bad_percent[1], score.bad_percent[2]);
    if (best_mode_bad_1px > 0) {
        std::printf(" %6.2f", score.bad_percent[1] / best_mode_bad_1px);
    } else {
        std::printf(" %6s", "-");
    }
    std::printf(" %7.1f%% %6.2f", one.error.visible.density_percent,
                one.error.visible.bad_3px_percent);
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

// All outcomes of one method.
struct summary {
    std::string method;
    int pairs = 0;  // with ground truth; the means are over these
    double bad_1px = 0, bad_2px = 0, density = 0, bad_3px = 0;
    double worst_of_allowance_percent = 0;
    std::vector<double> ratios[std::size(groups)], speedups;
    int group_pairs[std::size(groups)] = {};
};

void append(std::vector<double> &to, const std::vector<double> &from) {
    to.insert(to.end(), from.begin(), from.end());
}

void add(summary &sum, const bench_outcome &one) {
    if (one.has_truth) {
        sum.pairs++;
        sum.bad_1px += one.error.all.filled_visible.bad_percent[1];
        sum.bad_2px += one.error.all.filled_visible.bad_percent[2];
        sum.density += one.error.visible.density_percent;
        sum.bad_3px += one.error.visible.bad_3px_percent;
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
        }
        add(*at, one);
    }
    return all;
}

void print_error_summary(const std::vector<summary> &summaries) {
    std::printf("\nmean of %d pairs with ground truth\n  %-*s %7s %7s %8s %7s\n",
                summaries.front().pairs, kNameWidth, "", "bad-1.0", "bad-2.0", "density",
                "bad-3.0");
    for (const summary &sum : summaries) {
        std::printf("  %-*s %7.2f %7.2f %7.1f%% %7.2f\n", kNameWidth, sum.method.c_str(),
                    sum.bad_1px / sum.pairs, sum.bad_2px / sum.pairs, sum.density / sum.pairs,
                    sum.bad_3px / sum.pairs);
    }
    std::printf(
        "  bad-t: percent off by more than t px, filled, non-occluded; density: kept of "
        "non-occluded\n"
        "  pixels, bad-3.0 of the kept\n");
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
    std::printf("  %-*s %7s %7s %6s %8s %6s %9s %8s", kNameWidth, "", "bad-1.0", "bad-2.0", "/HH4",
                "density", "bad-3", "memory MB", "allowed");
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
    std::fflush(stdout);
}

void bench_print_summaries(const std::vector<bench_outcome> &outcomes) {
    const std::vector<summary> summaries = summaries_of(outcomes);
    if (summaries.front().pairs > 0) {
        print_error_summary(summaries);
    }
    if (!outcomes.front().times.empty()) {
        print_cost_summary(summaries);
    }
}
