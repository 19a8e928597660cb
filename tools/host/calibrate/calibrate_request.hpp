// SPDX-License-Identifier: Apache-2.0
/// The command line of `vergence calibrate`.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_REQUEST_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_REQUEST_HPP

#include <string>

#include "tools/host/calibrate/calibrate_job.hpp"

struct calibrate_output {
    bool json, quiet;
};

/// Parses and checks the command line, and finds the pictures. Returns OPTIONS_CONTINUE or the exit
/// code to end with; `message` is then what is left to print, if anything.
int calibrate_request_parse(int argc, char **argv, calibrate_job *job, calibrate_output *output,
                            std::string *message);

/// The same for a caller of a library: nothing is printed, and without --out nothing will be
/// written. CLIENT_OK, or the exit code that the command would have, with `message` set.
int calibrate_request_read(int argc, char **argv, calibrate_job *job, std::string *message);

#endif
