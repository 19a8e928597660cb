// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_session.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/session/calibration_match.h"
#include "daemon/session/session_pairs.h"
#include "daemon/session/session_read.h"
#include "device/mt9t001.h"

static int read_frame(const struct reconstruct_session *self, const struct session_reader *reader,
                      int side, const struct image_request *request, struct image_file *file,
                      struct message *message) {
    struct raw_image image = self->event.pair.frame[side].image;
    int error = session_reader_load(reader, &image, self->event.frame_crc[side], message);
    if (error != ERROR_OK) {
        return error;
    }
    memset(file, 0, sizeof *file);
    file->path = self->name[side];
    file->request = request;
    error = image_file_take(file, &image, message);
    file->request = NULL;
    return error;
}

static int parse_calibration(const char *name, const char *text, size_t length,
                             struct calibration *calibration, struct message *message) {
    struct calibration_fault fault = {.field = "", .reason = ""};
    const int error = calibration_parse(text, length, calibration, &fault);
    return error == ERROR_OK
               ? ERROR_OK
               : message_set(message, error, "%s:%d: %s%s%s", name, fault.line, fault.field,
                             fault.field[0] != '\0' ? ": " : "",
                             fault.reason[0] != '\0' ? fault.reason : error_text(error));
}

/// Reads the session's own calibration, in force when the pair was taken.
static int read_own(struct reconstruct_session *self, const struct session_reader *reader,
                    uint32_t crc32, struct calibration *calibration, struct message *message) {
    char text[CALIBRATION_TEXT_MAX_BYTES], file[SESSION_NAME_MAX + 1];
    session_calibration_name(crc32, file);
    snprintf(self->calibration_name, sizeof self->calibration_name, "%s/%s", self->path, file);
    const int length = session_reader_calibration(reader, crc32, text, sizeof text, message);
    return length < 0 ? length
                      : parse_calibration(self->calibration_name, text, (size_t)length, calibration,
                                          message);
}

/// Reads the request's calibration, else the session's own, else the saved one.
static int read_calibration(struct reconstruct_session *self, const struct session_reader *reader,
                            const struct session_pairs *pairs,
                            const struct reconstruct_request *request,
                            struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                            struct message *message) {
    struct calibration *const calibration = &inputs->calibration;
    if (request->calibration_path != NULL || request->rectified) {
        snprintf(self->calibration_name, sizeof self->calibration_name, "%s",
                 request->calibration_path != NULL ? request->calibration_path : "");
        return reconstruct_inputs_calibrate(request, self->load_calibration, inputs, context,
                                            message);
    }
    self->own = pairs->has_calibration;
    int error = ERROR_OK;
    if (self->own) {
        error = read_own(self, reader, pairs->calibration_crc, calibration, message);
    } else if (self->stored_text != NULL) {
        snprintf(self->calibration_name, sizeof self->calibration_name, "the saved calibration");
        error = parse_calibration(self->calibration_name, self->stored_text, self->stored_length,
                                  calibration, message);
    } else if (self->stored_error != 0) {
        return message_set(
            message, self->stored_error,
            "%s: no calibration in the session, and the saved one cannot be read: %s", self->path,
            error_text(self->stored_error));
    } else {
        return message_set(message, ERROR_MISSING, "%s: no calibration in the session%s",
                           self->path, self->missing);
    }
    if (error != ERROR_OK) {
        return error;
    }
    inputs->metric = true;
    inputs->calibration_path = self->calibration_name;
    snprintf(inputs->calibration_format, sizeof inputs->calibration_format, "vergence");
    if (calibration->note[0] != '\0') {
        reconstruct_context_warn(context, "calibration: %s", calibration->note);
    }
    return ERROR_OK;
}

struct lens reconstruct_session_cut(const struct lens *lens, const struct pair_window *window,
                                    int width_px, int height_px) {
    INVARIANT(window->skip >= 1);
    // Pixel u of the frame is at column + skip u of the sensor if u is even, and skip - 1 before
    // that if it is odd; their mean is (skip - 1) / 2 before.
    const double skip = window->skip;
    const double middle = (skip - 1) / 2;
    struct lens cut = *lens;
    cut.width_px = width_px;
    cut.height_px = height_px;
    cut.fx_px = lens->fx_px / skip;
    cut.fy_px = lens->fy_px / skip;
    cut.cx_px = (lens->cx_px - window->column_px + middle) / skip;
    cut.cy_px = (lens->cy_px - window->row_px + middle) / skip;
    return cut;
}

