// SPDX-License-Identifier: Apache-2.0
/// Exit codes of every command, as `vergence --help` prints them. A command that a signal stopped
/// ends with the codes of interrupt.h.
#ifndef VERGENCE_DAEMON_CLI_EXIT_CODE_H
#define VERGENCE_DAEMON_CLI_EXIT_CODE_H

enum client_exit {
    CLIENT_OK = 0,
    CLIENT_FAILED = 1,      // writing results failed, memory ran out
    CLIENT_USAGE = 2,       // the command line makes no sense
    CLIENT_BAD_INPUT = 3,   // an image, calibration or other input is unusable
    CLIENT_NO_SURFACE = 4,  // the inputs are fine but nothing could be measured
    CLIENT_NOT_GOOD = 5,    // a calibration was written, but it is not good and says so
};

#endif
