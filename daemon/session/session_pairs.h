// SPDX-License-Identifier: Apache-2.0
/// The pairs of a session: one after the other as events, or all of them as files for commands that
/// work on images.
#ifndef VERGENCE_DAEMON_SESSION_SESSION_PAIRS_H
#define VERGENCE_DAEMON_SESSION_SESSION_PAIRS_H

#include <stdbool.h>
#include <stdint.h>

#include "console/pair/calibration_match.h"
#include "daemon/base/message.h"
#include "daemon/session/session.h"
#include "daemon/session/session_read.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SESSION_PAIRS_PATH_BYTES = 4096 };

/// Begins the text of a command event, followed by a number: from here on the calibration board
/// is at its position of this number. To the console it is a comment.
#define SESSION_BOARD_POSITION "# board position "

/// The text of a command event: both lenses were focused on the calibration board that the next
/// pair shows, on its part next to the middle of the picture.
#define SESSION_FOCUSED_ON_BOARD "# focused on the board"

/// Begins the text of a command event, followed by the noise of a corner in the left and in the
/// right camera (rms distance from its mean place, px) and the number of still frames that show it.
#define SESSION_CORNER_NOISE "# corner noise "

struct session_corner_noise {
    double px[2];
    uint32_t frames;  // 0: not measured
};

/// Iterates over a session's pairs. Large: static or allocated; zeroed at the beginning.
struct session_pairs {
    uint32_t count;             // pairs found so far, which is the number of the last one
    struct session_event pair;  // the last pair; its frames are not checked
    bool has_calibration;       // whether one was in force at that pair
    uint32_t calibration_crc;
    bool has_zoom_calibration;  // whether the session has that of all zooms
    uint32_t zoom_calibration_crc;
    uint32_t board_position;  // board's position, see SESSION_BOARD_POSITION; 0: none
    bool focused_on_board;    // see SESSION_FOCUSED_ON_BOARD
    struct session_corner_noise corner_noise;
    bool has_instrument;  // the session records the instrument
    struct pair_instrument instrument;

    // Work space.
    struct session_event event;
    bool next_focused_on_board;
    bool next_has_calibration;
    uint32_t next_calibration_crc;
    bool next_has_zoom_calibration;
    uint32_t next_zoom_calibration_crc;
};

/// Moves to the next pair: returns 1, or 0 at the end, where `pair` stays the last one. Errors of
/// session_reader_next, and ERROR_MISSING at the end of a session without pairs.
int session_pairs_next(struct session_pairs *self, struct session_reader *reader,
                       struct message *message);

/// Finds pair `number`, from 1 (0: the last). Anything after it is ignored. 0, or errors as above;
/// ERROR_MISSING also if there are fewer pairs.
int session_pairs_find(struct session_pairs *self, struct session_reader *reader, uint32_t number,
                       struct message *message);

/// A pair's files, the left camera's first. Unless frames may be missing, both exist and are what
/// was recorded.
struct session_pair_files {
    char path[2][SESSION_PAIRS_PATH_BYTES];
    bool missing[2];                           // there is no such file
    bool mosaic;                               // the frames are raw mosaics: rows of G R and of B G
    struct calibration_match_state state;      // what they were taken with
    const struct pair *pair;                   // its images have no pixels
    uint32_t number;                           // number of the pair, from 1
    uint32_t board_position;                   // 0: none was recorded
    bool focused_on_board;                     // see SESSION_FOCUSED_ON_BOARD
    struct session_corner_noise corner_noise;  // last measurement before the pair
    uint32_t pan_visit;  // counts from 1: grows whenever a camera was turned since the last pair
};

/// Whether `path` is a directory with a session in it, intact or damaged.
bool session_pairs_here(const char *path);

/// Calls `each` for every pair of the session in `path`, in the order in which they were taken.
/// `frames_may_miss`: a frame without a file is not an error, for callers that know what it shows.
/// Returns their number, or ERROR_MISSING (no pairs, or a frame's file is missing), ERROR_CRC, and
/// errors of session_reader_open and session_reader_next; `message` names the session then.
int session_pairs_read(const char *path, bool frames_may_miss,
                       void (*each)(void *self, const struct session_pair_files *files), void *self,
                       struct message *message);

#ifdef __cplusplus
}
#endif

#endif