static bool is_for(const struct lens *lens, int width_px, int height_px) {
    return lens->width_px == width_px && lens->height_px == height_px;
}

static bool is_part(const struct pair_frame *frame) {
    return frame->window.skip != 0 && (frame->image.width_px != MT9T001_WIDTH_PX ||
                                       frame->image.height_px != MT9T001_HEIGHT_PX);
}

/// Fits one camera's part of the calibration to its frame.
static void cut_side(struct reconstruct_session *self, int side, struct calibration *calibration,
                     struct reconstruct_context *context) {
    const struct pair_frame *frame = &self->event.pair.frame[side];
    struct lens *lens = side == RIG_LEFT ? &calibration->left : &calibration->right;
    struct calibration_window *window = &calibration->origin.side[side].window;
    if (is_for(lens, frame->image.width_px, frame->image.height_px)) {
        if (window->skip == 0) {  // else match has checked it
            reconstruct_context_warn(context,
                                     "%s is for %dx%d pixels, the size of the %s frame: it is "
                                     "assumed to be for the same part of the sensor",
                                     self->calibration_name, frame->image.width_px,
                                     frame->image.height_px, side == RIG_LEFT ? "left" : "right");
        }
    } else if (is_for(lens, MT9T001_WIDTH_PX, MT9T001_HEIGHT_PX)) {
        *lens = reconstruct_session_cut(lens, &frame->window, frame->image.width_px,
                                        frame->image.height_px);
        *window = (struct calibration_window){frame->window.column_px, frame->window.row_px,
                                              frame->window.skip};
        self->cut = true;
    }
}

/// Fits the calibration to the frames as they were taken.
static int cut_to_window(struct reconstruct_session *self, struct calibration *calibration,
                         struct reconstruct_context *context, struct message *message) {
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct pair_frame *frame = &self->event.pair.frame[side];
        if (!is_part(frame)) {
            continue;
        }
        cut_side(self, side, calibration, context);
        if (side == RIG_LEFT && frame->window.skip > 1) {
            reconstruct_context_warn(context,
                                     "pixels are treated as evenly spaced, but with a skip of %d "
                                     "the two of a colour pair are %.3g px off",
                                     frame->window.skip,
                                     (frame->window.skip - 1) / (2.0 * frame->window.skip));
        }
    }
    const int error = self->cut ? calibration_round(calibration) : ERROR_OK;
    if (error != ERROR_OK || (self->cut && calibration_validate(calibration, NULL) != ERROR_OK)) {
        return message_set(
            message, ERROR_SIZE_MISMATCH,
            "%s cannot be cut to the frames' part of the sensor (choose a larger window)",
            self->calibration_name);
    }
    return ERROR_OK;
}

/// Rejects a calibration made with other axes, cameras or windows, or records that it was accepted.
static int match(struct reconstruct_session *self, const struct session_pairs *pairs,
                 const struct reconstruct_request *request, struct reconstruct_inputs *inputs,
                 struct reconstruct_context *context, struct message *message) {
    struct calibration *calibration = &inputs->calibration;
    struct calibration_match_state state;
    calibration_match_pair(self->profile, pairs->has_instrument ? &pairs->instrument : NULL,
                           &self->event.pair, &state);
    context->has_instrument = true;
    context->instrument = state.instrument;
    context->axes_compared = !calibration_match_is_partial(calibration, &state.origin);
    const char *accept = request->accept_mismatch ? NULL : context->texts->accept;
    const int error = calibration_match(calibration, &state, accept, &context->mismatch);
    if (error != ERROR_OK && !request->accept_mismatch) {
        *message = context->mismatch;
        return error;
    }
    if (error != ERROR_OK) {
        reconstruct_context_warn(context, "accepted mismatch, lengths are not reliable: %s",
                                 context->mismatch.text);
    } else if (!context->axes_compared) {
        reconstruct_context_warn(context,
                                 "unknown whether %s matches this pair: one of them does not "
                                 "record pan, zoom, focus and iris",
                                 self->calibration_name);
    }
    return ERROR_OK;
}

