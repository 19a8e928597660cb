// SPDX-License-Identifier: Apache-2.0
// What the daemon runs on, for readers of a bug report without access to the machine.
#include <stdio.h>
#include <sys/statfs.h>
#include <sys/utsname.h>
#include <time.h>

#include "console/command_reply.h"
#include "daemon/base/memory_available.h"
#include "daemon/base/monotonic.h"
#include "daemon/commands/command_context.h"
#include "daemon/commands/commands_daemon.h"

static const double bytes_per_mib = 1 << 20;

static void put_date(const struct command_call *call) {
    const time_t now = time(NULL);
    struct tm parts;
    char date[32];
    gmtime_r(&now, &parts);
    strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%SZ", &parts);
    reply_text(call, "date", date);
    const uint64_t up_us = monotonic_now_us() - context_of(call)->started_us;
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
    const int files_fd = context_of(call)->files_fd;
    struct statfs about;
    reply_number(call, "memory_free", (double)memory_available_bytes() / bytes_per_mib, 1, "MiB");
    if (files_fd >= 0 && fstatfs(files_fd, &about) == 0) {
        const double block_bytes = (double)about.f_bsize;
        reply_number(call, "disk_free", (double)about.f_bavail * block_bytes / bytes_per_mib, 1,
                     "MiB");
        reply_number(call, "disk", (double)about.f_blocks * block_bytes / bytes_per_mib, 1, "MiB");
    }
}

static int run_system(const struct command_call *call) {
    const struct command_context *context = context_of(call);
    put_date(call);
    put_kernel(call);
    put_room(call);
    if (context->reply_devices != NULL) {
        context->reply_devices(context->devices, call);
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
