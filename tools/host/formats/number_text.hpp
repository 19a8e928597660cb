// SPDX-License-Identifier: Apache-2.0
/// Numbers as text.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_NUMBER_TEXT_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_NUMBER_TEXT_HPP

#include <string>

/// At most `digits` significant digits; integers up to 1e15 in full.
std::string number_text(double value, int digits);

#endif
