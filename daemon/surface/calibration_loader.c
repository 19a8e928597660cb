// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/calibration_loader.h"

#include <stdio.h>
#include <string.h>

#include "core/error.h"
#include "daemon/files/input_file.h"
#include "daemon/surface/length_check.h"

static int describe_fault(const char *path, int error, const struct calibration_fault *fault,
                          struct message *message) {
    char place[96] = "";
    if (fault->line > 0) {
        snprintf(place, sizeof place, " line %d", fault->line);
    }
    if (error == ERROR_CRC) {
        return message_set(
            message, error,
            "%s:%s checksum mismatch: the text was edited or damaged (expected %08x for this text)",
            path, place, fault->crc);
    }
    const char *reason =
        fault->reason != NULL && fault->reason[0] != '\0' ? fault->reason : error_text(error);
    const char *field = fault->field != NULL ? fault->field : "";
    return message_set(message, error, "%s:%s%s%s: %s", path, place, field[0] != '\0' ? " " : "",
                       field, reason);
}

int calibration_loader_own(const struct calibration_request *request,
                           struct calibration *calibration,
                           char format[CALIBRATION_LOADER_FORMAT_BYTES], struct message *message) {
    const char *path = request->path;
    char text[CALIBRATION_TEXT_MAX_BYTES + 1];
    FILE *stream = input_file_open(path, message);
    if (stream == NULL) {
        return ERROR_ARGUMENT;
    }
    const size_t length = fread(text, 1, sizeof text, stream);
    const bool failed = ferror(stream) != 0;
    fclose(stream);
    if (failed) {
        return message_set(message, ERROR_ARGUMENT, "%s: cannot be read", path);
    }
    if (length == 0) {
        return message_set(message, ERROR_SYNTAX, "%s: the file is empty", path);
    }
    struct calibration_fault fault = {.line = 0, .field = ""};
    struct calibration parsed;
    const int error = calibration_parse(text, length, &parsed, &fault);
    if (error != ERROR_OK) {
        return describe_fault(path, error, &fault, message);
    }
    if (request->rectified && !parsed.rectified) {
        return message_set(message, ERROR_ARGUMENT,
                           "%s: not a rectified calibration (leave out --rectified)", path);
    }
    const bool short_is_meant = request->unit != NULL && strcmp(request->unit, "mm") == 0;
    const int length_error = short_is_meant
                                 ? ERROR_OK
                                 : length_check_baseline(calibration_baseline_mm(&parsed), path,
                                                         length_unit_option, message);
    if (length_error != ERROR_OK) {
        return length_error;
    }
    *calibration = parsed;
    snprintf(format, CALIBRATION_LOADER_FORMAT_BYTES, "vergence");
    return ERROR_OK;
}
