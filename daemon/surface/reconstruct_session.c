// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_session.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/pair/calibration_fit.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/session/calibration_read.h"
#include "daemon/session/session_pairs.h"
#include "daemon/session/session_read.h"
#include "daemon/surface/reconstruct_adjust.h"
#include "device/mt9t001.h"

static const char saved_name[] = "the saved calibration";

static void axes_of_pair(const struct reconstruct_session *self,
                         struct calibration_match_state *axes) {
    calibration_match_pair(self->pair.profile,
                           self->pair.has_instrument ? &self->pair.instrument : NULL,
                           &self->pair.pair, axes);
}

/// The session's own text, the calibration of all zooms, or the saved text.
static int read_text(struct reconstruct_session *self, struct calibration *calibration,
                     struct message *message) {
    struct calibration_match_state axes;
    axes_of_pair(self, &axes);
    if (self->own) {
        return calibration_read_for_pair(self->calibration_name, self->pair.calibration,
                                         self->pair.calibration_length, &axes, calibration,
                                         message);
    }
    if (self->zoom != NULL) {
        return calibration_at_zoom(self->zoom, &axes, calibration, message);
    }
    if (self->stored_text != NULL) {
        snprintf(self->calibration_name, sizeof self->calibration_name, "%s", saved_name);
        return calibration_at(saved_name, self->stored_text, self->stored_length, calibration,
                              message);
    }
    if (self->stored_error != 0) {
        return message_set(
            message, self->stored_error,
            "%s: no calibration in the session, and the saved one cannot be read: %s", self->path,
            error_text(self->stored_error));
    }
    return message_set(message, ERROR_MISSING, "%s: no calibration in the session%s", self->path,
                       self->missing);
}

