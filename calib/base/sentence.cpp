// SPDX-License-Identifier: Apache-2.0
#include "calib/base/sentence.hpp"

#include <cstdarg>
#include <cstdio>

namespace calib {

std::string sentence(const char *format, ...) {
    char text[400];
    va_list values;
    va_start(values, format);
    std::vsnprintf(text, sizeof text, format, values);
    va_end(values);
    return text;
}

}  // namespace calib
