// SPDX-License-Identifier: Apache-2.0
// One picture of both cameras side by side, to aim, focus and expose by.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/commands/space_check.h"
#include "daemon/images/picture.h"
#include "daemon/images/picture_marks.h"
#include "daemon/measure/measure_rig.h"
#include "daemon/session/capture.h"
#include "measure/measure_place.h"

/// One call, and its job for the disk writer.
struct view {
    const struct command_call *call;
    struct pair_look_frame look[RIG_SIDES];
    struct picture_marks marks[RIG_SIDES];
    uint8_t palette[PICTURE_COLOURS][3];
    struct picture picture;
    char name[FILES_NAME_MAX + 1];
    size_t bytes;
    bool full;
    int error;
};

/// Noise of a frame. Of cameras that are not behind the bridge only an upper bound is known: 2 of
/// 255.
static struct focus_noise noise_of(const struct view *self, unsigned side) {
    const struct rig_region_frame *frame = &self->look[side].frame;
    if (self->call->rig->profile.bridge) {
        return rig_region_noise(frame, true);
    }
    return (struct focus_noise){.read_q8 = UINT32_C(4) << 8 << 2 * (frame->image.bits - 8)};
}

/// Integer factor that reduces a frame to at most VIEW_SIDE_MAX_PX a side; 1 if all pixels are
/// wanted.
static int shrink_of(const struct view *self) {
    const struct raw_image *image = &self->look[RIG_LEFT].frame.image;
    const int side_px = image->width_px > image->height_px ? image->width_px : image->height_px;
    return self->full ? 1 : (side_px + VIEW_SIDE_MAX_PX - 1) / VIEW_SIDE_MAX_PX;
}

/// Develops both frames side by side, with the white balance of the left one, and marks them.
static int develop(struct view *self, int shrink) {
    const struct develop_balance balance = develop_balance_of(&self->look[RIG_LEFT].frame.image);
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const struct raw_image *image = &self->look[side].frame.image;
        struct picture half = self->picture;
        half.width_px /= RIG_SIDES;
        half.pixels += (size_t)side * (size_t)half.width_px * (size_t)half.channels;
        const int error = picture_develop(image, &balance, shrink, &half);
        if (error != ERROR_OK) {
            return error;
        }
        if (!self->full) {
            const struct focus_noise noise = noise_of(self, side);
            picture_mark(image, &noise, self->look[side].skip, shrink, &half, &self->marks[side]);
        }
    }
    return ERROR_OK;
}

static int write_png(struct view *self) {
    uint8_t *png = picture_png(&self->picture, &self->bytes);
    if (png == NULL) {
        return ERROR_MEMORY;
    }
    files_name_now(self->call, "view", ".png", self->name);
    const int error = files_write(self->call, self->name, png, self->bytes);
    free(png);
    return error;
}

/// On the disk writer's thread: this may take seconds, in which the bridge's watchdog must be fed.
static void make_file(void *cookie) {
    struct view *self = cookie;
    const struct raw_image *left = &self->look[RIG_LEFT].frame.image;
    struct picture *picture = &self->picture;
    const int shrink = shrink_of(self);
    picture->channels = self->full && left->layout != RAW_GREY ? 3 : 1;
    picture->width_px = RIG_SIDES * (left->width_px / shrink);
    picture->height_px = left->height_px / shrink;
    picture->row_bytes = (size_t)picture->width_px * (size_t)picture->channels;
    picture->pixels = malloc(picture->row_bytes * (size_t)picture->height_px);
    if (!self->full) {
        picture_marks_palette(self->palette);
        picture->palette = self->palette;
    }
    self->error = picture->pixels != NULL ? develop(self, shrink) : ERROR_MEMORY;
    self->error = self->error == ERROR_OK ? write_png(self) : self->error;
    free(picture->pixels);
}

static void put_share(const struct command_call *call, const char *name, uint32_t part,
                      uint32_t whole) {
    reply_number(call, name, whole > 0 ? 100.0 * part / whole : 0, 1, "%");
}

static void put_answer(const struct view *self) {
    const struct command_call *call = self->call;
    reply_text(call, "file", self->name);
    reply_number(call, "size", (double)self->bytes, 0, "bytes");
    reply_number(call, "width", self->picture.width_px, 0, "px");
    reply_number(call, "height", self->picture.height_px, 0, "px");
    for (unsigned side = 0; side < RIG_SIDES && !self->full; side++) {
        const struct rig_region_frame *frame = &self->look[side].frame;
        const struct picture_marks *marks = &self->marks[side];
        reply_group_begin(call, rig_side_names[side], false);
        // 0: not set since bring-up, so the camera decides.
        if (frame->exposure_us != 0) {
            reply_number(call, "exposure", frame->exposure_us, 0, "us");
        }
        if (frame->gain_q3 != 0) {
            reply_number(call, "gain", frame->gain_q3 / 8.0, 3, NULL);
        }
        put_share(call, "saturated", marks->saturated, marks->blocks);
        put_share(call, "dark", marks->dark, marks->blocks);
        reply_number(call, "edges_in_focus", marks->sharp, 0, NULL);
        reply_group_end(call);
    }
}

