// SPDX-License-Identifier: Apache-2.0
/// Replays a recorded session as cameras, buses and clock. Two modes:
///
/// - calls.log (written by daemon/record): every call gets its recorded answer. A call that differs
/// from the recorded one ends the replay: `trouble` states in one line both calls and the place.
/// From then on calls fail with ERROR_IO and every wait returns at once, so that nothing hangs.
/// - pairs only (a session without calls.log): two cameras deliver the recorded frames in order,
/// for a profile without bridge, servos and lenses.
///
/// The same calls give the same bytes: the system time is not used.
#ifndef VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_H
#define VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "daemon/base/message.h"
#include "daemon/session/session_read.h"
#include "daemon/session/trace.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Frames of one source that may be lent at a time.
enum { REPLAY_FRAMES_LENT = 2 };

struct replay_camera {
    struct replay *replay;
    int number;
    uint16_t *pixels[REPLAY_FRAMES_LENT];  // allocated; grows with the frames
    size_t values[REPLAY_FRAMES_LENT];
    bool lent[REPLAY_FRAMES_LENT];
    struct hal_camera_counts counts;  // pairs only
    uint64_t begin_us, end_us;        // pairs only: the frame that was lent last
    uint32_t sequence;                // pairs only: number of the next frame
    uint32_t of_pair;  // pairs only: the pair that it belongs to, from 1; 0: none yet
};

struct replay {
    struct session_reader session;
    struct rig_ports ports;  // the ports it provides
    struct hal_clock clock;
    struct hal_i2c i2c;
    struct hal_i2c_operations i2c_operations;
    struct hal_gpio gpio;
    struct hal_uart uart;
    struct hal_camera camera[RIG_SIDES];
    struct hal_camera_operations camera_operations[RIG_SIDES];
    struct replay_camera camera_state[RIG_SIDES];

    FILE *log;  // calls.log; NULL: pairs only
    uint32_t line;
    uint32_t lines;  // valid lines: up to the last matching check
    uint32_t calls;  // calls among them that are still to be made
    uint32_t made;   // calls that were made
    char text[TRACE_LINE_MAX * 2 + 16];
    bool peeked;             // `text` holds the next call
    bool ended;              // a mismatch occurred, or everything was replayed
    bool ran_out;            // the mismatch: more calls were made than recorded
    struct message trouble;  // the reason; "" if there is none
    uint64_t now_us;

    struct session_event *pairs;  // allocated; pairs only
    uint32_t pair_count;
    uint32_t next_pair;  // the pair that both cameras show
};

/// Opens the session `path` (see session_reader_open) and checks calls.log up to the last line that
/// is certainly complete; anything a kill cut off after it is not replayed. Errors: those of
/// session_reader_open; ERROR_CRC, ERROR_VERSION, ERROR_MISSING (neither calls nor pairs).
/// `profile` (SESSION_NAME_MAX + 1 bytes; may be NULL) receives the name of the recorded profile.
/// The object is large and must not be moved while open.
int replay_open(struct replay *self, int parent, const char *path, char *profile,
                struct message *message);

/// Whether rig_idle was called at this point of the recording: then call it and ask again. Ask
/// before each command and at the end. Consumes the mark of record_idle.
bool replay_idle_is_next(struct replay *self);

/// Whether the recorded command was cancelled here: then `go_on` of the rig's observer must return
/// false for the rest of the command. Consumes the mark of record_cancel.
bool replay_cancel_is_next(struct replay *self);

/// Whether every recorded call was made, or every pair was delivered.
bool replay_is_over(const struct replay *self);

/// Pairs only: both cameras show the next pair from now on. Call after a capture.
void replay_next_pair(struct replay *self);

/// Releases everything. Harmless after replay_open failed.
void replay_close(struct replay *self);

#ifdef __cplusplus
}
#endif

#endif
