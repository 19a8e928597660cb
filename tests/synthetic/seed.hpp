// SPDX-License-Identifier: Apache-2.0
/// The seed of a random test: VERGENCE_SEED from the environment, else a fixed one.
/// doctest_main.cpp prints it beside each failure.
#ifndef VERGENCE_TESTS_SYNTHETIC_SEED_HPP
#define VERGENCE_TESTS_SYNTHETIC_SEED_HPP

#include <cstdint>
#include <cstdlib>

namespace synthetic {

inline uint64_t test_seed() {
    const char *text = std::getenv("VERGENCE_SEED");
    return text != nullptr ? std::strtoull(text, nullptr, 0) : 20090915;
}

#if defined(__SANITIZE_ADDRESS__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
constexpr bool kSanitized = __has_feature(address_sanitizer);
#else
constexpr bool kSanitized = false;
#endif

/// The number of random cases of a statistical test: `default_value`, but `sanitized` under the
/// address sanitizer, which finds an error in one case as well as in a hundred.
constexpr int rounds(int default_value, int sanitized) {
    return kSanitized ? sanitized : default_value;
}

}  // namespace synthetic

#endif
