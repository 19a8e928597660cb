// SPDX-License-Identifier: Apache-2.0
/// Counts a program's heap by intercepting the C library's allocator, so that the working memory of
/// a library can be measured from outside.
#ifndef VERGENCE_TESTS_BENCH_MEMORY_COUNT_HPP
#define VERGENCE_TESTS_BENCH_MEMORY_COUNT_HPP

#include <cstddef>

/// Starts to track the peak from what is allocated now.
void memory_count_begin();

/// Bytes at the peak since the start, above what was allocated then. Rounded up to the allocator's
/// size classes, like the real memory use. 0 in builds with sanitizers, which have their own
/// allocator.
std::size_t memory_count_peak_bytes();

#endif