/// Checks that there is room for both frames, the picture and its file.
static int check_space(const struct view *self) {
    enum { MARKED_BYTES = RIG_SIDES * VIEW_SIDE_MAX_PX * VIEW_SIDE_MAX_PX };
    const struct command_call *call = self->call;
    const bool bridge = call->rig->profile.bridge;
    struct free_space_frames frames = {.memory_images = space_check_look_images(call, self->full)};
    if (self->full) {
        // The picture has 3 bytes a pixel, its file no more.
        const bool mosaic = space_check_layout(daemon_of(call)) == RAW_BAYER_GRBG;
        const double picture = RIG_SIDES * (mosaic ? 3.0 : 1.0) / sizeof(uint16_t);
        frames.memory_images += 2 * picture;
        frames.files_images = picture;
    } else {
        // Behind the bridge frames are thinned to the picture's size.
        frames.fixed.memory_bytes = (bridge ? 4 : 2) * MARKED_BYTES;
        frames.fixed.files_bytes = MARKED_BYTES;
    }
    return space_check_frames(call, &frames);
}

/// Keeps where the cameras looked, so that `measure` takes a place by its pixels.
static void keep(const struct view *self) {
    struct daemon_view *kept = &daemon_of(self->call)->view;
    const struct pair_look_frame *left = &self->look[RIG_LEFT];
    *kept = (struct daemon_view){.taken = true,
                                 .axes = daemon_axes_of(self->call->rig),
                                 .width_px = self->picture.width_px / RIG_SIDES,
                                 .height_px = self->picture.height_px,
                                 .step_px = left->skip * shrink_of(self)};
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        kept->column_px[side] = self->look[side].column_px;
        kept->row_px[side] = self->look[side].row_px;
    }
    commands_calibration_now(self->call, &kept->now);
}

int commands_view_ray(const struct command_call *call, const struct zoom_calibration *zoom,
                      const struct measure_request *request, struct measure_place *place) {
    const int *place_px = request->place_px;
    if (!request->has_place) {
        return ERROR_OK;
    }
    const struct daemon_view *view = &daemon_of(call)->view;
    const struct daemon_axes axes = daemon_axes_of(call->rig);
    struct zoom_state state;
    measure_rig_axes(&view->now, &state);
    if (!view->taken || call->rig->state != RIG_READY ||
        memcmp(&axes, &view->axes, sizeof axes) != 0) {
        return command_fail(call, ERROR_MISSING,
                            "measure: at needs a view, and %s (\"view\" first)",
                            view->taken ? "the cameras have moved since" : "none was taken");
    }
    for (int i = 0; i < RIG_SIDES; i++) {
        const struct zoom_camera_state *axes_of_side = &state.side[i];
        if (!isfinite(axes_of_side->pan_rad + axes_of_side->zoom_counts +
                      axes_of_side->focus_counts)) {
            return command_fail(call, ERROR_MISSING,
                                "measure: at needs motors that were set (\"aim distance=2000\", "
                                "\"zoom 1x\", then \"view\")");
        }
    }
    const int side = place_px[0] >= view->width_px;
    const int in_half_px[2] = {place_px[0] - side * view->width_px, place_px[1]};
    if (in_half_px[0] >= view->width_px || in_half_px[1] >= view->height_px) {
        return command_fail(call, ERROR_RANGE, "measure: at %d,%d is outside the view (%d x %d px)",
                            place_px[0], place_px[1], 2 * view->width_px, view->height_px);
    }
    const double pixel_px[2] = {view->column_px[side] + (in_half_px[0] + 0.5) * view->step_px - 0.5,
                                view->row_px[side] + (in_half_px[1] + 0.5) * view->step_px - 0.5};
    return measure_place_of(zoom, &state, side, pixel_px, place)
               ? ERROR_OK
               : command_fail(call, ERROR_RANGE, "measure: the lens has no ray for that pixel");
}

static int run_view(const struct command_call *call) {
    static struct view view;  // one thread has the rig
    const int unavailable = files_need_directory(call);
    if (unavailable != 0) {
        return unavailable;
    }
    view = (struct view){.call = call, .full = command_is_set(&call->values[VIEW_FULL])};
    int error = check_space(&view);
    if (error != ERROR_OK) {
        return error;
    }
    error = view_take(call->rig, call->values, view.look);
    if (error == ERROR_OK) {
        disk_writer_run(&daemon_of(call)->disk_writer, make_file, &view);
        pair_look_release(view.look);
        error = view.error;
    }
    if (error == ERROR_OK) {
        keep(&view);
        put_answer(&view);
    }
    return error != ERROR_MEMORY ? error : command_fail(call, error, "view: out of memory");
}

static const struct command commands[] = {
    {.name = "view",
     .summary = "write one picture of what both cameras see, to aim, focus and expose by",
     .help =
         "Left and right image side by side, at most 640 px each, as a PNG file in \"files\"; "
         "vergence --connect fetches it. Green: edges in focus; red stripes: too bright; blue: "
         "too dark; yellow: the middle. edges_in_focus counts the green ones, steep ones more: "
         "turn the "
         "focus until it is greatest. Settings stay as they are. No checks are made, and the scene "
         "may move; \"capture\" takes a pair to measure.",
     .arguments = view_arguments,
     .argument_count = VIEW_ARGUMENTS,
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES | COMMAND_GROUP_LOOK | COMMAND_DAILY,
     .run = run_view},
};

const struct command *commands_view_table(size_t *count) {
    *count = sizeof commands / sizeof commands[0];
    return commands;
}
