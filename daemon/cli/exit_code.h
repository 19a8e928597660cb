// SPDX-License-Identifier: Apache-2.0
/// Exit codes of every command, as `vergence --help` prints them. A command ended by a signal uses
/// the codes of interrupt.h.
#ifndef VERGENCE_DAEMON_CLI_EXIT_CODE_H
#define VERGENCE_DAEMON_CLI_EXIT_CODE_H

enum client_exit {
    CLIENT_OK = 0,
    CLIENT_FAILED = 1,      // results could not be written, or out of memory
    CLIENT_USAGE = 2,       // invalid command line
    CLIENT_BAD_INPUT = 3,   // an image, calibration or other input is unusable
    CLIENT_NO_SURFACE = 4,  // the inputs are fine but nothing could be measured
    CLIENT_NOT_GOOD = 5,    // a calibration was written, but it is marked as not good
};

#endif
