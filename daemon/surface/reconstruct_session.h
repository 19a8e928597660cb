// SPDX-License-Identifier: Apache-2.0
/// A captured pair, of a session or in memory, and its calibration as the inputs of a
/// reconstruction.
///
/// The calibration is that of the request, else the session's, else the saved one. It must fit the
/// frames' part of the sensor: one of the whole sensor is cut to the window that the session
/// records; one of the frames' own size is used unchanged; anything else is rejected.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_SESSION_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_SESSION_H

#include <stdint.h>

#include "daemon/session/last_pair.h"
#include "daemon/session/session_notes.h"
#include "daemon/surface/reconstruct_inputs.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RECONSTRUCT_SESSION_NAME_BYTES = 300 };

/// The `self` of reconstruct_session_read. Large: static or allocated.
struct reconstruct_session {
    // Set by the caller:
    int parent;        // directory descriptor, as for session_reader_open
    const char *path;  // path of the session
    uint32_t number;   // number of the pair, from 1; 0: the last
    /// A pair in memory, to be used in place of one in the session `path`; it must stay until the
    /// inputs are freed. NULL: none.
    const struct captured_pair *captured;
    const char *stored_text;  // the saved calibration, for sessions without one; NULL: none
    size_t stored_length;     // length of its text
    const char *missing;      // advice if there is no calibration: how to get one
    /// Loads the calibration that a request names; NULL if requests never name one.
    calibration_loader *load_calibration;
    /// Has a calibration in place of the file that the request names; NULL: none.
    const struct reconstruct_source *loaded;
    const struct adjust_target *target;  // as in reconstruct_adjust_scene; NULL: none
    int stored_error;                    // error of reading the saved one; 0: none is saved

    // After a read:
    bool own;       // the calibration is the session's own
    bool cut;       // the calibration was cut to the part of the sensor that the frames show
    bool adjusted;  // `calibration` was corrected by what the frames show
    struct calibration calibration;
    // Only during a read:
    struct zoom_calibration *zoom;  // zoom calibration that yields the calibration; NULL: none
    struct pair with_pair;          // the pair at another zoom

    struct session_notes notes;                  // of the session's measurement, if it has one
    struct captured_pair pair;                   // what was read; the images went to the inputs
    char label[RECONSTRUCT_SESSION_NAME_BYTES];  // the session's name in results, without
                                                 // directories
    char name[RIG_SIDES][RECONSTRUCT_SESSION_NAME_BYTES];
    char calibration_name[RECONSTRUCT_SESSION_NAME_BYTES];
};

/// A job's `read`. In addition to its errors: those of session_reader_open, ERROR_MISSING (no
/// such pair, no calibration), ERROR_CRC (a file differs from what was recorded).
int reconstruct_session_read(void *session, const struct reconstruct_request *request,
                             struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                             struct message *message);

/// The lens of an image reduced by means over `shrink` x `shrink` pixels.
struct lens reconstruct_session_shrink(const struct lens *lens, int shrink);

#ifdef __cplusplus
}
#endif

#endif
