// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/session_pairs.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "core/error.h"
#include "core/invariant.h"

// ---- as events

static void read_board_position(const char *text, uint32_t *position) {
    enum { DIGITS_MAX = 6 };
    const size_t lead = sizeof SESSION_BOARD_POSITION - 1;
    const size_t digits =
        strncmp(text, SESSION_BOARD_POSITION, lead) == 0 ? strspn(text + lead, "0123456789") : 0;
    if (digits > 0 && digits <= DIGITS_MAX && text[lead + digits] == '\0') {
        *position = (uint32_t)strtoul(text + lead, NULL, 10);
    }
}

static void read_corner_noise(const char *text, struct session_corner_noise *noise) {
    enum { FRAMES_MAX = 1000 };
    const double px_max = 100;
    struct session_corner_noise read = {.frames = 0};
    int length = 0;
    const int count = sscanf(text, SESSION_CORNER_NOISE "%lf %lf %4u%n", &read.px[0], &read.px[1],
                             &read.frames, &length);
    const bool whole = count == 3 && text[length] == '\0';
    if (whole && read.px[0] >= 0 && read.px[0] < px_max && read.px[1] >= 0 && read.px[1] < px_max &&
        read.frames > 0 && read.frames <= FRAMES_MAX) {
        *noise = read;
    }
}

int session_pairs_next(struct session_pairs *self, struct session_reader *reader,
                       struct message *message) {
    struct session_event *event = &self->event;
    int got = 0;
    while ((got = session_reader_next(reader, event, message)) == 1) {
        if (event->kind == SESSION_CALIBRATION) {
            self->next_has_calibration = true;
            self->next_calibration_crc = event->crc32;
        } else if (event->kind == SESSION_ZOOM_CALIBRATION) {
            self->next_has_zoom_calibration = true;
            self->next_zoom_calibration_crc = event->crc32;
        } else if (event->kind == SESSION_INSTRUMENT) {
            self->has_instrument = true;
            self->instrument = event->instrument;
        } else if (event->kind == SESSION_COMMAND) {
            read_board_position(event->text, &self->board_position);
            read_corner_noise(event->text, &self->corner_noise);
            self->next_focused_on_board |= strcmp(event->text, SESSION_FOCUSED_ON_BOARD) == 0;
        } else if (event->kind == SESSION_PAIR) {
            self->pair = *event;
            self->focused_on_board = self->next_focused_on_board;
            self->next_focused_on_board = false;
            self->has_calibration = self->next_has_calibration;
            self->calibration_crc = self->next_calibration_crc;
            self->has_zoom_calibration = self->next_has_zoom_calibration;
            self->zoom_calibration_crc = self->next_zoom_calibration_crc;
            self->count++;
            return 1;
        }
    }
    if (got == 0 && self->count == 0) {
        return message_set(message, ERROR_MISSING,
                           "%s: no pair in the session (nothing was captured)", reader->path);
    }
    INVARIANT(got <= 0);
    return got;
}

int session_pairs_find(struct session_pairs *self, struct session_reader *reader, uint32_t number,
                       struct message *message) {
    int got = 1;
    while (got == 1 && (number == 0 || self->count != number)) {
        got = session_pairs_next(self, reader, message);
    }
    if (got < 0) {
        return got;
    }
    if (number != 0 && self->count != number) {
        return message_set(message, ERROR_MISSING, "%s: no pair %u (the session has %u)",
                           reader->path, (unsigned)number, (unsigned)self->count);
    }
    return ERROR_OK;
}

// ---- as files

/// Joins "PATH/NAME" into `file`; false if that is too long.
static bool join(const char *path, const char *name, char file[SESSION_PAIRS_PATH_BYTES]) {
    const int length = snprintf(file, SESSION_PAIRS_PATH_BYTES, "%s/%s", path, name);
    return length > 0 && length < SESSION_PAIRS_PATH_BYTES;
}

bool session_pairs_here(const char *path) {
    char index[SESSION_PAIRS_PATH_BYTES];
    struct stat status;
    return join(path, SESSION_INDEX_NAME, index) && stat(index, &status) == 0;
}

/// Names the frames' files, which must be what was recorded.
static int look_at_files(const struct session_reader *reader, const struct session_event *event,
                         bool may_miss, struct session_pair_files *files, struct message *message) {
    for (int side = 0; side < RIG_SIDES; side++) {
        char name[SESSION_NAME_MAX + 1];
        session_frame_name(event->frame_crc[side], name);
        if (!join(reader->path, name, files->path[side])) {
            return message_set(message, ERROR_ARGUMENT, "%s: path too long", reader->path);
        }
        const int error = session_reader_check(reader, &event->pair.frame[side].image,
                                               event->frame_crc[side], message);
        files->missing[side] = error == ERROR_MISSING && may_miss;
        if (error != ERROR_OK && !files->missing[side]) {
            return error;
        }
    }
    files->mosaic = event->pair.frame[RIG_LEFT].image.layout == RAW_BAYER_GRBG;
    return ERROR_OK;
}

/// Work space of session_pairs_read.
struct reading {
    struct session_reader reader;
    struct session_pairs pairs;
    struct session_pair_files files;
    char profile[SESSION_NAME_MAX + 1];
    uint16_t pan_q4[RIG_SIDES];  // servo pulses of the last pair
};

/// What is known of a pair besides its files.
static void describe(struct reading *reading) {
    const struct session_pairs *pairs = &reading->pairs;
    struct session_pair_files *files = &reading->files;
    calibration_match_pair(reading->profile, pairs->has_instrument ? &pairs->instrument : NULL,
                           &pairs->pair.pair, &files->state);
    files->pair = &pairs->pair.pair;
    files->number = pairs->count;
    files->board_position = pairs->board_position;
    files->focused_on_board = pairs->focused_on_board;
    files->corner_noise = pairs->corner_noise;
    bool turned = pairs->count == 1;
    for (int side = 0; side < RIG_SIDES; side++) {
        const uint16_t pan_q4 = files->pair->frame[side].before.pan_q4;
        turned = turned || pan_q4 != reading->pan_q4[side];
        reading->pan_q4[side] = pan_q4;
    }
    files->pan_visit += turned;
}

int session_pairs_read(const char *path, bool frames_may_miss,
                       void (*each)(void *self, const struct session_pair_files *files), void *self,
                       struct message *message) {
    struct reading *reading = calloc(1, sizeof *reading);
    if (reading == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", path);
    }
    struct session_pairs *pairs = &reading->pairs;
    int code = session_reader_open(&reading->reader, AT_FDCWD, path, &pairs->event, message);
    if (code == ERROR_OK) {
        memcpy(reading->profile, pairs->event.profile, sizeof reading->profile);
        while ((code = session_pairs_next(pairs, &reading->reader, message)) == 1) {
            code = look_at_files(&reading->reader, &pairs->pair, frames_may_miss, &reading->files,
                                 message);
            if (code != ERROR_OK) {
                break;
            }
            describe(reading);
            each(self, &reading->files);
        }
        session_reader_close(&reading->reader);
    }
    code = code == ERROR_OK ? (int)pairs->count : code;
    free(reading);
    return code;
}
