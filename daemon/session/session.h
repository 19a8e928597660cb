// SPDX-License-Identifier: Apache-2.0
/// Events of a recorded session's index; session.md describes the directory. An event is one line
/// of the index: printing a parsed event gives the same bytes.
#ifndef VERGENCE_DAEMON_SESSION_SESSION_H
#define VERGENCE_DAEMON_SESSION_SESSION_H

#include <stddef.h>
#include <stdint.h>

#include "console/pair/pair_instrument.h"
#include "rig/pair.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SESSION_INDEX_NAME "session.index"
#define SESSION_CALLS_NAME "calls.log"

enum {
    SESSION_VERSION = 6,  // 2: the instrument, image statistics; 3: units of settings; 4: stamped
                          // calls; 5: means of lens positions; 6: the calibration of all zooms
    SESSION_VERSION_REPLAYED = 5,  // the oldest whose calls are replayed
    SESSION_LINE_MAX = 4096,       // maximum length of a line of the index, without its end
    SESSION_TEXT_MAX = 1024,       // maximum length of a command or a note, without its end
    SESSION_NAME_MAX = 64,         // maximum length of the name of a file, a profile or a build
    SESSION_REGISTERS_MAX = 256,
    SESSION_CRC_DIGITS = 8,
};

enum session_event_kind {
    SESSION_BEGIN,             // the build that recorded it: always the first
    SESSION_INSTRUMENT,        // the instrument that took the frames
    SESSION_CALIBRATION,       // the calibration in force from here on
    SESSION_ZOOM_CALIBRATION,  // that of all zooms, which calibrations come from here on
    SESSION_SETTING,           // a setting of the instrument that differs from its profile
    SESSION_COMMAND,           // a command that a user gave
    SESSION_REGISTERS,         // the registers of a part, read one after the other
    SESSION_PAIR,
    SESSION_END,  // closed properly; a session without it was cut off
    SESSION_EVENT_KINDS
};

struct session_event {
    enum session_event_kind kind;
    uint8_t version;                                                  // BEGIN: 1..SESSION_VERSION
    char build[SESSION_NAME_MAX + 1], profile[SESSION_NAME_MAX + 1];  // BEGIN
    char date[SESSION_NAME_MAX + 1];                                  // BEGIN, ISO 8601
    struct pair_instrument instrument;                                // INSTRUMENT
    uint32_t crc32;                                                   // *CALIBRATION: of its text
    char text[SESSION_TEXT_MAX + 1];                                  // COMMAND, SETTING
    char part[SESSION_NAME_MAX + 1];                                  // REGISTERS
    uint64_t at_us;                                                   // REGISTERS
    uint16_t first, count, values[SESSION_REGISTERS_MAX];             // REGISTERS
    struct pair pair;               // PAIR; its images have no pixels, and rows without gaps
    uint32_t frame_crc[RIG_SIDES];  // PAIR: of each frame's file
};

/// Name of the file of a frame or a calibration: by the CRC-32 of its bytes.
void session_frame_name(uint32_t crc32, char name[SESSION_NAME_MAX + 1]);
void session_calibration_name(uint32_t crc32, char name[SESSION_NAME_MAX + 1]);
void session_zoom_calibration_name(uint32_t crc32, char name[SESSION_NAME_MAX + 1]);

/// Writes the header of an image's file: PGM or PPM, one byte a value up to 8 bits, else two,
/// big-endian. Returns its length. Pixels of an RGB image are three values.
int session_frame_head(const struct raw_image *image, char head[SESSION_NAME_MAX + 1]);
/// Bytes of a value in the file.
unsigned session_frame_value_bytes(const struct raw_image *image);

/// Prints an event without CRC and line end into `line`. Returns its length, or ERROR_RANGE if a
/// text, a size or a number of bits cannot be represented.
int session_event_print(const struct session_event *event, char line[SESSION_LINE_MAX + 1]);

/// Parses a line of `session_event_print`, `length` bytes. ERROR_SYNTAX if printing the event would
/// not give the same line; `event` is undefined then.
int session_event_parse(const char *line, size_t length, struct session_event *event);

#ifdef __cplusplus
}
#endif

#endif
