// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_method.hpp"

#include <chrono>
#include <ctime>
#include <stdexcept>

#include "bench/harness/bench_opencv.hpp"
#include "bench/harness/bench_ours.hpp"

namespace {

double processor_ms() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

// Whether `name` contains one of the texts between commas.
bool has_part_of(const std::string &name, const std::string &texts) {
    std::size_t begin = 0;
    for (std::size_t end = 0; end != std::string::npos; begin = end + 1) {
        end = texts.find(',', begin);
        if (name.find(texts.substr(begin, end - begin)) != std::string::npos) {
            return true;
        }
    }
    return false;
}

std::vector<bench_method_entry> our_methods() {
    return {
        {"fast", "ours: every other row, near a coarse surface", true,
         bench_ours(MATCH_PRESET_FAST)},
        {"standard", "ours, the default: near a coarse surface", true,
         bench_ours(MATCH_PRESET_STANDARD)},
        {"standard+refine", "the same, then sub-pixel refinement and sigma", true,
         bench_ours(MATCH_PRESET_STANDARD, true)},
        {"best", "ours: all disparities everywhere", true, bench_ours(MATCH_PRESET_BEST)},
        {"best+refine", "the same, then refined", true, bench_ours(MATCH_PRESET_BEST, true)},
        {"board", "ours: in the memory of a small board", true, bench_ours(MATCH_PRESET_BOARD)},
        {"paper", "ours: a greedy path along each row", true, bench_ours(MATCH_PRESET_PAPER)},
    };
}

std::vector<bench_method_entry> opencv_methods() {
    std::vector<std::pair<std::string, opencv_setting>> named = {{bench_reference, opencv_plain()}};
    for (const opencv_mode mode : opencv_modes) {
        named.emplace_back(opencv_mode_name(mode), opencv_default(mode));
    }
    std::vector<bench_method_entry> entries;
    for (const auto &[name, setting] : named) {
        entries.push_back(
            {name, opencv_setting_text(setting), false,
             [setting = setting](const bench_pair &pair) { return opencv_make(pair, setting); }});
    }
    return entries;
}

}  // namespace

bench_time bench_timed(const std::function<void()> &work) {
    const double processor_begin_ms = processor_ms();
    const auto begin = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - begin;
    return {taken.count(), processor_ms() - processor_begin_ms};
}

std::vector<bench_method_entry> bench_methods(const std::string &only) {
    std::vector<bench_method_entry> all = our_methods();
    for (bench_method_entry &entry : opencv_methods()) {
        all.push_back(std::move(entry));
    }
    std::vector<bench_method_entry> wanted;
    bool found = false;
    for (bench_method_entry &entry : all) {
        const bool named = has_part_of(entry.name, only);
        found = found || named;
        if (named || entry.name == bench_reference) {
            wanted.push_back(std::move(entry));
        }
    }
    if (!found) {
        throw std::runtime_error("no method with a name that contains " + only);
    }
    return wanted;
}
