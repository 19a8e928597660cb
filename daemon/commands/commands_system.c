// SPDX-License-Identifier: Apache-2.0
// What the daemon runs on, for readers of a bug report without access to the machine.
#include <stdio.h>
#include <sys/statfs.h>
#include <sys/utsname.h>
#include <time.h>

#include "daemon/backends/linux/v4l2_camera.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/process.h"
#include "daemon/commands/commands.h"

static const double bytes_per_mib = 1 << 20;

static void put_date(const struct command_call *call) {
    const time_t now = time(NULL);
    struct tm parts;
    char date[32];
    gmtime_r(&now, &parts);
    strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%SZ", &parts);
    reply_text(call, "date", date);
    const uint64_t up_us = monotonic_now_us() - daemon_of(call)->started_us;
    reply_number(call, "up", (double)(up_us / MONOTONIC_US_IN_S), 0, "s");
}

/// Without the machine's network name, which is private.
static void put_kernel(const struct command_call *call) {
    struct utsname names;
    if (uname(&names) == 0) {
        reply_text(call, "system", names.sysname);
        reply_text(call, "kernel", names.release);
        reply_text(call, "kernel_build", names.version);
        reply_text(call, "machine", names.machine);
    }
}

static void put_room(const struct command_call *call) {
    const int files_fd = daemon_of(call)->files_fd;
    struct statfs about;
    reply_number(call, "memory_free", (double)memory_available_bytes() / bytes_per_mib, 1, "MiB");
    if (files_fd >= 0 && fstatfs(files_fd, &about) == 0) {
        const double block_bytes = (double)about.f_bsize;
        reply_number(call, "disk_free", (double)about.f_bavail * block_bytes / bytes_per_mib, 1,
                     "MiB");
        reply_number(call, "disk", (double)about.f_blocks * block_bytes / bytes_per_mib, 1, "MiB");
    }
}

/// What the driver reports, and what the camera streams.
static void put_camera(const struct command_call *call, const struct v4l2_camera *camera) {
    const struct v4l2_stream *stream = &camera->stream;
    reply_text(call, "device", camera->path);
    if (stream->fd < 0) {
        reply_text(call, "state", "not open");
        return;
    }
    reply_text(call, "driver", stream->driver);
    reply_text(call, "card", stream->card);
    reply_text(call, "bus", stream->bus);
    if (camera->started && stream->format != NULL) {
        reply_text(call, "format", stream->format->name);
        reply_number(call, "width", camera->format.width_px, 0, "px");
        reply_number(call, "height", camera->format.height_px, 0, "px");
        reply_number(call, "frame_time", stream->frame_us, 0, "us");
    }
}

static int run_system(const struct command_call *call) {
    put_date(call);
    put_kernel(call);
    put_room(call);
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct v4l2_camera *camera = daemon_of(call)->cameras[side];
        if (camera != NULL) {
            reply_group_begin(call, side == RIG_LEFT ? "left_camera" : "right_camera", false);
            put_camera(call, camera);
            reply_group_end(call);
        }
    }
    return 0;
}

static const struct command commands[] = {
    {.name = "system",
     .summary = "show what the daemon runs on: date, kernel, memory, disk, cameras",
     .help = "The disk is that of \"files\". Cameras are those of V4L2, as described by their "
             "drivers. Part of every bugreport.",
     .flags = COMMAND_UNRECORDED,
     .run = run_system},
};

const struct command *commands_system_table(size_t *count) {
    *count = 1;
    return commands;
}
