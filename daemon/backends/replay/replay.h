// SPDX-License-Identifier: Apache-2.0
/// Replays a recorded session as cameras, buses and clock. Two modes:
///
/// - calls.log (written by daemon/session/record): every call gets its recorded answer. A call that
/// differs from the recorded one ends the replay: `last_error` states in one line both calls and
/// the place. From then on calls fail with ERROR_IO and every wait returns at once, so that nothing
/// hangs.
/// - pairs only (a session without calls.log): two cameras deliver the recorded frames in order,
/// for a profile without bridge, servos and lenses.
///
/// The same calls give the same bytes: the system time is not used. The clock shows the times of
/// the recorded calls, and has rig_idle called where it was while recording.
#ifndef VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_H
#define VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "daemon/base/message.h"
#include "daemon/session/session_read.h"
#include "daemon/session/trace.h"
#include "daemon/settings/config.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { REPLAY_LINE_BYTES = TRACE_LINE_MAX + 2 };

struct replay_camera {
    struct replay *replay;
    int number;
    struct hal_camera_counts counts;  // pairs only
    uint64_t begin_us, end_us;        // pairs only: the last frame
    uint32_t sequence;                // pairs only: number of the next frame
    uint32_t of_pair;  // pairs only: the pair that it belongs to, from 1; 0: none yet
};

struct replay {
    struct session_reader session;
    struct session_event event;  // the event that was read last
    // Build and profile of the recorder.
    char build[SESSION_NAME_MAX + 1], profile[SESSION_NAME_MAX + 1];
    uint32_t commands;       // number of commands in the index
    bool has_calls;          // false: the session has pairs only
    bool cut;                // the recording was cut off
    struct rig_ports ports;  // the ports it provides
    struct hal_clock clock;
    struct hal_i2c i2c;
    struct hal_i2c_operations i2c_operations;
    struct hal_gpio gpio;
    struct hal_uart uart;
    struct hal_camera camera[RIG_SIDES];
    struct hal_camera_operations camera_operations[RIG_SIDES];
    struct replay_camera camera_state[RIG_SIDES];

    /// Set by the owner after replay_open, or NULL. Called where the recorded command was
    /// cancelled, from within a call of the rig: cancels the running command as its client would.
    void (*cancel)(void *self);
    void *self;
    /// Pairs only, set by the owner: the rig behind the ports. After each of its pairs both cameras
    /// show the next one.
    const struct rig *rig;

    FILE *log;             // calls.log
    uint32_t line;         // number of the line in `text`
    uint32_t lines;        // valid lines: up to the last matching check
    uint32_t calls;        // calls among them that are still to be made
    uint32_t made;         // calls that were made
    uint32_t answer_line;  // number of the line in `answered`
    enum { REPLAY_NOTHING, REPLAY_CALL, REPLAY_TIME, REPLAY_IDLE } next;  // what `text` is
    char text[REPLAY_LINE_BYTES];                                         // read ahead
    char answered[REPLAY_LINE_BYTES];                                     // the last call
    bool ended;                 // a mismatch occurred, or everything was replayed
    bool ran_out;               // the mismatch: more calls were made than recorded
    struct message last_error;  // the reason; "" if there is none
    uint64_t now_us;
    uint64_t next_us;            // REPLAY_TIME: the time from read `next_reads` on
    unsigned reads, next_reads;  // clock reads since the last line; the read that takes `next_us`

    struct session_event *pairs;  // allocated; pairs only
    uint32_t pair_count;
    uint32_t next_pair;     // the pair that both cameras show
    uint32_t pairs_of_rig;  // the rig's count of pairs when it was last checked
};

/// Opens the session `path` (see session_reader_open) and checks calls.log up to the last line that
/// is certainly complete; anything a kill cut off after it is not replayed. Errors: those of
/// session_reader_open and session_reader_next; ERROR_CRC, ERROR_VERSION (its calls are of an older
/// version), ERROR_MISSING (neither calls nor pairs); of config_parse for invalid settings. With
/// calls, the instrument of `config` (may be NULL) is set to the recorded one, and nothing else of
/// it. The session is at its first event after BEGIN. The object is large and must not be moved
/// while open.
int replay_open(struct replay *self, int parent, const char *path, struct config *config,
                struct message *message);

/// Whether every recorded call was made, or every pair was delivered.
bool replay_is_over(const struct replay *self);

/// Releases everything. Harmless after replay_open failed.
void replay_close(struct replay *self);

// ---- used within this folder

/// Checks calls.log, reads its header and sets the ports. 0, or an error as for replay_open.
int replay_calls_open(struct replay *self, struct message *message);

/// Adds the pair in `event`.
int replay_add_pair(struct replay *self, struct message *message);
/// Sets up two cameras and a clock that replay all pairs.
int replay_pairs_open(struct replay *self, struct message *message);

/// Reads the frame `form` with its pixels. 0, or an error of session_reader_load, with `last_error`
/// set.
int replay_frame(struct replay_camera *camera, const struct pair_frame *form, uint32_t crc32,
                 struct hal_camera_frame *frame);

#ifdef __cplusplus
}
#endif

#endif
