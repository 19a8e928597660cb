// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/calibration_loader.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "core/error.h"
#include "daemon/files/input_file.h"
#include "daemon/session/calibration_read.h"
#include "daemon/surface/length_check.h"

static int check(const struct calibration_request *request, const struct calibration *parsed,
                 struct message *message) {
    if (request->rectified && !parsed->rectified) {
        return message_set(message, ERROR_ARGUMENT,
                           "%s: not a rectified calibration (leave out --rectified)",
                           request->path);
    }
    const bool short_is_meant = request->unit != NULL && strcmp(request->unit, "mm") == 0;
    return short_is_meant ? ERROR_OK
                          : length_check_baseline(calibration_baseline_mm(parsed), request->path,
                                                  length_unit_option, message);
}

int calibration_loader_own(const struct calibration_request *request,
                           struct calibration *calibration,
                           char format[CALIBRATION_LOADER_FORMAT_BYTES], struct message *message) {
    struct calibration parsed;
    size_t length = 0;
    char *text = malloc(CALIBRATION_AT_TEXT_BYTES + 1);
    if (text == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", request->path);
    }
    // One byte more than a calibration may have: calibration_at refuses it.
    int error =
        input_file_read(request->path, text, CALIBRATION_AT_TEXT_BYTES + 1, &length, message);
    error =
        error != ERROR_OK ? error : calibration_at(request->path, text, length, &parsed, message);
    free(text);
    error = error != ERROR_OK ? error : check(request, &parsed, message);
    if (error == ERROR_OK) {
        *calibration = parsed;
        snprintf(format, CALIBRATION_LOADER_FORMAT_BYTES, "vergence");
    }
    return error;
}

int calibration_loader_zoom(const char *path, struct zoom_calibration **zoom,
                            struct message *message) {
    struct stat status;
    size_t length = 0;
    *zoom = NULL;
    if (stat(path, &status) != 0 || !S_ISREG(status.st_mode)) {
        return ERROR_OK;
    }
    char *text = malloc(CALIBRATION_AT_TEXT_BYTES + 1);
    int error = text == NULL
                    ? message_set(message, ERROR_MEMORY, "%s: out of memory", path)
                    : input_file_read(path, text, CALIBRATION_AT_TEXT_BYTES + 1, &length, message);
    if (error == ERROR_OK && zoom_calibration_is_text(text, length)) {
        error = calibration_read_zoom(path, text, length, zoom, message);
    }
    free(text);
    return error;
}
