// SPDX-License-Identifier: Apache-2.0
/// Counts what a program has on its heap by standing between it and the C library's allocator, so
/// that the working memory of a library can be measured without its help.
#ifndef VERGENCE_TESTS_BENCH_MEMORY_COUNT_HPP
#define VERGENCE_TESTS_BENCH_MEMORY_COUNT_HPP

#include <cstddef>

/// False in builds with sanitizers, which have an allocator of their own: all counts are 0.
bool memory_count_available();

/// Starts to watch the peak from what is allocated now.
void memory_count_begin();

/// Bytes at the peak since the beginning, above what was allocated then. Rounded up by the
/// allocator to its own sizes, as the computer's memory is.
std::size_t memory_count_peak_bytes();

#endif
