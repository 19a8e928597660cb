// SPDX-License-Identifier: Apache-2.0
/// Checks a harness's property: prints a violated condition and aborts, so that libFuzzer keeps the
/// input and the replay fails.
#ifndef VERGENCE_TESTS_FUZZ_FUZZ_CHECK_HPP
#define VERGENCE_TESTS_FUZZ_FUZZ_CHECK_HPP

#include <cstdio>
#include <cstdlib>

#define FUZZ_CHECK(condition)                                                                   \
    do {                                                                                        \
        if (!(condition)) {                                                                     \
            std::fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
            std::abort();                                                                       \
        }                                                                                       \
    } while (false)

#endif
