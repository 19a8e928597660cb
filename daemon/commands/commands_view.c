// SPDX-License-Identifier: Apache-2.0
// One picture of both cameras side by side, to aim, focus and expose by; and one picture after the
// other for a program that shows them live.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/pair/calibration_fit.h"
#include "console/pair/capture.h"
#include "core/base64.h"
#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/commands/space_check.h"
#include "daemon/images/picture.h"
#include "daemon/images/picture_marks.h"
#include "daemon/surface/reconstruct_session.h"

/// One call, and its job for the disk writer.
struct view {
    const struct command_call *call;
    struct pair_look_frame look[RIG_SIDES];
    struct picture_marks marks[RIG_SIDES];
    uint8_t palette[PICTURE_COLOURS][3];
    struct picture picture;
    char name[FILES_NAME_MAX + 1];
    size_t bytes;
    int side_px;  ///< largest side of one camera's picture; 0: all pixels are wanted
    bool marked;
    bool colour;  ///< if the cameras have any
    bool streams;
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

/// Integer factor that reduces a frame to at most `side_px` a side; 1 if all pixels are wanted.
static int shrink_of(const struct view *self) {
    const struct raw_image *image = &self->look[RIG_LEFT].frame.image;
    const int side_px = image->width_px > image->height_px ? image->width_px : image->height_px;
    return self->side_px == 0 ? 1 : (side_px + self->side_px - 1) / self->side_px;
}

static void mark(struct view *self, int shrink) {
    picture_marks_palette(self->palette);
    self->picture.palette = self->palette;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const struct focus_noise noise = noise_of(self, side);
        struct picture half = picture_half(&self->picture, side);
        picture_mark(&self->look[side].frame.image, &noise, self->look[side].skip, shrink, &half,
                     &self->marks[side]);
    }
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
static void make_picture(void *cookie) {
    struct view *self = cookie;
    const int shrink = shrink_of(self);
    self->error =
        picture_develop_pair(&self->look[RIG_LEFT].frame.image, &self->look[RIG_RIGHT].frame.image,
                             shrink, self->colour, &self->picture);
    if (self->error == ERROR_OK && self->marked) {
        mark(self, shrink);
    }
    if (!self->streams && self->error == ERROR_OK) {
        self->error = write_png(self);
    }
    if (!self->streams || self->error != ERROR_OK) {
        free(self->picture.pixels);
        self->picture.pixels = NULL;
    }
}

static void put_share(const struct command_call *call, const char *name, uint32_t part,
                      uint32_t whole) {
    reply_number(call, name, whole > 0 ? 100.0 * part / whole : 0, 1, "%");
}

static void put_answer(const struct view *self) {
    const struct command_call *call = self->call;
    if (!self->streams) {
        reply_text(call, "file", self->name);
        reply_number(call, "size", (double)self->bytes, 0, "bytes");
    }
    reply_number(call, "width", self->picture.width_px, 0, "px");
    reply_number(call, "height", self->picture.height_px, 0, "px");
    for (unsigned side = 0; side < RIG_SIDES && self->side_px != 0; side++) {
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
        if (self->marked) {
            put_share(call, "saturated", marks->saturated, marks->blocks);
            put_share(call, "dark", marks->dark, marks->blocks);
            reply_number(call, "edges_in_focus", marks->sharp, 0, NULL);
        }
        reply_group_end(call);
    }
}

/// Checks that there is room for both frames, the picture and its file.
static int check_space(const struct view *self) {
    const uint64_t pixels = (uint64_t)RIG_SIDES * (unsigned)(self->side_px * self->side_px);
    const struct command_call *call = self->call;
    const bool bridge = call->rig->profile.bridge;
    const bool full = self->side_px == 0;
    struct free_space_frames frames = {.memory_images = space_check_look_images(call, full)};
    if (full) {
        // The picture has 3 bytes a pixel, its file no more.
        const bool mosaic = space_check_layout(daemon_of(call)) == RAW_BAYER_GRBG;
        const double picture = RIG_SIDES * (mosaic ? 3.0 : 1.0) / sizeof(uint16_t);
        frames.memory_images += 2 * picture;
        frames.files_images = picture;
    } else {
        // Behind the bridge frames are thinned to the picture's size.
        const unsigned values = (bridge ? 4u : 2u) + (self->colour ? 2u : 0u);
        frames.fixed.memory_bytes = values * pixels;
        frames.fixed.files_bytes = self->streams ? 0 : pixels;
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

static int run_view(const struct command_call *call) {
    static struct view view;  // one thread has the rig
    const int unavailable = files_need_directory(call);
    if (unavailable != 0) {
        return unavailable;
    }
    const bool full = command_is_set(&call->values[VIEW_FULL]);
    view = (struct view){
        .call = call, .side_px = full ? 0 : VIEW_SIDE_MAX_PX, .marked = !full, .colour = full};
    int error = check_space(&view);
    if (error != ERROR_OK) {
        return error;
    }
    error = view_take(call->rig, call->values, view.look);
    if (error == ERROR_OK) {
        disk_writer_run(&daemon_of(call)->disk_writer, make_picture, &view);
        pair_look_release(view.look);
        error = view.error;
    }
    if (error == ERROR_OK) {
        keep(&view);
        put_answer(&view);
    }
    return error != ERROR_MEMORY ? error : command_fail(call, error, "view: out of memory");
}

// ---- one picture after the other

enum { STREAM_SIDE, STREAM_COLOUR, STREAM_CALIBRATION, STREAM_ARGUMENTS };
enum { STREAM_SIDE_MIN_PX = 64, STREAM_SIDE_MAX_PX = 2048, STREAM_TEXT_MAX = OUTPUT_BYTES / 2 };

/// The lens of the picture of one side, from that of the whole frames, or of the whole sensor.
/// False: it is for frames of another size.
static bool fit_lens(const struct view *self, unsigned side, struct lens *lens) {
    const struct pair_look_frame *look = &self->look[side];
    const struct raw_image *image = &look->frame.image;
    const struct rig *rig = self->call->rig;
    struct pair_window window = {look->column_px, look->row_px, look->skip};
    if (lens->width_px == rig->format.width_px && lens->height_px == rig->format.height_px) {
        const struct mt9t001_window *now = &rig->camera[side].sensor.window;
        if (rig->profile.bridge) {
            window.column_px = (uint16_t)((window.column_px - now->column_px) / now->skip);
            window.row_px = (uint16_t)((window.row_px - now->row_px) / now->skip);
            window.skip = (uint8_t)(window.skip / now->skip);
        }
    } else if (!rig->profile.bridge || lens->width_px != MT9T001_WIDTH_PX ||
               lens->height_px != MT9T001_HEIGHT_PX) {
        return false;
    }
    *lens = calibration_fit_lens(lens, &window, image->width_px, image->height_px);
    *lens = reconstruct_session_shrink(lens, shrink_of(self));
    return true;
}

/// Prints the calibration of the picture as it was taken; returns its length, or 0 after an item
/// that says why there is none.
static size_t put_calibration(const struct view *self, char *text, size_t bytes) {
    const struct calibration_match_state *now = &daemon_of(self->call)->view.now;
    struct calibration calibration;
    struct message message;
    int error = commands_calibration_saved(self->call, now, &calibration, &message);
    if (error == ERROR_OK && !(fit_lens(self, RIG_LEFT, &calibration.left) &&
                               fit_lens(self, RIG_RIGHT, &calibration.right))) {
        error = message_set(&message, ERROR_SIZE_MISMATCH,
                            "the saved calibration is for %d x %d px, the frames have %d x %d",
                            calibration.left.width_px, calibration.left.height_px,
                            self->call->rig->format.width_px, self->call->rig->format.height_px);
    }
    if (error == ERROR_OK) {
        calibration.has_origin = false;
        error = calibration_print(&calibration, text, bytes);
    }
    if (error < 0) {
        reply_text(self->call, "calibration_missing", message.text);
        return 0;
    }
    return (size_t)error;
}

/// Gives the client the picture and its calibration: as they are, or as items on a line that
/// damages bytes.
static int put_picture(struct view *self, const char *calibration, size_t length) {
    const struct command_call *call = self->call;
    const size_t pixels = self->picture.row_bytes * (size_t)self->picture.height_px;
    struct job *job = job_of(call);
    reply_number(call, "channels", self->picture.channels, 0, NULL);
    reply_number(call, "step", self->look[RIG_LEFT].skip * shrink_of(self), 0, "px");
    reply_number(call, "calibration_bytes", (double)length, 0, "bytes");
    reply_number(call, "bytes", (double)(pixels + length), 0, "bytes");
    uint8_t *data = realloc(self->picture.pixels, pixels + length);
    if (data == NULL) {
        return ERROR_MEMORY;
    }
    self->picture.pixels = data;
    memcpy(data + pixels, calibration, length);
    if (!job->request.framed) {
        job->payload = (struct job_payload){data, pixels + length};
        self->picture.pixels = NULL;
        return ERROR_OK;
    }
    if (BASE64_TEXT_BYTES(pixels + length) > STREAM_TEXT_MAX) {
        return command_fail(call, ERROR_RANGE,
                            "stream: too large for a serial line (side=160 colour=no)");
    }
    char *text = malloc(BASE64_TEXT_BYTES(pixels + length));
    if (text == NULL) {
        return ERROR_MEMORY;
    }
    base64_encode(data, pixels + length, text);
    reply_text(call, "data", text);
    free(text);
    return ERROR_OK;
}

static int stream_one(struct view *self) {
    const struct command_call *call = self->call;
    const int side_px = self->side_px > PAIR_LOOK_MIN_PX ? self->side_px : PAIR_LOOK_MIN_PX;
    int error = pair_look(call->rig, side_px, true, self->look);
    if (error != ERROR_OK) {
        return error;
    }
    disk_writer_run(&daemon_of(call)->disk_writer, make_picture, self);
    error = self->error;
    if (error == ERROR_OK) {
        char calibration[CALIBRATION_TEXT_MAX_BYTES];
        size_t length = 0;
        keep(self);
        put_answer(self);
        if (command_is_set(&call->values[STREAM_CALIBRATION])) {
            length = put_calibration(self, calibration, sizeof calibration);
        }
        error = put_picture(self, calibration, length);
    }
    pair_look_release(self->look);
    free(self->picture.pixels);
    return error;
}

static int run_stream(const struct command_call *call) {
    static struct view view;  // one thread has the rig
    const struct command_value *values = call->values;
    const struct job *job = job_of(call);
    if (!job->request.framed && (!job->request.binary || job->watch.on)) {
        return command_fail(call, ERROR_UNSUPPORTED,
                            "stream: is for programs that ask with @binary (\"view\" writes a "
                            "picture, \"vergence view\" of the PC shows them live)");
    }
    if (record_is_under_way(&daemon_of(call)->record)) {
        return command_fail(call, ERROR_BUSY, "stream: waits for the end of the recording");
    }
    view = (struct view){
        .call = call,
        .side_px = values[STREAM_SIDE].given ? (int)values[STREAM_SIDE].integer : VIEW_SIDE_MAX_PX,
        .colour = !values[STREAM_COLOUR].given || command_is_set(&values[STREAM_COLOUR]),
        .streams = true};
    int error = check_space(&view);
    error = error == ERROR_OK ? stream_one(&view) : error;
    return error != ERROR_MEMORY || call->message[0] != '\0'
               ? error
               : command_fail(call, error, "stream: out of memory");
}

static const struct command_argument stream_arguments[STREAM_ARGUMENTS] = {
    [STREAM_SIDE] = {.name = "side",
                     .kind = COMMAND_INTEGER,
                     .unit = "px",
                     .min = STREAM_SIDE_MIN_PX,
                     .max = STREAM_SIDE_MAX_PX,
                     .help = "largest side of one camera's picture, which is reduced by an integer "
                             "factor; default: 640"},
    [STREAM_COLOUR] = {.name = "colour",
                       .kind = COMMAND_FLAG,
                       .help = "in colour if the cameras have any (default: yes)"},
    [STREAM_CALIBRATION] = {.name = "calibration",
                            .kind = COMMAND_FLAG,
                            .help = "with the saved calibration, fitted to the picture"},
};

static const struct command commands[] = {
    {.name = "stream",
     .summary = "return what both cameras see now, for programs that show it live",
     .help = "One picture, left and right side by side. A program asks for the next one when it "
             "has used this one, so a slow one gets fewer pictures, never old ones, and commands "
             "of others run in between. After the line of the answer come \"bytes\" bytes: rows of "
             "8 bits a value, then \"calibration_bytes\" of text; over a serial line they are the "
             "item \"data\", in Base64. \"vergence view\" shows it in a browser. Not during a "
             "recording.",
     .arguments = stream_arguments,
     .argument_count = STREAM_ARGUMENTS,
     .flags = COMMAND_NEEDS_RIG | COMMAND_UNRECORDED | COMMAND_GROUP_LOOK,
     .run = run_stream},
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
