// SPDX-License-Identifier: Apache-2.0
/// Commands that only the host's `vergence` has. Each takes the arguments starting with its own
/// name and returns an exit code of daemon/client/client.h.
#ifndef VERGENCE_TOOLS_HOST_COMMANDS_COMMANDS_HPP
#define VERGENCE_TOOLS_HOST_COMMANDS_COMMANDS_HPP

#include <cstddef>

#include "console/command.h"

/// Rows of a table of options, see struct command_argument. `offset` is into the values.
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

/// `vergence board`: a calibration board as a PDF.
int command_board(int argc, char **argv);

/// `vergence calibrate`: a stereo pair from pictures of a board.
int command_calibrate(int argc, char **argv);

/// `vergence calibrate capture`: the pictures for a calibration at all zooms.
int command_capture(int argc, char **argv);

/// `vergence evaluate`: how far a result is from the ground truth.
int command_evaluate(int argc, char **argv);

/// `vergence info`: explains a calibration, a result or a session.
int command_info(int argc, char **argv);

/// `vergence measure`: the surface of a session that an instrument's `measure` took, by
/// `vergence reconstruct`, which is passed. `target`: a thing of known size in the pictures, as in
/// struct reconstruct_adjust_scene; NULL: none. Without it only checks the options: then
/// OPTIONS_CONTINUE, if they are right.
struct adjust_target;
int command_measure(int argc, char **argv,
                    int (*reconstruct)(int argc, char **argv, const adjust_target *target));

/// `vergence view`: what the cameras see, live in the browser.
int command_view(int argc, char **argv);

/// `vergence simulate`: executes the simulated rig, if it was built.
int command_simulate(int argc, char **argv);

#endif
