// SPDX-License-Identifier: Apache-2.0
/// Writes a session's directory. Whatever happens (a kill at any moment, a full disk), the
/// directory stays readable and contains everything that was reported as written: frames are on
/// disk before the index line that names them, and a line counts only with its CRC at its end.
///
/// All functions return 0 or ERROR_FULL (no space), ERROR_IO, or as documented, with `message`
/// naming the file. After an error the event is not in the session, unless the disk did not even
/// allow its removal; later events may be written once there is space.
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
    SESSION_FILE_MODE = 0640  ///< mode of all files of a session; the directory has 0750
};

struct session_writer {
    char path[SESSION_WRITE_PATH_BYTES];
    int directory, index;  // descriptors; -1: closed
    uint32_t crc;          // CRC of the whole index so far
    int64_t good_bytes;    // valid length of the index; an incomplete line may follow
    uint32_t pairs;        // pairs written
    bool made;             // the directory was created, too
    bool resumed;          // the session existed, with an index of this CRC and length:
    uint32_t resumed_crc;
    int64_t resumed_bytes;
    /// Limit for the frames yet to be written, set after session_writer_begin, which sets none.
    uint64_t free_bytes;
    unsigned char buffer[SESSION_WRITE_BUFFER_BYTES];
    struct session_event event;  // the event being written
};

/// Creates the directory `path` (relative to the descriptor `parent` as in openat(2), AT_FDCWD: the
/// working directory) and begins the index. The directory may exist, but not as a link or with a
/// session in it. `build`, `profile` and `date` go into the index. ERROR_ARGUMENT if the name is
/// taken or the directory cannot be created; nothing of it is left then. The writer is large:
/// static or allocated.
int session_writer_begin(struct session_writer *self, int parent, const char *path,
                         const char *build, const char *profile, const char *date,
                         struct message *message);

/// Opens an existing session to write more events behind its last one; an END and an incomplete
/// line are taken off. Errors of session_reader_open and session_reader_next, ERROR_ARGUMENT for a
/// recording, to which nothing can be added, and ERROR_VERSION for another format; the session is
/// as before then.
int session_writer_resume(struct session_writer *self, int parent, const char *path,
                          struct message *message);

/// Whether a session of this name exists, to which `session_writer_resume` may add.
bool session_writer_exists(int parent, const char *path);

/// Checks that `session_writer_begin` would accept the name now, for callers with long work before
/// it. 0 or ERROR_ARGUMENT.
int session_writer_check(int parent, const char *path, struct message *message);

/// Records the instrument that takes the frames.
int session_writer_instrument(struct session_writer *self, const struct pair_instrument *instrument,
                              struct message *message);

/// Records that from here on this calibration (canonical text, `length` bytes) is in force.
int session_writer_calibration(struct session_writer *self, const char *text, size_t length,
                               struct message *message);

/// Records the calibration of all zooms that calibrations come from here on.
int session_writer_zoom_calibration(struct session_writer *self, const char *text, size_t length,
                                    struct message *message);

/// Records a command of a user. ERROR_RANGE if longer than SESSION_TEXT_MAX.
int session_writer_command(struct session_writer *self, const char *text, struct message *message);

/// Records a setting (see vergenced.conf) in which the instrument differs from its profile.
int session_writer_setting(struct session_writer *self, const char *key, const char *value,
                           struct message *message);

/// Records `count` (1 .. SESSION_REGISTERS_MAX) registers of a part, from number `first` on. They
/// are on disk with the next event of another kind, such as the pair they belong to.
int session_writer_registers(struct session_writer *self, const char *part, uint64_t at_us,
                             uint16_t first, const uint16_t *values, uint16_t count,
                             struct message *message);

/// Saves an image, under the name of their CRC, which `*crc32` receives; an existing file is
/// not written again.
int session_writer_frame(struct session_writer *self, const struct raw_image *image,
                         uint32_t *crc32, struct message *message);

/// CRC-32 of the file that an image would be saved in, which is its name.
uint32_t session_writer_frame_crc(const struct raw_image *image);

/// Records a pair with its frames, which must have pixels. Its number is its position in the
/// session.
int session_writer_pair(struct session_writer *self, const struct pair *pair,
                        struct message *message);

/// Writes the END event and closes the session. An error is that of this last line. Allowed if it
/// was never begun (a zeroed writer with descriptors -1).
int session_writer_end(struct session_writer *self, struct message *message);

/// Closes without an END event: readers see that the session was cut off. For a session with
/// something missing. Allowed if never begun.
void session_writer_leave(struct session_writer *self);

/// Appends a note, a comment to the console ("# measure ..."), to a session that has ended, which
/// is closed again. Errors of session_writer_resume, which refuses a recording, and
/// session_writer_command; on an error the session is as before, or,
/// on a full disk, without its END. Not while another writer has it.
int session_add_note(int parent, const char *path, const char *text, struct message *message);

/// Closes and removes what was written, as if the session had never been begun. `parent` as for
/// session_writer_begin. Other files in its directory stay.
void session_writer_discard(struct session_writer *self, int parent);

#ifdef __cplusplus
}
#endif

#endif
