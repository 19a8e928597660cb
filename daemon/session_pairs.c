// SPDX-License-Identifier: Apache-2.0
#include "daemon/session_pairs.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/session_read.h"

/// "PATH/NAME" into `file`; false when that is too long.
static bool join(const char *path, const char *name, char file[SESSION_PAIRS_PATH_BYTES]) {
    const int length = snprintf(file, SESSION_PAIRS_PATH_BYTES, "%s/%s", path, name);
    return length > 0 && length < SESSION_PAIRS_PATH_BYTES;
}

bool session_pairs_here(const char *path) {
    char index[SESSION_PAIRS_PATH_BYTES];
    struct stat status;
    return join(path, SESSION_INDEX_NAME, index) && stat(index, &status) == 0;
}

/// Whether the frame's file is what was recorded.
static int check_frame(const struct session_reader *reader, const struct pair_frame *frame,
                       uint32_t crc32, struct message *message) {
    const size_t values = (size_t)session_frame_row_values(frame) * frame->height_px;
    uint16_t *data = malloc(values * sizeof *data);
    if (data == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: no memory for %zu pixels", reader->path,
                           values);
    }
    const int error = session_reader_frame(reader, frame, crc32, data, values, message);
    free(data);
    return error;
}

static int read_pair(const struct session_reader *reader, const struct session_event *event,
                     const char *path, struct session_pair_files *files, struct message *message) {
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct pair_frame *frame = &event->pair.frame[side];
        char name[SESSION_NAME_MAX + 1];
        session_frame_name(event->frame_crc[side], name);
        if (!join(path, name, files->path[side])) {
            return message_set(message, ERROR_ARGUMENT, "%s: the path is too long", path);
        }
        const int error = check_frame(reader, frame, event->frame_crc[side], message);
        if (error != ERROR_OK) {
            return error;
        }
    }
    files->mosaic = event->pair.frame[RIG_LEFT].layout == HAL_CAMERA_BAYER_GRBG;
    return ERROR_OK;
}

/// All events; `files` and `event` are work space.
static int read_all(struct session_reader *reader, const char *path, struct session_event *event,
                    struct session_pair_files *files,
                    void (*each)(void *self, const struct session_pair_files *files), void *self,
                    struct message *message) {
    int pairs = 0, code = 0;
    while ((code = session_reader_next(reader, event, message)) == 1) {
        if (event->kind == SESSION_CALIBRATION) {
            char name[SESSION_NAME_MAX + 1];
            session_calibration_name(event->crc32, name);
            if (!join(path, name, files->calibration)) {
                return message_set(message, ERROR_ARGUMENT, "%s: the path is too long", path);
            }
        } else if (event->kind == SESSION_PAIR) {
            const int error = read_pair(reader, event, path, files, message);
            if (error != ERROR_OK) {
                return error;
            }
            each(self, files);
            pairs++;
        }
    }
    if (code == 0 && pairs == 0) {
        return message_set(message, ERROR_MISSING,
                           "%s: the session holds no pair: nothing was captured", path);
    }
    INVARIANT(code <= 0);
    return code == 0 ? pairs : code;
}

int session_pairs_read(const char *path,
                       void (*each)(void *self, const struct session_pair_files *files), void *self,
                       struct message *message) {
    struct session_reader reader;
    struct session_event *event = malloc(sizeof *event);
    struct session_pair_files *files = calloc(1, sizeof *files);
    int code = ERROR_MEMORY;
    if (event == NULL || files == NULL) {
        message_set(message, code, "%s: no memory", path);
    } else {
        code = session_reader_open(&reader, AT_FDCWD, path, event, message);
        if (code == 0) {
            code = read_all(&reader, path, event, files, each, self, message);
            session_reader_close(&reader);
        }
    }
    free(event);
    free(files);
    return code;
}
