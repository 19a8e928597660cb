// SPDX-License-Identifier: Apache-2.0
/// Scores of a disparity map on the objects of a rendered scene.
#ifndef VERGENCE_TESTS_BENCH_BENCH_REGION_HPP
#define VERGENCE_TESTS_BENCH_BENCH_REGION_HPP

#include <array>
#include <string>
#include <vector>

#include "bench/harness/bench_pair.hpp"

/// What is measured of an object's pixels that both cameras see: percent, but for the median.
/// Right: kept, and off by at most 1 px; wrong: kept, and off by more.
enum bench_figure {
    BENCH_RIGHT,           // right pixels, share of all pixels
    BENCH_TEXTURED_RIGHT,  // right pixels, share of the textured pixels
    BENCH_TEXTURED_WRONG,
    BENCH_KEPT,          // kept pixels, share of all pixels
    BENCH_KEPT_BAD_1PX,  // kept pixels with an error above 1 px, share of the kept
    BENCH_KEPT_BAD_3PX,
    BENCH_MEDIAN_PX,  // median error of the kept pixels; of the textured ones, if there are any
    BENCH_FIGURES
};

struct bench_region {
    std::string object;                           // "all": every pixel of the scene
    std::array<double, BENCH_FIGURES> figures{};  // NaN: of hardly any pixel
};

/// "all", and one per object of the pair that has visible pixels.
std::vector<bench_region> bench_regions_of(const bench_pair &pair,
                                           const std::vector<float> &disparity_px);

/// A figure of an object, NaN if the view does not show it.
double bench_region_figure(const std::vector<bench_region> &view, const std::string &object,
                           bench_figure figure);

/// Prints a column of a table: a space, then the value and its unit in `width` characters; "-" for
/// NaN.
void bench_print_value(int width, int decimals, double value, const std::string &unit = "");

/// The scores of one method on some views.
struct bench_region_scores {
    std::string method;
    std::vector<std::vector<bench_region>> views;
};

/// Prints a table for each object: a line per method with the means over the views that show it.
/// With several views also the largest share of bad pixels among the kept, and on how many views
/// the method `rival` has more right textured pixels. The methods have the same views.
void bench_print_regions(const std::vector<bench_region_scores> &methods, const std::string &rival);

#endif
