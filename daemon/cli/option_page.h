// SPDX-License-Identifier: Apache-2.0
/// What the parser of a command's options and its help share.
#ifndef VERGENCE_DAEMON_CLI_OPTION_PAGE_H
#define VERGENCE_DAEMON_CLI_OPTION_PAGE_H

#include <stddef.h>

#include "console/command.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Exit codes of every command, as `vergence --help` prints them. A command ended by a signal uses
/// the codes of interrupt.h.
enum client_exit {
    CLIENT_OK = 0,
    CLIENT_FAILED = 1,      // results could not be written, or out of memory
    CLIENT_USAGE = 2,       // invalid command line
    CLIENT_BAD_INPUT = 3,   // an image, calibration or other input is unusable
    CLIENT_NO_SURFACE = 4,  // the inputs are fine but nothing could be measured
    CLIENT_NOT_GOOD = 5,    // a calibration was written, but it is marked as not good
};

struct option_page {
    const char *command;  // "vergence reconstruct"
    // As help shows them, e.g. "LEFT RIGHT"; "" for none. If "[OPTIONS]" is among them, options are
    // shown there, else after them.
    const char *operands;
    const char *summary;      // one line, no full stop
    const char *description;  // paragraphs separated by one line feed; wrapped by the printer
    const char *examples;     // lines without indentation; NULL for none
    const struct command_argument *options;  // their `offset` is into the struct of values
    unsigned option_count;
    int operands_min, operands_max;
};

/// Return value of options_parse if the command should run.
enum { OPTIONS_CONTINUE = -1 };

#ifdef __cplusplus
}
#endif

#endif
