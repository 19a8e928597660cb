// SPDX-License-Identifier: Apache-2.0
/// Plays a recorded session as cameras, buses and clock. Two ways:
///
/// - calls.log (made by daemon/record): every call is answered as it was. A call that is not the
///   recorded one ends it: `trouble` says in one line which call came, which was recorded and
///   where. From there on calls fail with ERROR_IO and every wait is over at once, so that nobody
///   hangs.
/// - pairs alone (a session without calls.log): two cameras that give the recorded frames one after
///   the other, for a profile without bridge, servos and lenses.
///
/// The same calls give the same bytes: nothing here asks the system for the time.
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

/// At most two frames of a source are lent at a time.
enum { REPLAY_FRAMES_LENT = 2 };

struct replay_camera {
    struct replay *replay;
    int number;
    uint16_t *pixels[REPLAY_FRAMES_LENT];  // allocated; grows with the frames
    size_t values[REPLAY_FRAMES_LENT];
    bool lent[REPLAY_FRAMES_LENT];
    struct hal_camera_counts counts;  // of pairs
    uint64_t begin_us, end_us;        // of pairs: of the frame that was lent last
    uint32_t sequence;                // of pairs: of the next frame
    uint32_t of_pair;                 // the pair that it is of, from 1; 0: none yet
};

struct replay {
    struct session_reader session;
    struct rig_ports ports;  // what it offers
    struct hal_clock clock;
    struct hal_i2c i2c;
    struct hal_i2c_operations i2c_operations;
    struct hal_gpio gpio;
    struct hal_uart uart;
    struct hal_camera camera[RIG_SIDES];
    struct hal_camera_operations camera_operations[RIG_SIDES];
    struct replay_camera camera_state[RIG_SIDES];

    FILE *log;  // calls.log; NULL: pairs alone
    uint32_t line;
    uint32_t lines;  // that count: up to the last check that fits
    uint32_t calls;  // among them that were not made yet
    uint32_t made;   // and that were
    char text[TRACE_LINE_MAX * 2 + 16];
    bool peeked;             // `text` is a call that was not made yet
    bool ended;              // trouble was met, or all was played
    bool ran_out;            // the trouble is that more was asked for than was recorded
    struct message trouble;  // why; "" while all is well
    uint64_t now_us;

    struct session_event *pairs;  // allocated; of pairs alone
    uint32_t pair_count;
    uint32_t next_pair;  // that both cameras see now
};

/// Opens the session `path` (see session_reader_open) and checks calls.log, up to the last line
/// that is certain to be whole: what a kill cut off behind it is not played. What
/// session_reader_open returns; ERROR_CRC, ERROR_VERSION, ERROR_MISSING (neither calls nor pairs).
/// `profile` (SESSION_NAME_MAX + 1 bytes; may be NULL) receives the name of the recorded profile.
/// Large; it must not be moved while it is open.
int replay_open(struct replay *self, int parent, const char *path, char *profile,
                struct message *message);

/// Whether rig_idle was called here: then it is to be called now, and this asked again. To be asked
/// before each command and at the end; takes what record_idle left.
bool replay_idle_is_next(struct replay *self);

/// Whether the recorded command was to end here: then `go_on` of the rig's observer is to say so
/// for the rest of the command. Takes what record_cancel left.
bool replay_cancel_is_next(struct replay *self);

/// Whether every recorded call was made, or every pair was given out.
bool replay_is_over(const struct replay *self);

/// Of pairs alone: both cameras see the next pair from here on. To be called when one was captured.
void replay_next_pair(struct replay *self);

/// Lets go of everything. Harmless when replay_open failed.
void replay_close(struct replay *self);

#ifdef __cplusplus
}
#endif

#endif
