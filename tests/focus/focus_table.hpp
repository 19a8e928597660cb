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

/// Writes the rows of all methods that ran, in Markdown. Returns whether the limits hold for
/// our own methods.
bool print_table(std::FILE *file, const std::vector<Result> &results);

}  // namespace focus

#endif
