// SPDX-License-Identifier: Apache-2.0
/// The figures of a campaign, as a table.
#ifndef VERGENCE_TESTS_FOCUS_FOCUS_TABLE_HPP
#define VERGENCE_TESTS_FOCUS_FOCUS_TABLE_HPP

#include <cstdio>
#include <vector>

#include "focus_bench.hpp"

namespace focus {

/// What is wrong with a result; NULL: nothing.
const char *failure_of(const Result &result);

/// One line that says what happened, and what should have.
void print_failure(const Result &result);

/// Writes the rows of all methods that ran, in Markdown, with their limits.
void print_table(std::FILE *file, const std::vector<Result> &results);

/// What a method must reach; times and frames are in kMethodRows, and are multiplied.
struct Limits {
    double sharp, no_contrast;  ///< least share of the textured and of the flat lenses
    double false_focused;       ///< largest share of all
    double right_blurs;         ///< least share
    double factor_p50, factor_p99;
};
constexpr Limits kLimits = {0.999, 1, 0, 0.95, 1, 1};
/// A little less than is reached, so that a change for the worse is seen in a few hundred scenes.
constexpr Limits kShortLimits = {0.95, 0.9, 0.02, 0.85, 2.3, 5.5};

bool limits_hold(const std::vector<Result> &results, const Limits &limits);

}  // namespace focus

#endif
