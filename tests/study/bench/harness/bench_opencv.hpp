// SPDX-License-Identifier: Apache-2.0
/// OpenCV's block and semi-global matchers and their settings.
#ifndef VERGENCE_TESTS_BENCH_BENCH_OPENCV_HPP
#define VERGENCE_TESTS_BENCH_BENCH_OPENCV_HPP

#include "bench/harness/bench_method.hpp"

enum class opencv_mode { three_way, sgbm, hh4, hh, block_matching };

constexpr opencv_mode opencv_modes[] = {opencv_mode::three_way, opencv_mode::sgbm, opencv_mode::hh4,
                                        opencv_mode::hh, opencv_mode::block_matching};

/// Always with the left-right check (disp12MaxDiff 1).
struct opencv_setting {
    opencv_mode mode;
    int block_px;
    int penalty_scale;  // P1 = 8 * this * block^2, P2 = 4 P1; block matching has none
    int prefilter_cap;
    int uniqueness_percent;
    int speckle_px;  // regions below this area are rejected, steps up to 2 px connect; 0: off

    int p1() const { return 8 * penalty_scale * block_px * block_px; }
    int p2() const { return 4 * p1(); }
};

const char *opencv_mode_name(opencv_mode mode);
std::string opencv_setting_text(const opencv_setting &setting);

/// The setting with the smallest mean error of those tried, or within 0.02 of it (see RESULTS.md).
opencv_setting opencv_default(opencv_mode mode);

/// The three-way mode without its filters: the fastest semi-global one. All times are relative to
/// it.
opencv_setting opencv_plain();

/// A matcher of the OpenCV that this program is linked with. The number of disparities is rounded
/// up to a multiple of 16, and the images are padded where it would otherwise not search the
/// border.
std::unique_ptr<bench_method> opencv_make(const bench_pair &pair, const opencv_setting &setting);

#endif
