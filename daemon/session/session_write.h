// SPDX-License-Identifier: Apache-2.0
/// Writes a session's directory. Whatever happens, a kill at any moment or a full disk, the
/// directory can be read, and what was told to be safe is in it: frames are on the disk before the
/// line of the index that names them, and a line counts only with its CRC at its end.
///
/// All functions return 0 or ERROR_FULL (no room), ERROR_IO, or what is said, with `message` naming
/// the file. After an error the event is not in the session, unless the disk did not
/// even let it be taken back; later events may be, once there is room.
#ifndef VERGENCE_DAEMON_SESSION_SESSION_WRITE_H
#define VERGENCE_DAEMON_SESSION_SESSION_WRITE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"
#include "daemon/session/session.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    SESSION_WRITE_PATH_BYTES = 4096,
    SESSION_WRITE_BUFFER_BYTES = 65536,
    SESSION_FILE_MODE = 0640  ///< of all files of a session; its directory has 0750
};

struct session_writer {
    char path[SESSION_WRITE_PATH_BYTES];
    int directory, index;  // descriptors; -1: closed
    uint32_t crc;          // of all of the index so far
    int64_t good_bytes;    // of the index: what is behind is a line that did not become whole
    uint32_t pairs;        // written
    bool made;             // the directory, not only the session in it
    unsigned char buffer[SESSION_WRITE_BUFFER_BYTES];
    struct session_event event;  // the one that is being written
};

/// Makes the directory `path`, as openat(2) understands it with the descriptor `parent` (AT_FDCWD:
/// a path as usual), and begins the index. It may be there, but no link, and no session in it.
/// `build`, `profile` and `date` go into the index. ERROR_ARGUMENT when there is something of that
/// name already, or when it cannot be made; then nothing of it is left. The writer is large: static
/// or allocated.
int session_writer_begin(struct session_writer *self, int parent, const char *path,
                         const char *build, const char *profile, const char *date,
                         struct message *message);

/// Whether `session_writer_begin` would find the name free now: for whoever has long work to do
/// first. 0, or ERROR_ARGUMENT as that.
int session_writer_check(int parent, const char *path, struct message *message);

/// What the frames are taken with.
int session_writer_instrument(struct session_writer *self,
                              const struct session_instrument *instrument, struct message *message);

/// From here on this calibration (canonical text, `length` bytes) is in force.
int session_writer_calibration(struct session_writer *self, const char *text, size_t length,
                               struct message *message);

/// Somebody gave this command. Longer ones than SESSION_TEXT_MAX are ERROR_RANGE.
int session_writer_command(struct session_writer *self, const char *text, struct message *message);

/// A setting (see vergenced.conf) in which the instrument differs from its profile.
int session_writer_setting(struct session_writer *self, const char *key, const char *value,
                           struct message *message);

/// `count` (1 .. SESSION_REGISTERS_MAX) registers of a part, from number `first` on. The disk has
/// them when it has the next event of another kind: a pair, of which they tell.
int session_writer_registers(struct session_writer *self, const char *part, uint64_t at_us,
                             uint16_t first, const uint16_t *values, uint16_t count,
                             struct message *message);

/// Saves a frame's pixels alone, under the name of their CRC, which `*crc32` receives; what is
/// there already is not written again. Of `frame` only pixels and their form count.
int session_writer_frame(struct session_writer *self, const struct pair_frame *frame,
                         uint32_t *crc32, struct message *message);

/// The CRC-32 of the file that a frame's pixels would be saved in, which is its name.
uint32_t session_writer_frame_crc(const struct pair_frame *frame);

/// A pair with its frames, which must have their data. Its number is its place in the session.
int session_writer_pair(struct session_writer *self, const struct pair *pair,
                        struct message *message);

/// Says in the index that this was all, and lets go. An error is that of the index's last line.
/// Harmless when it was never begun (a zeroed writer with descriptors -1).
int session_writer_end(struct session_writer *self, struct message *message);

/// Lets go without saying so: readers are told that the session was cut off. For one of which
/// something is missing. Harmless as above.
void session_writer_leave(struct session_writer *self);

/// Lets go and takes away what was written, as if it had never been begun: for a session that is
/// of no use. `parent` is that of the beginning. What else stood in its directory stays.
void session_writer_discard(struct session_writer *self, int parent);

#ifdef __cplusplus
}
#endif

#endif
