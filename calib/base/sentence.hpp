// SPDX-License-Identifier: Apache-2.0
#ifndef VERGENCE_CALIB_BASE_SENTENCE_HPP
#define VERGENCE_CALIB_BASE_SENTENCE_HPP

#include <string>

namespace calib {

/// printf into a string, for reasons and verdicts; truncated to 400 bytes.
std::string sentence(const char *format, ...) __attribute__((format(printf, 1, 2)));

}  // namespace calib

#endif
