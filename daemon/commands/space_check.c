// SPDX-License-Identifier: Apache-2.0
#include "daemon/commands/space_check.h"

#include <math.h>
#include <stdio.h>

#include "daemon/backends/linux/v4l2_camera.h"
#include "daemon/base/message.h"
#include "daemon/commands/commands.h"

static const double bytes_per_mb = 1e6;

struct free_space space_check_now(const struct daemon *daemon) {
    return free_space_now(daemon->files_fd, (uint64_t)daemon->config.files_limit_mb * 1000000);
}

static int refuse(const struct command_call *call, const struct free_space *available,
                  const struct free_space *need, const char *advice) {
    const char *name = job_of(call)->command->name;
    const char *before = advice != NULL ? ": " : "";
    advice = advice != NULL ? advice : "";
    if (need->files_bytes > available->files_bytes) {
        return command_fail(
            call, ERROR_FULL, "%s: %.1f MB of files are required, %.1f MB are free%s%s%s", name,
            (double)need->files_bytes / bytes_per_mb, (double)available->files_bytes / bytes_per_mb,
            available->files_limited ? " of files_limit" : "", before, advice);
    }
    return command_fail(
        call, ERROR_MEMORY, "%s: out of memory: %.1f MB are required%s, %.1f MB are free%s%s", name,
        (double)free_space_memory_bytes(available, need) / bytes_per_mb,
        available->files_in_memory && need->files_bytes > 0 ? " with the files" : "",
        (double)available->memory_bytes / bytes_per_mb, before, advice);
}

int space_check(const struct command_call *call, const struct free_space *need,
                const char *advice) {
    const struct free_space available = space_check_now(daemon_of(call));
    return free_space_fits(&available, need) ? 0 : refuse(call, &available, need, advice);
}

static struct free_space need_of(const struct free_space_frames *frames, double image_bytes) {
    return (struct free_space){
        .memory_bytes =
            frames->fixed.memory_bytes + (uint64_t)(frames->memory_images * image_bytes),
        .files_bytes = frames->fixed.files_bytes + (uint64_t)(frames->files_images * image_bytes),
    };
}

/// The largest part of the frames' pixels that fits, 0 to 1.
static double find_share(const struct free_space *available, const struct free_space_frames *frames,
                         double image_bytes) {
    enum { STEPS = 20 };
    double share = 0;
    for (double step = 0.5; step > 1.0 / (1 << STEPS); step /= 2) {
        const struct free_space need = need_of(frames, (share + step) * image_bytes);
        share += free_space_fits(available, &need) ? step : 0;
    }
    return share;
}

enum raw_layout space_check_layout(const struct daemon *daemon) {
    const struct v4l2_camera *camera = daemon->cameras[RIG_LEFT];
    if (camera != NULL && camera->stream.format != NULL) {
        return camera->stream.format->layout;
    }
    return daemon->rig.profile.bridge ? RAW_BAYER_GRBG : RAW_RGB;
}

static const struct v4l2_stream *lender(const struct daemon *daemon, unsigned side) {
    const struct v4l2_camera *camera = daemon->cameras[side];
    return camera != NULL && camera->stream.lends ? &camera->stream : NULL;
}

/// Images for which frames of one camera take memory: none for those that the driver has room for.
static unsigned images_of(const struct daemon *daemon, unsigned side, unsigned frames) {
    const struct v4l2_stream *stream = lender(daemon, side);
    return stream != NULL ? v4l2_stream_missing(stream, frames) : frames;
}

int space_check_frames(const struct command_call *call, const struct free_space_frames *frames) {
    enum { STEP_PX = 16 };  // sensors accept multiples of 2 * skip
    const struct rig *rig = call->rig;
    const struct free_space available = space_check_now(daemon_of(call));
    const struct raw_image image = {.width_px = rig->format.width_px,
                                    .layout = space_check_layout(daemon_of(call))};
    const double image_bytes =
        (double)raw_image_row_values(&image) * rig->format.height_px * sizeof(uint16_t);
    const struct free_space need = need_of(frames, image_bytes);
    if (free_space_fits(&available, &need)) {
        return 0;
    }
    char advice[MESSAGE_BYTES];
    const double side = sqrt(find_share(&available, frames, image_bytes));
    const int width_px = (int)(side * rig->format.width_px) / STEP_PX * STEP_PX;
    const int height_px = (int)(side * rig->format.height_px) / STEP_PX * STEP_PX;
    if (width_px == 0 || height_px == 0) {
        return refuse(call, &available, &need, NULL);
    }
    snprintf(advice, sizeof advice,
             rig->profile.bridge ? "\"window %d %d\" fits" : "frames of %d x %d px fit", width_px,
             height_px);
    return refuse(call, &available, &need, advice);
}

/// Images of memory that a pair takes.
static unsigned images_of_pair(const struct daemon *daemon, const struct pair_options *options) {
    enum { MERGED_IMAGES = 4 };  // the left one, the right one, and its sums of 4 bytes
    const bool bridge = daemon->rig.profile.bridge;
    if (options->average != 0 || options->bracket != 0) {
        // A frame that is copied is gone before the right one is made.
        return MERGED_IMAGES +
               (lender(daemon, RIG_LEFT) != NULL ? images_of(daemon, RIG_LEFT, 1) : 0);
    }
    const unsigned left = options->check_static ? 2 : 1;
    return bridge ? images_of(daemon, RIG_LEFT, left + 1)
                  : images_of(daemon, RIG_LEFT, left) + images_of(daemon, RIG_RIGHT, 1);
}

static int check_pair(const struct command_call *call, const struct pair_options *options,
                      bool named) {
    enum { TEXT_BYTES = 1 << 16 };  // index and calibration of a pair's session
    const struct daemon *daemon = daemon_of(call);
    const bool recording = daemon->session.recording;
    const struct free_space_frames frames = {
        // In a recording two copies wait for the disk.
        .memory_images = images_of_pair(daemon, options) + (recording ? 2 : 0),
        .files_images = recording || named ? RIG_SIDES : 0,
        .fixed = {.memory_bytes = sizeof(struct captured_pair),
                  .files_bytes = recording || named ? TEXT_BYTES : 0}};
    return space_check_frames(call, &frames);
}

int space_check_pair(const struct command_call *call, const struct pair_options *options,
                     bool named) {
    int error = check_pair(call, options, named);
    if (error == ERROR_MEMORY) {
        last_pair_set(&daemon_of(call)->last_pair, NULL);
        error = check_pair(call, options, named);
    }
    return error;
}

unsigned space_check_look_images(const struct command_call *call, bool whole) {
    const struct daemon *daemon = daemon_of(call);
    if (!daemon->rig.profile.bridge) {
        return images_of(daemon, RIG_LEFT, 1) + images_of(daemon, RIG_RIGHT, 1);
    }
    const struct v4l2_stream *stream = lender(daemon, RIG_LEFT);
    return (whole ? RIG_SIDES : 0) +
           (stream != NULL ? v4l2_stream_missing(stream, V4L2_STREAM_BUFFERS_MIN) : 0);
}

int space_check_recording(const struct command_call *call) {
    enum { BYTES = 1 << 20 };
    const struct free_space need = {.memory_bytes = BYTES, .files_bytes = BYTES};
    return space_check(call, &need, NULL);
}
