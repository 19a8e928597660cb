// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/calibration_read.h"

#include <stdlib.h>

#include "core/error.h"

int calibration_read_zoom(const char *name, const char *text, size_t length,
                          struct zoom_calibration **zoom, struct message *message) {
    *zoom = malloc(sizeof **zoom);
    double *matrix = malloc(CALIBRATION_AT_MATRIX_BYTES);
    const int error =
        *zoom == NULL || matrix == NULL
            ? message_set(message, ERROR_MEMORY, "%s: out of memory", name)
            : calibration_at_parse_zoom(name, text, length, NULL, matrix, *zoom, message);
    free(matrix);
    if (error != ERROR_OK) {
        free(*zoom);
        *zoom = NULL;
    }
    return error;
}

int calibration_read_for_pair(const char *name, const char *text, size_t length,
                              const struct calibration_match_state *axes,
                              struct calibration *calibration, struct message *message) {
    struct zoom_calibration *zoom;
    if (!zoom_calibration_is_text(text, length)) {
        return calibration_at(name, text, length, calibration, message);
    }
    int error = calibration_read_zoom(name, text, length, &zoom, message);
    if (error == ERROR_OK) {
        error = calibration_at_zoom(zoom, axes, calibration, message);
        free(zoom);
    }
    return error;
}