/// Reads the request's calibration, else the session's own, else the saved one.
static int read_calibration(struct reconstruct_session *self,
                            const struct reconstruct_request *request,
                            struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                            struct message *message) {
    struct calibration *const calibration = &inputs->calibration;
    self->own = self->pair.calibration_length > 0;
    if (self->zoom == NULL && (request->calibration_path != NULL || request->rectified)) {
        snprintf(self->calibration_name, sizeof self->calibration_name, "%s",
                 request->calibration_path != NULL ? request->calibration_path : "");
        return self->loaded != NULL
                   ? reconstruct_inputs_copy(request, self->loaded, inputs, context, message)
                   : reconstruct_inputs_calibrate(request, self->load_calibration, inputs, context,
                                                  message);
    }
    const int error = read_text(self, calibration, message);
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

struct lens reconstruct_session_shrink(const struct lens *lens, int shrink) {
    struct lens small = *lens;
    INVARIANT(shrink >= 1);
    small.width_px /= shrink;
    small.height_px /= shrink;
    small.fx_px /= shrink;
    small.fy_px /= shrink;
    small.cx_px = (lens->cx_px + 0.5) / shrink - 0.5;
    small.cy_px = (lens->cy_px + 0.5) / shrink - 0.5;
    return small;
}

static bool is_part(const struct pair_frame *frame) {
    return frame->window.skip != 0 && (frame->image.width_px != MT9T001_WIDTH_PX ||
                                       frame->image.height_px != MT9T001_HEIGHT_PX);
}

/// Fits one camera's part of the calibration to its frame.
static void cut_side(struct reconstruct_session *self, int side, struct calibration *calibration,
                     struct reconstruct_context *context) {
    const struct pair_frame *frame = &self->pair.pair.frame[side];
    const enum calibration_fit fit = calibration_fit_side(calibration, side, frame);
    // Else match has checked it.
    if (fit == CALIBRATION_FITS && calibration->origin.side[side].window.skip == 0) {
        reconstruct_context_warn(context,
                                 "%s is for %dx%d pixels, the size of the %s frame: it is "
                                 "assumed to be for the same part of the sensor",
                                 self->calibration_name, frame->image.width_px,
                                 frame->image.height_px, rig_side_names[side]);
    }
    self->cut |= fit == CALIBRATION_CUT;
}

/// Fits the calibration to the frames as they were taken.
static int cut_to_window(struct reconstruct_session *self, struct calibration *calibration,
                         struct reconstruct_context *context, struct message *message) {
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct pair_frame *frame = &self->pair.pair.frame[side];
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
static int match(struct reconstruct_session *self, const struct reconstruct_request *request,
                 struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                 struct message *message) {
    struct calibration *calibration = &inputs->calibration;
    struct calibration_match_state state;
    axes_of_pair(self, &state);
    context->has_instrument = true;
    context->instrument = state.instrument;
    context->axes = state.origin;
    context->axes_compared = !calibration_match_is_partial(calibration, &state.origin);
    const char *accept = request->accept_mismatch ? NULL : context->caller->accept;
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

/// Whether the session's own calibration, if it has one, comes from this one.
static bool is_from(const struct reconstruct_session *self, const struct zoom_calibration *zoom) {
    struct calibration own;
    return self->pair.calibration_length == 0 ||
           (calibration_parse(self->pair.calibration, self->pair.calibration_length, &own, NULL) ==
                ERROR_OK &&
            strcmp(own.id, zoom->id) == 0);
}

/// Sets the calibration of all zooms that the pair's calibration comes from, allocated; NULL: none.
/// The request's, else the session's, else the saved one.
static int find_zoom(struct reconstruct_session *self, const struct reconstruct_request *request,
                     struct message *message) {
    const char *name = request->calibration_path != NULL ? request->calibration_path : saved_name;
    int error = ERROR_OK;
    if (request->rectified) {
        return ERROR_OK;
    }
    if (self->zoom != NULL && is_from(self, self->zoom)) {
        return ERROR_OK;
    }
    free(self->zoom);
    self->zoom = NULL;
    if (request->calibration_path != NULL) {
        error = calibration_loader_zoom(name, &self->zoom, message);
    } else if (self->stored_text != NULL &&
               zoom_calibration_is_text(self->stored_text, self->stored_length)) {
        error = calibration_read_zoom(name, self->stored_text, self->stored_length, &self->zoom,
                                      message);
    }
    if (self->zoom != NULL && !is_from(self, self->zoom)) {
        free(self->zoom);
        self->zoom = NULL;
    }
    if (self->zoom != NULL && self->pair.calibration_length == 0) {
        snprintf(self->calibration_name, sizeof self->calibration_name, "%s", name);
    }
    return error;
}

/// Rejects a second pair whose servos were set in between.
static int check_with_pair(const struct reconstruct_session *self, struct message *message) {
    for (int side = 0; side < RIG_SIDES; side++) {
        if (self->pair.pair.frame[side].before.pan_q4 !=
            self->with_pair.frame[side].before.pan_q4) {
            return message_set(message, ERROR_MISMATCH,
                               "%s: %s pan moved between pairs %u and %u: with-pair needs it "
                               "untouched",
                               self->path, rig_side_names[side], (unsigned)self->pair.pair.number,
                               (unsigned)self->with_pair.number);
        }
    }
    return ERROR_OK;
}

/// Sets where the motors were. An error names the axis that is unknown or outside its range.
static int find_states(struct reconstruct_session *self, const struct pair *const *pairs, int count,
                       struct zoom_state *states, struct message *message) {
    int error = count > 1 ? check_with_pair(self, message) : ERROR_OK;
    for (int i = 0; i < count && error == ERROR_OK; i++) {
        struct calibration_match_state axes;
        calibration_match_pair(self->pair.profile,
                               self->pair.has_instrument ? &self->pair.instrument : NULL, pairs[i],
                               &axes);
        error = calibration_at_axes(&axes, &states[i], message);
        if (error == ERROR_OK) {
            error = calibration_at_zoom(self->zoom, &axes, &self->calibration, message);
        }
    }
    return error;
}

/// Without a calibration of all zooms nothing is corrected, so nothing may help with it.
static int refuse_one_zoom(const struct reconstruct_session *self,
                           const struct reconstruct_request *request, struct message *message) {
    if (request->with_pair == 0 && self->target == NULL) {
        return ERROR_OK;
    }
    return message_set(
        message, ERROR_MISSING, "%s needs a calibration of all zooms, which %s is not",
        request->with_pair > 0 ? "with-pair" : "a board or a length",
        request->calibration_path != NULL ? request->calibration_path : "the pair's");
}

/// Corrects the calibration by what the frames show, if it is of all zooms.
static int adjust(struct reconstruct_session *self, const struct reconstruct_request *request,
                  struct reconstruct_context *context, struct message *message) {
    const struct pair *const pairs[2] = {&self->pair.pair, &self->with_pair};
    struct zoom_state states[2];
    const int count = request->with_pair > 0 ? 2 : 1;
    // A loaded one is of one zoom.
    int error = self->loaded == NULL ? find_zoom(self, request, message) : ERROR_OK;
    if (error == ERROR_OK && self->zoom == NULL) {
        return refuse_one_zoom(self, request, message);
    }
    if (error != ERROR_OK) {
        return error;
    }
    error = find_states(self, pairs, count, states, message);
    if (error == ERROR_MISMATCH && self->pair.calibration_length > 0 && count == 1 &&
        self->target == NULL) {
        return ERROR_OK;  // the session's own calibration will do
    }
    if (error == ERROR_OK) {
        const struct pair_adjust_scene scene = {.near_mm = request->depth_mm[0],
                                                .target = self->target};
        error = reconstruct_adjust(self->zoom, pairs, states, count, &scene, &self->calibration,
                                   context, message);
        self->adjusted = context->self_calibrated = error == ERROR_OK;
    }
    return error;
}

/// A session keeps the calibration of the pair's own state. Only that of all zooms, which it comes
/// from, can be corrected by what the pair shows.
static void doubt_frozen(const struct reconstruct_session *self,
                         const struct calibration *calibration,
                         struct reconstruct_context *context) {
    if (self->own && calibration->axes_in_sigma && self->load_calibration != NULL) {
        reconstruct_context_warn(context,
                                 "the pair's own matches could correct the cameras, which the "
                                 "session's calibration does not allow: give the calibration of "
                                 "all zooms, id %s, with --calibration",
                                 calibration->id);
    }
}

/// A calibration that was assumed already fits the frames.
static int fit_calibration(struct reconstruct_session *self,
                           const struct reconstruct_request *request,
                           struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                           struct message *message) {
    if (inputs->calibration_path == NULL) {
        return ERROR_OK;
    }
    int error = match(self, request, inputs, context, message);
    if (error == ERROR_OK && self->adjusted) {
        inputs->calibration = self->calibration;
        reconstruct_adjust_doubt(context);
    } else if (error == ERROR_OK) {
        doubt_frozen(self, &inputs->calibration, context);
        error = cut_to_window(self, &inputs->calibration, context, message);
    }
    return error != ERROR_OK ? error
                             : reconstruct_inputs_fit(inputs, self->calibration_name, message);
}

/// Makes the pair's images and a calibration the inputs; frees `zoom` and the second pair.
static int use_pair(struct reconstruct_session *self, const struct reconstruct_request *request,
                    struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                    struct message *message) {
    struct image_file *const files[RIG_SIDES] = {&inputs->left, &inputs->right};
    const struct image_request image_request = {.scale = request->scale};
    int error = adjust(self, request, context, message);
    pair_release(self->with_pair.frame);
    for (int side = 0; error == ERROR_OK && side < RIG_SIDES; side++) {
        files[side]->path = self->name[side];
        files[side]->request = &image_request;
        error = image_file_take(files[side], &self->pair.pair.frame[side].image, message);
        files[side]->request = NULL;
    }
    pair_release(self->pair.pair.frame);  // those not taken over
    if (error == ERROR_OK) {
        error = reconstruct_inputs_check(inputs, message);
    }
    if (error == ERROR_OK) {
        error = read_calibration(self, request, inputs, context, message);
    }
    free(self->zoom);
    self->zoom = NULL;
    if (error == ERROR_OK) {
        error = fit_calibration(self, request, inputs, context, message);
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

/// Reads the images of a pair found.
static int load_images(const struct reconstruct_session *self, const struct session_reader *reader,
                       const struct session_pairs *pairs, struct pair *pair,
                       char name[RIG_SIDES][RECONSTRUCT_SESSION_NAME_BYTES],
                       struct message *message) {
    *pair = pairs->pair.pair;
    pair->number = pairs->count;
    for (int side = 0; side < RIG_SIDES; side++) {
        char file[SESSION_NAME_MAX + 1];
        const uint32_t crc32 = pairs->pair.frame_crc[side];
        session_frame_name(crc32, file);
        snprintf(name[side], RECONSTRUCT_SESSION_NAME_BYTES, "%s/%s", self->path, file);
        const int error = session_reader_load(reader, &pair->frame[side].image, crc32, message);
        if (error != ERROR_OK) {
            return error;
        }
    }
    return ERROR_OK;
}

/// Reads the calibration of all zooms that the session's calibrations come from.
static int load_zoom(struct reconstruct_session *self, const struct session_reader *reader,
                     uint32_t crc32, struct message *message) {
    char file[SESSION_NAME_MAX + 1];
    char *text = malloc(CALIBRATION_AT_TEXT_BYTES);
    if (text == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", self->path);
    }
    session_zoom_calibration_name(crc32, file);
    snprintf(self->calibration_name, sizeof self->calibration_name, "%s/%s", self->path, file);
    const int length =
        session_reader_zoom_calibration(reader, crc32, text, CALIBRATION_AT_TEXT_BYTES, message);
    const int error = length < 0 ? length
                                 : calibration_read_zoom(self->calibration_name, text,
                                                         (size_t)length, &self->zoom, message);
    free(text);
    return error;
}

/// Reads the session's calibrations unless the request has one.
static int load_calibration(struct reconstruct_session *self, const struct session_reader *reader,
                            const struct session_pairs *pairs,
                            const struct reconstruct_request *request, struct message *message) {
    char file[SESSION_NAME_MAX + 1];
    if (request->calibration_path != NULL || request->rectified) {
        return ERROR_OK;
    }
    if (pairs->has_zoom_calibration) {
        const int error = load_zoom(self, reader, pairs->zoom_calibration_crc, message);
        if (error != ERROR_OK) {
            return error;
        }
    }
    if (!pairs->has_calibration) {
        return ERROR_OK;
    }
    session_calibration_name(pairs->calibration_crc, file);
    snprintf(self->calibration_name, sizeof self->calibration_name, "%s/%s", self->path, file);
    const int length =
        session_reader_calibration(reader, pairs->calibration_crc, self->pair.calibration,
                                   sizeof self->pair.calibration, message);
    self->pair.calibration_length = length > 0 ? (size_t)length : 0;
    return length < 0 ? length : ERROR_OK;
}

/// Finds the pair in its session and reads it.
static int read_pair(struct reconstruct_session *self, struct session_reader *reader,
                     struct session_pairs *pairs, const struct reconstruct_request *request,
                     struct reconstruct_context *context, struct message *message) {
    memcpy(self->pair.profile, pairs->event.profile, sizeof self->pair.profile);
    const int error = session_pairs_find(pairs, reader, self->number, message);
    if (error != ERROR_OK) {
        return error;
    }
    self->pair.has_instrument = pairs->has_instrument;
    self->pair.instrument = pairs->instrument;
    if (reader->cut) {
        reconstruct_context_warn(
            context, "%s was cut off or is still being written: there may be more pairs",
            self->path);
    }
    const int loaded = load_images(self, reader, pairs, &self->pair.pair, self->name, message);
    return loaded != ERROR_OK ? loaded : load_calibration(self, reader, pairs, request, message);
}

/// Finds the pair at another zoom and reads its images.
static int read_with_pair(struct reconstruct_session *self, struct session_reader *reader,
                          struct session_pairs *pairs, const struct reconstruct_request *request,
                          struct reconstruct_context *context, struct message *message) {
    (void)context;
    char unused[RIG_SIDES][RECONSTRUCT_SESSION_NAME_BYTES];
    if ((uint32_t)request->with_pair == self->pair.pair.number) {
        return message_set(
            message, ERROR_ARGUMENT,
            "%s: pair %d cannot help itself (with-pair needs a pair at another zoom)", self->path,
            request->with_pair);
    }
    const int error = session_pairs_find(pairs, reader, (uint32_t)request->with_pair, message);
    return error != ERROR_OK ? error
                             : load_images(self, reader, pairs, &self->with_pair, unused, message);
}

/// Reads the pair, or the one at another zoom.
typedef int read_function(struct reconstruct_session *self, struct session_reader *reader,
                          struct session_pairs *pairs, const struct reconstruct_request *request,
                          struct reconstruct_context *context, struct message *message);

static int read_session(struct reconstruct_session *self, const struct reconstruct_request *request,
                        read_function *read, struct reconstruct_context *context,
                        struct message *message) {
    struct session_reader reader;
    struct session_pairs *pairs = calloc(1, sizeof *pairs);
    if (pairs == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", self->path);
    }
    int error = session_reader_open(&reader, self->parent, self->path, &pairs->event, message);
    if (error == ERROR_OK) {
        error = read(self, &reader, pairs, request, context, message);
        session_reader_close(&reader);
    }
    free(pairs);
    return error;
}

/// Borrows the pair in memory: nothing is read or copied.
static void borrow_pair(struct reconstruct_session *self) {
    static const char *const sides[RIG_SIDES] = {"left", "right"};
    self->pair = *self->captured;
    for (int side = 0; side < RIG_SIDES; side++) {
        self->pair.pair.frame[side].image.release = NULL;
        snprintf(self->name[side], sizeof self->name[side], "%s/%s", self->path, sides[side]);
    }
    snprintf(self->calibration_name, sizeof self->calibration_name, "%s/calibration", self->path);
}

int reconstruct_session_read(void *session, const struct reconstruct_request *request,
                             struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                             struct message *message) {
    struct reconstruct_session *self = session;
    memset(inputs, 0, sizeof *inputs);
    memset(&self->pair, 0, sizeof self->pair);
    memset(&self->with_pair, 0, sizeof self->with_pair);
    self->zoom = NULL;
    self->own = self->cut = self->adjusted = false;
    int error = ERROR_OK;
    if (self->captured != NULL) {
        borrow_pair(self);
    } else {
        error = read_session(self, request, read_pair, context, message);
    }
    if (error == ERROR_OK && request->with_pair > 0) {
        error = read_session(self, request, read_with_pair, context, message);
    }
    if (error == ERROR_OK) {
        set_label(self);
        if (self->captured == NULL &&
            session_notes_read(self->parent, self->path, &self->notes, message) == 1) {
            context->decisions = self->notes.steps;
        }
        context->capture =
            (struct capture_info){self->label, &self->pair.pair,
                                  self->pair.has_instrument ? &self->pair.instrument : NULL};
        error = use_pair(self, request, inputs, context, message);
    }
    if (error != ERROR_OK) {
        pair_release(self->pair.pair.frame);
        pair_release(self->with_pair.frame);
        free(self->zoom);
        self->zoom = NULL;
        reconstruct_inputs_free(inputs);
        return error;
    }
    reconstruct_inputs_doubt(inputs, context);
    return ERROR_OK;
}
