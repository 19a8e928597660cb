// SPDX-License-Identifier: Apache-2.0
// One picture of both cameras side by side, written to the instrument's files.
#include <stdio.h>
#include <stdlib.h>

#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/images/picture.h"
#include "daemon/session/capture.h"

enum { SMALL_SIDE_MAX_PX = 640 };

/// One call, and its job for the disk writer.
struct snapshot {
    const struct command_call *call;
    struct pair_frame frame[RIG_SIDES];
    struct picture picture;
    char name[FILES_NAME_MAX + 1];
    size_t bytes;
    int error;
};

/// Integer factor that reduces a frame to at most SMALL_SIDE_MAX_PX a side; 1 if `full`.
static int shrink_of(const struct raw_image *image, bool full) {
    const int side_px = image->width_px > image->height_px ? image->width_px : image->height_px;
    return full ? 1 : (side_px + SMALL_SIDE_MAX_PX - 1) / SMALL_SIDE_MAX_PX;
}

/// Develops both frames side by side, with the white balance of the left one.
static int develop(struct snapshot *self, int shrink) {
    const struct develop_balance balance = develop_balance_of(&self->frame[RIG_LEFT].image);
    int error = 0;
    for (int side = 0; error == 0 && side < RIG_SIDES; side++) {
        struct picture half = self->picture;
        half.width_px /= RIG_SIDES;
        half.pixels += (size_t)side * (size_t)half.width_px * (size_t)half.channels;
        error = picture_develop(&self->frame[side].image, &balance, shrink, &half);
    }
    return error;
}

static int write_png(struct snapshot *self) {
    uint8_t *png = picture_png(&self->picture, &self->bytes);
    if (png == NULL) {
        return ERROR_MEMORY;
    }
    files_name_now(self->call, "snapshot", ".png", self->name);
    const int error = files_write(self->call, self->name, png, self->bytes);
    free(png);
    return error;
}

/// On the disk writer's thread: this may take seconds, in which the bridge's watchdog must be fed.
static void make_file(void *cookie) {
    struct snapshot *self = cookie;
    const struct raw_image *left = &self->frame[RIG_LEFT].image;
    struct picture *picture = &self->picture;
    const bool full = command_is_set(&self->call->values[SNAPSHOT_FULL]);
    const int shrink = shrink_of(left, full);
    picture->channels = full && left->layout != RAW_GREY ? 3 : 1;
    picture->width_px = RIG_SIDES * (left->width_px / shrink);
    picture->height_px = left->height_px / shrink;
    picture->row_bytes = (size_t)picture->width_px * (size_t)picture->channels;
    picture->pixels = malloc(picture->row_bytes * (size_t)picture->height_px);
    self->error = picture->pixels != NULL ? develop(self, shrink) : ERROR_MEMORY;
    self->error = self->error == 0 ? write_png(self) : self->error;
    free(picture->pixels);
}

static int take(struct snapshot *self) {
    const struct command_call *call = self->call;
    const int error = pair_look(call->rig, self->frame);
    if (error != 0) {
        return error;
    }
    disk_writer_run(&daemon_of(call)->disk_writer, make_file, self);
    pair_release(self->frame);
    if (self->error == 0) {
        reply_text(call, "file", self->name);
        reply_number(call, "size", (double)self->bytes, 0, "bytes");
        reply_number(call, "width", self->picture.width_px, 0, "px");
        reply_number(call, "height", self->picture.height_px, 0, "px");
    }
    return self->error;
}

static int run_snapshot(const struct command_call *call) {
    static struct snapshot snapshot;  // one thread has the rig
    const int unavailable = files_need_directory(call);
    if (unavailable != 0) {
        return unavailable;
    }
    snapshot = (struct snapshot){.call = call};
    const int error = take(&snapshot);
    return error != ERROR_MEMORY ? error : command_fail(call, error, "snapshot: out of memory");
}

static const struct command commands[] = {
    {.name = "snapshot",
     .summary = "write one picture of what both cameras see now",
     .help = "Left and right image side by side, as a PNG file in \"files\"; vergence --connect "
             "fetches it. No checks are made, and the scene may move; \"capture\" takes a pair to "
             "measure.",
     .arguments = snapshot_arguments,
     .argument_count = SNAPSHOT_ARGUMENTS,
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES,
     .run = run_snapshot},
};

const struct command *commands_snapshot_table(size_t *count) {
    *count = sizeof commands / sizeof commands[0];
    return commands;
}
