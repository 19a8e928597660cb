// SPDX-License-Identifier: Apache-2.0
/// The console on UART0: a person at a terminal with a line editor, or a program that sends lines
/// (`@program`, `@framed`), as at the daemon's serial console.
#ifndef VERGENCE_BF537_CONSOLE_H
#define VERGENCE_BF537_CONSOLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "bf537/serial.h"
#include "console/command.h"
#include "console/line/editor.h"
#include "console/line/reply.h"
#include "rig/rig.h"

/// Use static storage: it is large.
struct bf537_console {
    struct bf537_serial *serial;
    struct rig *rig;
    struct command_table table;
    struct editor editor;
    struct reply reply;
    bool program;  ///< a program sends lines, without an editor
    bool framed;   ///< each of its lines has a CRC
    bool json;     ///< asked for by a line of options alone
    bool progress;
    bool cancelled;            ///< Ctrl-C has arrived for the running command
    bool too_long;             ///< the rest of a line is skipped
    uint64_t sign_of_life_us;  ///< when a framed program was last shown that a command runs
    char line[COMMAND_LINE_MAX + REQUEST_PREFIX_MAX + 2];
    size_t line_bytes;
    char storage[COMMAND_LINE_MAX + 1];
    struct command_value values[COMMAND_ARGUMENTS_MAX];
    char message[1024];
};

/// Begins, with a prompt. The rig's observer is bf537_console_observer.
void bf537_console_begin(struct bf537_console *self, struct bf537_serial *serial, struct rig *rig,
                         struct command_table table);
struct rig_observer bf537_console_observer(struct bf537_console *self);
/// Handles what has been received; runs the commands in it to their ends.
void bf537_console_step(struct bf537_console *self);

#endif
