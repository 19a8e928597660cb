// SPDX-License-Identifier: Apache-2.0
/// A recorded pair and its calibration as the inputs of a reconstruction.
///
/// The calibration is the one that the request names, else the session's, else the kept one. It is
/// for frames of one part of the sensor. One of the whole sensor is cut to the
/// part that the frames show, which the session tells; one of the frames' own size is taken as it
/// is; anything else is refused.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_SESSION_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_SESSION_H

#include <stdint.h>

#include "daemon/session/session.h"
#include "daemon/surface/reconstruct_inputs.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RECONSTRUCT_SESSION_NAME_BYTES = 300 };

/// The `self` of reconstruct_session_read. Large: static or allocated.
struct reconstruct_session {
    // Set by the caller:
    int parent;             // as session_reader_open has it
    const char *path;       // of the session
    uint32_t pair;          // which one, from 1; 0: the last
    const char *kept_text;  // a calibration for sessions that have none; NULL: there is none
    size_t kept_length;     // of its text
    const char *lack;       // what to say where there is none: how to come by one
    /// Of the calibration that a request names; NULL where none does.
    calibration_loader *load_calibration;
    int kept_error;  // why there is none: it cannot be read; 0: none is kept

    // After a read:
    uint32_t found;                      // the pair's place in the session, from 1
    bool own;                            // the calibration is the session's, and not another one
    bool cut;                            // to the part of the sensor that the frames show
    struct session_event event;          // of the pair
    char profile[SESSION_NAME_MAX + 1];  // of the instrument that took it
    char label[RECONSTRUCT_SESSION_NAME_BYTES];  // the session's name in results: no directories
    char name[RIG_SIDES][RECONSTRUCT_SESSION_NAME_BYTES];
    char calibration_name[RECONSTRUCT_SESSION_NAME_BYTES];
};

/// A source's `read`. Beside what that may return: errors of session_reader_open, ERROR_MISSING (no
/// such pair, no calibration), ERROR_CRC (a file is not what was recorded).
int reconstruct_session_read(void *session, const struct reconstruct_request *request,
                             struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                             struct message *message);

/// Cuts the lens of a whole sensor to the frame that a window of it gives. Pixels are taken in
/// pairs (a colour sensor's), so with a skip the frame's pixels are not evenly spaced; the mean
/// place of the two counts.
struct lens reconstruct_session_cut(const struct lens *lens, const struct pair_window *window,
                                    int width_px, int height_px);

#ifdef __cplusplus
}
#endif

#endif
