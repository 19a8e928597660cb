// SPDX-License-Identifier: Apache-2.0

#include <stdio.h>
#include <string.h>
#include <sys/statfs.h>
#include <sys/utsname.h>
#include <time.h>

#include "console/command_text.h"
#include "console/command_words.h"
#include "console/line/commands_help.h"
#include "daemon/backends/linux/v4l2_camera.h"
#include "daemon/base/memory.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/process.h"
#include "daemon/commands/commands.h"
#include "daemon/commands/space_check.h"
#include "daemon/files/token.h"
#include "daemon/server/dispatch.h"

enum { LOG_DEFAULT_LINES = 20 };

static const double us_per_s = 1e6;

static int run_version(const struct command_call *call) {
    reply_text(call, "version", version_text());
    reply_text(call, "build", version_build_id());
    return 0;
}

static int run_config(const struct command_call *call) {
    struct daemon *daemon = daemon_of(call);
    bool found = false;
    for (size_t i = 0; i < config_key_count(); i++) {
        const char *name = config_key_name(i);
        if (!call->values[0].given || strcmp(call->values[0].text, name) == 0) {
            char value[CONFIG_TEXT_BYTES + 16];
            config_key_print(&daemon->config, i, value, sizeof value);
            reply_text(call, name, value);
            found = true;
        }
    }
    return found ? 0
                 : command_fail(call, ERROR_ARGUMENT,
                                "config: unknown key \"%.60s\" (\"config\" lists all)",
                                call->values[0].text);
}

static int run_token(const struct command_call *call) {
    const struct config *config = &daemon_of(call)->config;
    char token[TOKEN_BYTES];
    struct message message;
    if (config->tcp_port == 0) {
        return command_fail(call, ERROR_UNSUPPORTED, "no token: \"tcp_port\" is not set");
    }
    const int error = token_read(config->tcp_token, token, &message);
    if (error != ERROR_OK) {
        return command_fail(call, error, "%s", message.text);
    }
    reply_text(call, "token", token);
    return ERROR_OK;
}

static int run_log(const struct command_call *call) {
    struct daemon *daemon = daemon_of(call);
    const uint64_t max =
        call->values[0].given ? (uint64_t)call->values[0].integer : LOG_DEFAULT_LINES;
    struct log_ring_line line;
    uint64_t back = max;
    log_ring_count_repeats(&daemon->log_ring);
    reply_group_begin(call, "lines", true);
    while (back > 0) {
        back--;
        if (log_ring_line(&daemon->log_ring, back, &line)) {
            char when[32];
            char text[LOG_RING_LINE_BYTES + 64];
            log_ring_time_text(line.time_us, when);
            snprintf(text, sizeof text, "%s %s: %s", when, log_ring_level_name(line.level),
                     line.text);
            reply_text(call, NULL, text);
        }
    }
    reply_group_end(call);
    return 0;
}

// ---- what the daemon runs on, for readers of a bug report

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

static void put_mib(const struct command_call *call, const char *name, uint64_t bytes) {
    reply_number(call, name, (double)bytes / bytes_per_mib, 1, "MiB");
}

/// The last pair, and what the drivers fill.
static void put_frames(const struct command_call *call) {
    struct captured_pair *pair = last_pair_use(&daemon_of(call)->last_pair);
    uint64_t bytes = 0;
    for (int side = 0; side < RIG_SIDES && pair != NULL; side++) {
        const struct raw_image *image = &pair->pair.frame[side].image;
        bytes += (uint64_t)raw_image_row_values(image) * (uint64_t)image->height_px * 2;
    }
    last_pair_give_back(pair);
    put_mib(call, "last_pair", bytes);
    bytes = 0;
    unsigned count = 0;
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct v4l2_camera *camera = daemon_of(call)->cameras[side];
        for (unsigned i = 0; camera != NULL && i < camera->stream.count; i++) {
            bytes += camera->stream.buffers[i].bytes;
            count++;
        }
    }
    if (count > 0) {
        reply_number(call, "driver_buffers", count, 0, NULL);
        put_mib(call, "driver_memory", bytes);
    }
}

static void put_memory(const struct command_call *call) {
    struct daemon *daemon = daemon_of(call);
    const struct memory_used used = memory_used_now();
    const struct free_space available = space_check_now(daemon);
    reply_group_begin(call, "memory", false);
    put_mib(call, "daemon", used.bytes);
    put_mib(call, "daemon_peak", used.peak_bytes);
    put_frames(call);
    if (daemon->files_fd >= 0) {
        put_mib(call, "files", free_space_used_bytes(daemon->files_fd));
        reply_text(call, "files_in_memory", available.files_in_memory ? "yes" : "no");
    }
    for (int stage = 0; stage < DAEMON_STAGES_MAX; stage++) {
        const uint64_t peak_bytes = daemon->stages[stage].peak_bytes;
        if (peak_bytes > 0) {
            put_mib(call, daemon->stages[stage].name, peak_bytes);
        }
    }
    reply_group_end(call);
}

