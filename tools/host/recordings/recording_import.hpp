// SPDX-License-Identifier: Apache-2.0
/// A recording of another program as a session.
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_RECORDING_IMPORT_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_RECORDING_IMPORT_HPP

#include "tools/host/recordings/pair_source.hpp"

struct recording_import_request {
    pair_source_request source;
    std::string out;           // the new session's directory
    std::string calibration;   // file; "": the recording's own; "none": none
    bool rectified = false;    // use the rectified cameras of the calibration
    int every = 1, pairs = 0;  // one of every so many pairs; at most so many, 0: all
};

/// Writes the session, whole or not at all, and returns its number of pairs. Throws import_failure:
/// ERROR_IO or ERROR_MEMORY, ERROR_CANCELLED, or an error of the recording.
int recording_import(const recording_import_request &request);

#endif