/// A calibration that was assumed already fits the frames.
static int fit_calibration(struct reconstruct_session *self, const struct session_pairs *pairs,
                           const struct reconstruct_request *request,
                           struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                           struct message *message) {
    if (inputs->calibration_path == NULL) {
        return ERROR_OK;
    }
    int error = match(self, pairs, request, inputs, context, message);
    if (error == ERROR_OK) {
        error = cut_to_window(self, &inputs->calibration, context, message);
    }
    return error != ERROR_OK ? error
                             : reconstruct_inputs_fit(inputs, self->calibration_name, message);
}

static int read_all(struct reconstruct_session *self, const struct session_reader *reader,
                    const struct session_pairs *pairs, const struct reconstruct_request *request,
                    struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                    struct message *message) {
    struct image_file *const files[RIG_SIDES] = {&inputs->left, &inputs->right};
    const struct image_request image_request = {.scale = request->scale};
    int error = ERROR_OK;
    for (int side = 0; error == ERROR_OK && side < RIG_SIDES; side++) {
        char file[SESSION_NAME_MAX + 1];
        session_frame_name(self->event.frame_crc[side], file);
        snprintf(self->name[side], sizeof self->name[side], "%s/%s", self->path, file);
        error = read_frame(self, reader, side, &image_request, files[side], message);
    }
    if (error == ERROR_OK) {
        error = reconstruct_inputs_check(inputs, message);
    }
    if (error == ERROR_OK) {
        error = read_calibration(self, reader, pairs, request, inputs, context, message);
    }
    if (error == ERROR_OK) {
        error = fit_calibration(self, pairs, request, inputs, context, message);
    }
    return error;
}

/// The last part of its path, as the rest is meaningless to readers of the results elsewhere.
static void set_label(struct reconstruct_session *self) {
    const char *end = self->path + strlen(self->path);
    while (end > self->path && end[-1] == '/') {
        end--;
    }
    const char *begin = end;
    while (begin > self->path && begin[-1] != '/') {
        begin--;
    }
    snprintf(self->label, sizeof self->label, "%.*s", (int)(end - begin), begin);
}

static int find_pair(struct reconstruct_session *self, struct session_reader *reader,
                     struct session_pairs *pairs, struct reconstruct_context *context,
                     struct message *message) {
    const int error = session_pairs_find(pairs, reader, self->pair, message);
    if (error != ERROR_OK) {
        return error;
    }
    self->event = pairs->pair;
    self->found = pairs->count;
    set_label(self);
    context->capture = (struct capture_info){self->label, &self->event.pair};
    if (reader->cut) {
        reconstruct_context_warn(
            context, "%s was cut off or is still being written: there may be more pairs",
            self->path);
    }
    return ERROR_OK;
}

int reconstruct_session_read(void *session, const struct reconstruct_request *request,
                             struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                             struct message *message) {
    struct reconstruct_session *self = session;
    struct session_reader reader;
    memset(inputs, 0, sizeof *inputs);
    self->found = 0;
    self->own = self->cut = false;
    struct session_pairs *pairs = calloc(1, sizeof *pairs);
    if (pairs == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", self->path);
    }
    int error = session_reader_open(&reader, self->parent, self->path, &pairs->event, message);
    if (error == ERROR_OK) {
        memcpy(self->profile, pairs->event.profile, sizeof self->profile);
        error = find_pair(self, &reader, pairs, context, message);
        if (error == ERROR_OK) {
            error = read_all(self, &reader, pairs, request, inputs, context, message);
        }
        session_reader_close(&reader);
    }
    free(pairs);
    if (error != ERROR_OK) {
        reconstruct_inputs_free(inputs);
        return error;
    }
    reconstruct_inputs_doubt(inputs, context);
    return ERROR_OK;
}
