// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_report.hpp"

#include <cstdio>
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

void print_error_summary(const std::vector<bench_summary> &summaries) {
    std::printf("  %-*s %7s %7s %6s %8s %9s %8s %7s %9s %7s\n", kNameWidth, "", "bad-1.0",
                "bad-2.0", "/HH4", "<SGBM", "<all", "density", "bad-3.0", "of known", "bad-3.0");
    for (const bench_summary &sum : summaries) {
        std::printf("  %-*s %7.2f %7.2f", kNameWidth, sum.method.c_str(), sum.bad_1px, sum.bad_2px);
        if (sum.to_best_mode > 0) {
            std::printf(" %6.2f", sum.to_best_mode);
        } else {
            std::printf(" %6s", "-");
        }
        if (sum.against_plain > 0) {
            std::printf(" %4d/%-3d", sum.better_than_plain, sum.against_plain);
        } else {
            std::printf(" %8s", "-");
        }
        if (sum.is_ours) {
            std::printf(" %5d/%-3d", sum.better_than_all, sum.pairs);
        } else {
            std::printf(" %9s", "");
        }
        std::printf(" %7.1f%% %7.2f %8.1f%% %7.2f\n", sum.visible.density_percent,
                    sum.visible.bad_3px_percent, sum.known.density_percent,
                    sum.known.bad_3px_percent);
    }
    std::printf(
        "  bad-t: percent off by more than t px, filled, non-occluded; /HH4: bad-1.0 over OpenCV's "
        "HH4; <: pairs with less\n"
        "  bad-1.0 than SGBM, than every OpenCV method here; density: kept of non-occluded pixels, "
        "bad-3.0 of the kept;\n"
        "  of known: kept of all pixels with known truth, occluded ones too, bad-3.0 of those\n");
}

void print_cost_summary(const std::vector<bench_summary> &summaries) {
    std::printf("  %-*s", kNameWidth, "");
    for (const bench_group_time &time : summaries.front().times) {
        const std::string title = std::string(time.group->name) + ", " +
                                  std::to_string(time.pairs) +
                                  (time.pairs > 1 ? " pairs" : " pair");
        std::printf("   %-24s", title.c_str());
    }
    std::printf("  %9s  2 threads\n", "memory");
    for (const bench_summary &sum : summaries) {
        std::printf("  %-*s", kNameWidth, sum.method.c_str());
        for (const bench_group_time &time : sum.times) {
            std::printf("   %5.2f (%.2f-%.2f) cpu %-4.2f", time.ratio.median, time.ratio.low,
                        time.ratio.high, time.cpu_ratio.median);
        }
        std::printf("  %8.0f%%", sum.worst_of_allowance_percent);
        if (sum.speedup.median > 0) {
            std::printf("  %.2f (%.2f-%.2f)", sum.speedup.median, sum.speedup.low,
                        sum.speedup.high);
        }
        std::printf("\n");
    }
    std::printf(
        "  time over that of %s of Debian's OpenCV on 1 thread, by disparities searched: median "
        "(quartiles) of the\n"
        "  ratios in interleaved rounds, on the clock and of processor time; memory beyond the "
        "images: most of\n"
        "  24 x width x disparities + 64 x width bytes; 2 threads: how many times faster than 1\n",
        bench_reference);
}

}  // namespace

void bench_print_methods(const std::vector<bench_method_entry> &methods,
                         const std::string &pypi_version) {
    std::printf("OpenCV %s (linked)", CV_VERSION);
    if (pypi_version.empty()) {
        std::printf("; PyPI's OpenCV was NOT measured (not there, or not asked for)\n");
    } else {
        std::printf(" and %s (PyPI, in its own process)\n", pypi_version.c_str());
    }
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

void bench_print_summaries(const std::vector<bench_summary> &summaries) {
    if (summaries.front().pairs > 0) {
        std::printf("\nmean of %d pairs with ground truth\n", summaries.front().pairs);
        print_error_summary(summaries);
    }
    if (!summaries.front().times.empty()) {
        std::printf("\ntime and memory\n");
        print_cost_summary(summaries);
    }
}
