// SPDX-License-Identifier: Apache-2.0
/// Sits between an instrument and its backends and writes every call with its time and result, and
/// the pixels of every frame, into a session: calls.log. daemon/backends/replay plays the calls
/// back.
///
/// While it records, the instrument's clock shows the time of the last call, and another time only
/// if RECORD_CLOCK_STEP_US have passed since: so a replay needs no record of each read.
///
/// Recording never disturbs the instrument: if the disk is full, recording ends and `last_error`
/// says why; calls continue. Like the rig, it is used by one thread at a time; another thread may
/// do the writing (`disk_writer`), so that no hardware call waits for a disk.
#ifndef VERGENCE_DAEMON_SESSION_RECORD_H
#define VERGENCE_DAEMON_SESSION_RECORD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "console/command.h"
#include "daemon/base/message.h"
#include "daemon/session/disk_writer.h"
#include "daemon/session/session_write.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    RECORD_BUFFER_BYTES = 1 << 16,
    RECORD_HELD_BYTES = 512,
    RECORD_CLOCK_STEP_US = 1000,
};

struct record_camera {
    struct record *record;
    const struct hal_camera *inner;
    int number;
};

/// The clock as the instrument sees it.
struct record_time {
    uint64_t us;
    unsigned reads;  // clock reads since the last line of calls.log
};

/// A command or an idling. It is held back until its first call, as it may never make one.
struct record_part {
    bool held;
    struct record_time begin;
    char command[SESSION_TEXT_MAX + 1];  // "": idling
    size_t bytes;
    char lines[RECORD_HELD_BYTES];  // lines of calls.log that are held back with the command
};

/// The caller owns it and must not move it while its ports are in use. It is large.
struct record {
    struct rig_ports inner;
    struct hal_clock clock;
    struct hal_clock_operations
        clock_operations;  // `idle_is_due` only where the inner clock has it
    struct hal_i2c i2c;
    struct hal_i2c_operations i2c_operations;  // `lines` only where the inner bus has it
    struct hal_gpio gpio;
    struct hal_uart uart;
    struct hal_camera camera[RIG_SIDES];
    struct hal_camera_operations camera_operations[RIG_SIDES];
    struct record_camera camera_state[RIG_SIDES];

    /// The disk writer, set by the caller after record_init. NULL: each call writes itself.
    struct disk_writer *disk_writer;

    struct session_writer *writer;  // NULL: not recording
    bool ending;                    // no more calls are recorded
    bool out_of_memory;  // no memory for a job: `memory_task` reports it to the disk writer
    struct disk_writer_task memory_task;
    int log;  // descriptor of calls.log
    uint64_t calls;
    struct record_time time;
    struct record_part part;
    bool cancelled;  // the cancellation of the running command is recorded
    size_t filled;
    char buffer[RECORD_BUFFER_BYTES];  // not yet passed to the disk writer

    // Used by the disk writer, except `failed`, which is atomic and set after `last_error`.
    uint32_t crc;               // CRC of calls.log so far
    int failed;                 // error that ended the recording; else 0
    struct message last_error;  // description of `failed`
};

/// Puts the recorder in front of `inner`, not yet recording. `*outer` receives the ports to use; a
/// port that is NULL stays NULL, and one port for both cameras stays one.
void record_init(struct record *self, const struct rig_ports *inner, struct rig_ports *outer);

/// From here on all calls go into the session, which must outlive `record_stop`; until then only
/// the disk writer may write into it. 0, ERROR_FULL, ERROR_REFUSED or ERROR_IO: then nothing is
/// recorded and the session is unchanged.
int record_start(struct record *self, struct session_writer *writer, struct message *message);

/// Runs a command as command_run does and adds `line`, as given, to the current recording, if there
/// is one and the command is to be recorded. A command that failed before it made any call is not
/// added: it did nothing, and the reason (a name that is taken, a full disk) does not exist in a
/// replay.
int record_run(struct record *self, const struct command *command, const struct command_call *call,
               const char *line);

/// The same for rig operations that are not commands: between these two calls `line` names what was
/// done. `error` is its result.
void record_command(struct record *self, const char *line);
void record_command_end(struct record *self, int error);

/// Calls rig_idle and returns its result. The recording marks its calls as those of no command.
int record_idle(struct record *self, struct rig *rig);

/// Records that the rig's observer asks the command to stop (its `should_stop` returns true).
/// Allowed more than once for a command.
void record_cancel(struct record *self);

/// Waits until everything recorded so far is on disk: call before a pair is written. Returns 0, or
/// the error that ended the recording.
int record_flush(struct record *self, struct message *message);

/// The time by the clock behind the recorder, which records nothing of it: for a command that gives
/// others, such as `measure`, between them.
uint64_t record_now_us(const struct record *self);

/// Whether a recording is in progress, even if it was cut off by an error.
bool record_is_under_way(const struct record *self);

/// Why the current recording was cut off; NULL: it was not, or there is none.
const char *record_cut(const struct record *self);

/// Ends the recording. Returns as `record_flush`; allowed if it was not started.
int record_stop(struct record *self, struct message *message);

// ---- what the ports of record_ports.c add

/// Whether calls are being recorded.
bool record_is_on(const struct record *self);

/// Adds one call that has just been made, with its results; nothing while not recording.
void record_call(struct record *self, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/// The time that the instrument's clock shows at `now_us`.
uint64_t record_clock(struct record *self, uint64_t now_us);

/// Copies the pixels and queues them for the disk; `*crc32` is set to the CRC of their file. False:
/// out of memory, which ends the recording.
bool record_frame(struct record *self, const struct hal_camera_frame *frame, uint32_t *crc32);

#ifdef __cplusplus
}
#endif

#endif
