// SPDX-License-Identifier: Apache-2.0
/// Stands between an instrument and its backends and writes down every call with its answer, and
/// the pixels of every frame, into a session: calls.log. daemon/backends/replay answers the same
/// calls again.
///
/// Recording never disturbs: when the disk is full it ends, and says so in `trouble`; the calls go
/// on. As the rig, it is used by one thread at a time; what it writes, another one may write
/// meanwhile (`scribe`), so that no call of the hardware waits for a disk.
#ifndef VERGENCE_DAEMON_SESSION_RECORD_H
#define VERGENCE_DAEMON_SESSION_RECORD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "console/command.h"
#include "daemon/base/message.h"
#include "daemon/session/scribe.h"
#include "daemon/session/session_write.h"
#include "daemon/session/trace.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RECORD_BUFFER_BYTES = 1 << 16 };

struct record_camera {
    struct record *record;
    const struct hal_camera *inner;
    int number;
};

/// The caller owns it; it must not be moved while its ports are in use. It is large.
struct record {
    struct rig_ports inner;
    struct hal_clock clock;
    struct hal_i2c i2c;
    struct hal_i2c_operations i2c_operations;  // `lines` only where the inner bus has it
    struct hal_gpio gpio;
    struct hal_uart uart;
    struct hal_camera camera[RIG_SIDES];
    struct hal_camera_operations camera_operations[RIG_SIDES];
    struct record_camera camera_state[RIG_SIDES];

    /// Who writes: set by the caller after record_init. NULL: each call does so itself.
    struct scribe *scribe;

    struct session_writer *writer;  // NULL: nothing is recorded
    bool ending;                    // no more calls are wanted
    bool starved;                   // there was no memory for one; `starving` tells the scribe
    struct scribe_task starving;
    int log;  // descriptor of calls.log
    uint64_t calls;
    char note[SESSION_TEXT_MAX + 1];  // the command that runs, until its first call; "": none
    size_t filled;
    char buffer[RECORD_BUFFER_BYTES];  // what was not handed over yet

    // The scribe's, but for `failed`, which is read and set at once, `trouble` before it.
    uint32_t crc;            // of calls.log so far
    int failed;              // why nothing is recorded any more, an error; else 0
    struct message trouble;  // why
};

/// Puts the recorder in front of `inner`, recording nothing yet. `*outer` are the ports to use; a
/// port that is NULL stays NULL, and one port for both cameras stays one.
void record_init(struct record *self, const struct rig_ports *inner, struct rig_ports *outer);

/// From here on all calls go into the session, which must outlive `record_stop`; only the scribe
/// may write into it until then. 0, ERROR_FULL, ERROR_REFUSED or ERROR_IO: nothing is recorded, and
/// the session is as it was.
int record_start(struct record *self, struct session_writer *writer, struct message *message);

/// Carries a command out as command_run does, and puts `line`, as it was given, into the recording
/// that is under way, if one is and the command is for recordings. One that failed before it made
/// any call was refused for a reason that no player has (a name that is taken, a full disk), and
/// did nothing: it is not put there.
int record_run(struct record *self, const struct command *command, const struct command_call *call,
               const char *line);

/// Likewise for what is done with the rig without a command: between the two calls `line` would
/// have done it. `error` is what it ended with.
void record_command(struct record *self, const char *line);
void record_command_end(struct record *self, int error);

/// Says that the calls to come are those of rig_idle, which no command has asked for: to be called
/// before each rig_idle. A player is told by replay_idle_is_next.
void record_idle(struct record *self);

/// Says that here whoever watches the rig wanted its command to end (`go_on` of its observer said
/// so): to be called once a command. A player is told by replay_cancel_is_next.
void record_cancel(struct record *self);

/// Sees to it that what was recorded so far is on the disk: to be called before a pair is written.
/// Waits for the scribe. 0, or why recording has ended.
int record_flush(struct record *self, struct message *message);

/// Whether a recording is under way, cut off or not.
bool record_is_under_way(const struct record *self);

/// Why the recording that is under way is cut off; NULL: it is not, or there is none.
const char *record_cut(const struct record *self);

/// Ends it. As `record_flush`; harmless when it was not started.
int record_stop(struct record *self, struct message *message);

#ifdef __cplusplus
}
#endif

#endif