static void put_free_space(const struct command_call *call) {
    const int files_fd = daemon_of(call)->files_fd;
    struct statfs about;
    put_mib(call, "memory_free", memory_available_bytes());
    put_memory(call);
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
    put_free_space(call);
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

// ---- watch, quit, complete

/// Checks the command to repeat, so that its rounds need not.
static int run_watch(const struct command_call *call) {
    struct daemon *daemon = daemon_of(call);
    struct job_watch *watch = &job_of(call)->watch;
    const char *line = call->values[1].text;
    const struct command *command = NULL;
    char storage[COMMAND_LINE_MAX + 1];
    struct command_value values[COMMAND_ARGUMENTS_MAX];
    const int error = command_parse(line, daemon->table.rows, daemon->table.count, storage, values,
                                    &command, call->message, call->message_bytes);
    if (error != ERROR_OK) {
        return error;
    }
    if (command == NULL || command->run == run_watch || strcmp(command->name, "quit") == 0) {
        return command_fail(call, ERROR_ARGUMENT,
                            "watch: COMMAND cannot be repeated (expected one such as \"status\")");
    }
    INVARIANT(strlen(line) < sizeof watch->line);
    strcpy(watch->line, line);
    watch->interval_us = (uint64_t)(call->values[0].number * us_per_s);
    watch->rounds_left = call->values[2].given ? (uint32_t)call->values[2].integer : 0;
    watch->on = true;
    return ERROR_OK;
}

static int run_quit(const struct command_call *call) {
    job_of(call)->quit = true;
    return 0;
}

static void add_keys(const struct command_candidates *to) {
    for (size_t i = 0; i < config_key_count(); i++) {
        to->add(to->self, config_key_name(i));
    }
}

static const struct command_argument config_arguments[] = {
    {.name = "KEY",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = 60,
     .optional = true,
     .help = "one setting; default: all",
     .candidates = add_keys},
};

static const struct command_argument log_arguments[] = {
    {.name = "COUNT",
     .kind = COMMAND_INTEGER,
     .unit = "lines",
     .min = 1,
     .max = LOG_RING_LINES,
     .optional = true,
     .help = "how many of the last lines; default: 20"},
};

static const struct command_argument watch_arguments[] = {
    {.name = "INTERVAL",
     .kind = COMMAND_NUMBER,
     .unit = "s",
     .min = 0.1,
     .max = 86400,
     .help = "from one round's start to the next"},
    {.name = "COMMAND",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = 400,
     .help = "the command to repeat, in quotes if it has arguments",
     .candidates = commands_help_candidates},
    {.name = "count",
     .kind = COMMAND_INTEGER,
     .min = 1,
     .max = 1000000,
     .help = "rounds; default: until Ctrl-C"},
};

static const struct command commands[] = {
    {.name = "version",
     .summary = "show the version and build of the daemon",
     .help = "The build is the output of git describe.",
     .flags = COMMAND_NO_RIG,
     .run = run_version},
    {.name = "config",
     .summary = "show the settings of the daemon",
     .help =
         "They come from its configuration file; see vergenced --help-config. \"settings\" saves "
         "the state of the instrument.",
     .arguments = config_arguments,
     .argument_count = 1,
     .flags = COMMAND_NO_RIG,
     .run = run_config},
    {.name = "token",
     .summary = "show the token that clients over TCP need",
     .help = "For a file of mode 0600 on the PC, which vergence --connect --token FILE reads.",
     .flags = COMMAND_NO_RIG,
     .run = run_token},
    {.name = "log",
     .summary = "show the last lines of the log",
     .help = "Times are in UTC.",
     .arguments = log_arguments,
     .argument_count = 1,
     .flags = COMMAND_NO_RIG,
     .run = run_log},
    {.name = "watch",
     .summary = "repeat a command at an interval",
     .help = "Example: watch 2 \"pan side=left\" count=10. Rounds are skipped while the instrument "
             "or the "
             "reader is not ready for them. Ends when the command fails.",
     .arguments = watch_arguments,
     .argument_count = 3,
     .flags = COMMAND_NO_RIG | COMMAND_LONG | COMMAND_GROUP_LOOK,
     .run = run_watch},
    {.name = "quit",
     .summary = "close this connection",
     .help = "On a serial console a new one begins at once; on standard input the daemon ends. "
             "Lines after it are not run.",
     .flags = COMMAND_NO_RIG,
     .run = run_quit},
    {.name = "system",
     .summary = "show what the daemon runs on: date, kernel, memory, disk, cameras",
     .help =
         "Memory: of the daemon now and at its peak, of the last pair, of the drivers' buffers, "
         "of \"files\", and of each stage of the last reconstruction. The disk is that of "
         "\"files\". Cameras are those of V4L2, as described by their "
         "drivers. Part of every bugreport.",
     .flags = COMMAND_UNRECORDED,
     .run = run_system},
};

const struct command *commands_daemon_table(size_t *count) {
    *count = sizeof commands / sizeof commands[0];
    return commands;
}
