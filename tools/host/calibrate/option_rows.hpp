// SPDX-License-Identifier: Apache-2.0
/// Rows of a table of options, see struct command_argument. `offset` is into the values.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_OPTION_ROWS_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_OPTION_ROWS_HPP

#include <cstddef>

#include "console/command.h"

constexpr command_argument flag_option(const char *name, std::size_t offset, const char *help) {
    return {name, COMMAND_FLAG, offset,  nullptr, help,    0,      0, 0,
            0,    nullptr,      nullptr, false,   nullptr, nullptr};
}

constexpr command_argument text_option(const char *name, std::size_t offset, const char *value_name,
                                       const char *help) {
    return {name, COMMAND_TEXT, offset,  value_name, help,    0,      0, 0,
            0,    nullptr,      nullptr, false,      nullptr, nullptr};
}

constexpr command_argument choice_option(const char *name, std::size_t offset,
                                         const char *value_name, const char *help,
                                         const char *choices) {
    return {name, COMMAND_CHOICE, offset,  value_name, help,    0,      0, 0,
            0,    choices,        nullptr, false,      nullptr, nullptr};
}

/// `kind`: COMMAND_INTEGER or COMMAND_NUMBER; `count` numbers with `separator` between them, in
/// `units` or one of the same kind.
constexpr command_argument number_option(const char *name, command_kind kind, std::size_t offset,
                                         const char *value_name, const char *help, double min,
                                         double max, int count = 0, char separator = 0,
                                         const char *units = nullptr) {
    return {name,  kind,      offset,  value_name, help,  min,     max,
            count, separator, nullptr, nullptr,    false, nullptr, units};
}

/// The ends of a known length in both pictures, as `calibrate` and `measure` take them.
constexpr command_argument mark_from_option(std::size_t offset) {
    return number_option(
        "from", COMMAND_NUMBER, offset, "X,Y,X,Y",
        "Column and row of the first mark in the left picture, then in the right one; "
        "picked within half a pixel. \"vergence info RESULT --at X,Y\" prints them for a "
        "pixel of the report.",
        0, 32768, 4, ',');
}
constexpr command_argument mark_to_option(std::size_t offset) {
    return number_option("to", COMMAND_NUMBER, offset, "X,Y,X,Y", "The same of the second mark.", 0,
                         32768, 4, ',');
}

#endif
