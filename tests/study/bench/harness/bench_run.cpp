// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <stdexcept>

#include "core/error.h"
#include "stereo/fill.h"
#include "stereo/image/reason.h"

namespace {

constexpr double kSlow = 4;
constexpr int kSlowEvery = 3;

// The methods of one pair, all in memory.
struct contest {
    std::vector<std::unique_ptr<bench_method>> methods;
    std::vector<bool> is_slow;
    std::size_t reference = 0;
};

bench_outcome first_run(const bench_method_entry &entry, const bench_pair &pair,
                        bench_method &method) {
    bench_outcome result;
    result.pair = pair.name;
    result.set = pair.set;
    result.part = pair.part;
    result.method = entry.name;
    result.is_ours = entry.is_ours;
    result.width = pair.left.cols;
    result.height = pair.left.rows;
    result.disparities = pair.disparity_count;
    result.memory_bytes = method.first_run_bytes();
    std::vector<float> disparity_px = method.disparity_px();
    result.density_percent = bench_density_percent(disparity_px);
    result.has_truth = !pair.truth_px.empty();
    result.planes = method.planes();
    if (result.has_truth) {
        result.z_rms = bench_z_rms(pair, disparity_px, result.planes.sigma_px);
        result.error = bench_error_of(pair, disparity_px);
        result.filled_bad_1px = bench_error_of(pair, bench_filled(pair, disparity_px))
                                    .all.filled_visible.bad_percent[1];
        if (pair.is_rendered()) {
            result.regions = bench_regions_of(pair, disparity_px);
        }
    }
    result.disparity_px = std::move(disparity_px);
    return result;
}

// Runs all in this order. The reference runs in every round.
void one_round(contest &all, const std::vector<std::size_t> &order, bool with_slow,
               const std::vector<int> &thread_counts, std::vector<bench_outcome> &outcomes) {
    std::vector<std::map<int, bench_time>> taken(order.size());
    for (const std::size_t i : order) {
        if (with_slow || !all.is_slow[i]) {
            for (const int threads : thread_counts) {
                taken[i][threads] = all.methods[i]->run(threads);
            }
        }
    }
    for (std::size_t i = 0; i < taken.size(); i++) {
        for (const auto &[threads, time] : taken[i]) {
            const bench_time &reference = taken[all.reference][threads];
            bench_times &times = outcomes[i].times[threads];
            times.wall_ms.push_back(time.wall_ms);
            times.ratios.push_back(time.wall_ms / reference.wall_ms);
        }
        if (taken[i].size() == 2) {
            outcomes[i].speedups.push_back(taken[i][1].wall_ms / taken[i][2].wall_ms);
        }
    }
}

void time_rounds(contest &all, const bench_rounds &rounds, std::vector<bench_outcome> &outcomes) {
    std::vector<int> thread_counts = {1};
    if (rounds.two_threads) {
        thread_counts.push_back(2);
    }
    // One more untimed run: starts the second thread, and finds the slow methods.
    std::vector<double> trial_ms;
    for (const auto &method : all.methods) {
        for (const int threads : thread_counts) {
            const double ms = method->run(threads).wall_ms;
            if (threads == 1) {
                trial_ms.push_back(ms);
            }
        }
    }
    for (const double ms : trial_ms) {
        all.is_slow.push_back(ms > kSlow * trial_ms[all.reference]);
    }
    std::vector<std::size_t> order(all.methods.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::mt19937 random(1);  // the same orders in every run
    for (int round = 0; round < rounds.count; round++) {
        std::shuffle(order.begin(), order.end(), random);
        one_round(all, order, round % kSlowEvery == 0, thread_counts, outcomes);
    }
}

bench_kept kept_of(const bench_pair &pair, const std::vector<float> &disparity_px) {
    double known = 0, kept = 0, bad = 0;
    for (std::size_t i = 0; i < disparity_px.size(); i++) {
        const bool counts = std::isfinite(pair.truth_px[i]) && pair.mask[i] == EVALUATE_VISIBLE;
        known += counts ? 1 : 0;
        if (counts && std::isfinite(disparity_px[i])) {
            kept++;
            // The rounding of evaluate_disparity.
            const float value =
                pair.round_disparity ? std::floor(disparity_px[i] + 0.5F) : disparity_px[i];
            bad += std::fabs(value - pair.truth_px[i]) > 3 ? 1 : 0;
        }
    }
    return {known > 0 ? 100 * kept / known : 0, kept > 0 ? 100 * bad / kept : 0};
}

// Step of a truth that was stored in steps, 0 of any other: the smallest difference of its values.
double truth_step_px(std::vector<float> values_px) {
    constexpr float same_px = 1e-4F, smallest_px = 0.01F;
    std::sort(values_px.begin(), values_px.end());
    float step_px = std::numeric_limits<float>::infinity();
    for (std::size_t i = 1; i < values_px.size() && std::isfinite(values_px[i]); i++) {
        if (const float difference_px = values_px[i] - values_px[i - 1]; difference_px > same_px) {
            step_px = std::min(step_px, difference_px);
        }
    }
    return std::isfinite(step_px) && step_px > smallest_px ? static_cast<double>(step_px) : 0;
}

}  // namespace

bench_error bench_error_of(const bench_pair &pair, const std::vector<float> &disparity_px) {
    evaluate_input input;
    input.width_px = pair.left.cols;
    input.height_px = pair.left.rows;
    input.disparity_px = disparity_px.data();
    input.truth_px = pair.truth_px.data();
    input.mask = pair.mask.data();
    input.round_disparity = pair.round_disparity;
    return {evaluate_disparity(input), kept_of(pair, disparity_px)};
}

double bench_z_rms(const bench_pair &pair, const std::vector<float> &disparity_px,
                   const std::vector<float> &sigma_px) {
    if (pair.round_disparity || sigma_px.empty()) {
        return std::numeric_limits<double>::quiet_NaN();
    }
    const double step_px = truth_step_px(pair.truth_px);
    double squares = 0, count = 0;
    for (std::size_t i = 0; i < sigma_px.size(); i++) {
        const float error_px = disparity_px[i] - pair.truth_px[i];
        if (pair.mask[i] == EVALUATE_VISIBLE && std::fabs(error_px) <= 1) {
            const double variance =
                std::pow(static_cast<double>(sigma_px[i]), 2) + step_px * step_px / 12;
            squares += std::pow(static_cast<double>(error_px), 2) / variance;
            count++;
        }
    }
    return std::sqrt(squares / count);
}

std::vector<float> bench_filled(const bench_pair &pair, const std::vector<float> &disparity_px) {
    const int width = pair.left.cols;
    const int height = pair.left.rows;
    const std::size_t pixels = disparity_px.size();
    std::vector<int32_t> disparity_q8(pixels);
    std::vector<uint8_t> reason(pixels, REASON_AMBIGUOUS);
    std::vector<uint8_t> codes(pixels);
    for (std::size_t i = 0; i < pixels; i++) {
        if (std::isfinite(disparity_px[i])) {
            disparity_q8[i] = static_cast<int32_t>(std::lround(256 * disparity_px[i]));
            reason[i] = REASON_VALID;
        }
    }
    const image_rgb8 colour = {pair.left_colour.data, width, height, 3 * width};
    image_u8 sigma = {codes.data(), width, height, width};
    match_output output{};
    output.disparity_q8 = {disparity_q8.data(), width, height, width};
    output.reason = {reason.data(), width, height, width};
    const std::size_t bytes = fill_need_bytes(width, height);
    std::vector<unsigned char> memory(bytes + ARENA_ALIGNMENT);
    arena arena;
    void *begin = memory.data();
    std::size_t room = memory.size();
    arena_init(&arena, std::align(ARENA_ALIGNMENT, bytes, begin, room), bytes);
    const fill_input input = {&colour, nullptr, &sigma};
    if (fill_run(&input, &parallel_serial, &arena, &output) != ERROR_OK) {
        throw std::runtime_error(pair.name + ": cannot be filled");
    }
    std::vector<float> filled(pixels, std::numeric_limits<float>::quiet_NaN());
    for (std::size_t i = 0; i < pixels; i++) {
        if (reason_has_point(reason[i])) {
            filled[i] = static_cast<float>(disparity_q8[i]) / 256;
        }
    }
    return filled;
}

double bench_density_percent(const std::vector<float> &disparity_px) {
    const auto kept = std::count_if(disparity_px.begin(), disparity_px.end(),
                                    [](float d) { return std::isfinite(d); });
    return 100 * static_cast<double>(kept) / static_cast<double>(disparity_px.size());
}

double bench_quantile(std::vector<double> values, double share) {
    if (values.empty()) {
        return 0;
    }
    std::sort(values.begin(), values.end());
    const double at = share * static_cast<double>(values.size() - 1);
    const auto low = static_cast<std::size_t>(at);
    const std::size_t high = std::min(low + 1, values.size() - 1);
    return values[low] + (at - static_cast<double>(low)) * (values[high] - values[low]);
}

bench_spread bench_spread_of(const std::vector<double> &values) {
    return {bench_quantile(values, 0.5), bench_quantile(values, 0.25),
            bench_quantile(values, 0.75)};
}

std::vector<bench_outcome> bench_run_pair(const std::vector<bench_method_entry> &methods,
                                          const bench_pair &pair, const bench_rounds &rounds) {
    contest all;
    std::vector<bench_outcome> outcomes;
    for (const bench_method_entry &entry : methods) {
        if (entry.name == bench_reference) {
            all.reference = all.methods.size();
        }
        all.methods.push_back(entry.make(pair));
        outcomes.push_back(first_run(entry, pair, *all.methods.back()));
    }
    if (rounds.count > 0) {
        time_rounds(all, rounds, outcomes);
    }
    return outcomes;
}
