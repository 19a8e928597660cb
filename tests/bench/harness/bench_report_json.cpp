// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <opencv2/core/version.hpp>

#include "bench/harness/bench_report.hpp"
#include "daemon/base/json.h"

namespace {

constexpr int kDigits = 6;

void put(json *out, const char *name, double value) {
    json_real(out, name, value, kDigits);
}

void put_spread(json *out, const char *name, const bench_spread &spread) {
    const double quartiles[] = {spread.low, spread.high};
    put(out, name, spread.median);
    json_reals(out, (std::string(name) + "_quartiles").c_str(), quartiles, 2, kDigits);
}

void put_spread(json *out, const char *name, const std::vector<double> &values) {
    put_spread(out, name, bench_spread_of(values));
}

void put_errors(json *out, const bench_outcome &one) {
    const evaluate_score &score = one.error.all.filled_visible;
    for (int i = 0; i < EVALUATE_THRESHOLDS; i++) {
        char name[32];
        std::snprintf(name, sizeof name, "bad_%.1f_percent", evaluate_thresholds_px[i]);
        put(out, name, score.bad_percent[i]);
    }
    put(out, "average_px", score.average_px);
    put(out, "kept_bad_1.0_percent", one.error.all.kept_visible.bad_percent[1]);
    put(out, "kept_bad_3.0_percent", one.error.visible.bad_3px_percent);
    put(out, "density_visible_percent", one.error.visible.density_percent);
    put(out, "known_kept_bad_3.0_percent", one.error.known.bad_3px_percent);
    put(out, "density_known_percent", one.error.known.density_percent);
}

void put_outcome(json *out, const bench_outcome &one) {
    json_open_object(out, nullptr);
    json_text(out, "pair", one.pair.c_str());
    json_text(out, "method", one.method.c_str());
    json_integer(out, "width", one.width);
    json_integer(out, "height", one.height);
    json_integer(out, "disparities", one.disparities);
    if (one.has_truth) {
        put_errors(out, one);
    }
    put(out, "density_percent", one.density_percent);
    json_integer(out, "memory_bytes", static_cast<int64_t>(one.memory_bytes));
    json_integer(out, "allowance_bytes", static_cast<int64_t>(one.allowance_bytes()));
    json_open_array(out, "time");
    for (const auto &[threads, times] : one.times) {
        json_open_object(out, nullptr);
        json_integer(out, "threads", threads);
        put(out, "best_ms", bench_quantile(times.wall_ms, 0));
        put(out, "median_ms", bench_quantile(times.wall_ms, 0.5));
        put_spread(out, "ratio", times.ratios);
        put_spread(out, "cpu_ratio", times.cpu_ratios);
        json_close_object(out);
    }
    json_close_array(out);
    if (!one.speedups.empty()) {
        put_spread(out, "two_threads_speedup", one.speedups);
    }
    json_close_object(out);
}

void put_summary(json *out, const bench_summary &sum) {
    json_open_object(out, nullptr);
    json_text(out, "method", sum.method.c_str());
    if (sum.pairs > 0) {
        json_integer(out, "pairs", sum.pairs);
        put(out, "bad_1.0_percent", sum.bad_1px);
        put(out, "bad_2.0_percent", sum.bad_2px);
        if (sum.to_best_mode > 0) {
            put(out, "ratio_to_hh4", sum.to_best_mode);
        }
        if (sum.against_plain > 0) {
            json_integer(out, "pairs_better_than_sgbm", sum.better_than_plain);
        }
        if (sum.is_ours) {
            json_integer(out, "pairs_better_than_every_opencv", sum.better_than_all);
        }
        put(out, "density_visible_percent", sum.visible.density_percent);
        put(out, "kept_bad_3.0_percent", sum.visible.bad_3px_percent);
        put(out, "density_known_percent", sum.known.density_percent);
        put(out, "known_kept_bad_3.0_percent", sum.known.bad_3px_percent);
    }
    put(out, "worst_of_allowance_percent", sum.worst_of_allowance_percent);
    json_open_array(out, "time");
    for (const bench_group_time &time : sum.times) {
        json_open_object(out, nullptr);
        json_text(out, "disparities", time.group->name);
        json_integer(out, "pairs", time.pairs);
        put_spread(out, "ratio", time.ratio);
        put_spread(out, "cpu_ratio", time.cpu_ratio);
        json_close_object(out);
    }
    json_close_array(out);
    if (sum.speedup.median > 0) {
        put_spread(out, "two_threads_speedup", sum.speedup);
    }
    json_close_object(out);
}

}  // namespace

void bench_print_json(const bench_document &document) {
    json out;
    json_begin(&out, stdout);
    json_open_object(&out, nullptr);
    json_text(&out, "opencv", CV_VERSION);
    json_text(&out, "pypi_opencv",
              document.pypi_version.empty() ? nullptr : document.pypi_version.c_str());
    json_text(&out, "reference", bench_reference);
    json_integer(&out, "rounds", document.rounds);
    json_bool(&out, "padded", document.padded);
    json_open_array(&out, "methods");
    for (const bench_method_entry &entry : *document.methods) {
        json_open_object(&out, nullptr);
        json_text(&out, "name", entry.name.c_str());
        json_text(&out, "settings", entry.settings.c_str());
        json_close_object(&out);
    }
    json_close_array(&out);
    json_open_array(&out, "results");
    for (const bench_outcome &one : *document.outcomes) {
        put_outcome(&out, one);
    }
    json_close_array(&out);
    json_open_array(&out, "summary");
    for (const bench_summary &sum : bench_summaries(*document.outcomes)) {
        put_summary(&out, sum);
    }
    json_close_array(&out);
    json_close_object(&out);
    json_end(&out);
}
