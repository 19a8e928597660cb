// SPDX-License-Identifier: Apache-2.0
// Bug report: the output of the commands that show the instrument's state, in one file.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/server/output.h"
#include "daemon/server/reply.h"

static const char *const sections[] = {
    "version",  "system", "config",           "status",         "health",          "calibration",
    "settings", "files",  "registers bridge", "registers left", "registers right", "log 256",
};

enum { SECTIONS = sizeof sections / sizeof sections[0], MESSAGE_LINE_BYTES = 512 };

/// Adds the answer to one command, as text.
static void add_section(const struct command_call *call, const char *line, struct reply *reply,
                        struct output *output) {
    char message[MESSAGE_LINE_BYTES] = "";
    const struct request request = {.json = false};
    output_put_text(output, "== ");
    output_put_text(output, line);
    output_put_text(output, "\n");
    struct command_call inner = *call;
    inner.message = message;
    inner.message_bytes = sizeof message;
    reply_begin(reply, output, &request, false);
    const int error = command_give(&inner, line, &reply->items);
    reply_end(reply, error, message);
    output_put_text(output, "\n");
}

/// The report as a job for the disk writer.
struct report {
    const struct command_call *call;
    char name[FILES_NAME_MAX + 1];
    char *text;
    size_t bytes;
    int error;
};

static void write_file(void *cookie) {
    struct report *self = cookie;
    files_name_now(self->call, "bugreport", ".txt", self->name);
    self->error = files_write(self->call, self->name, self->text, self->bytes);
}

static int write_report(const struct command_call *call, struct output *output) {
    struct report report = {.call = call, .text = malloc(OUTPUT_BYTES)};
    if (report.text == NULL) {
        return ERROR_MEMORY;
    }
    report.bytes = output_peek(output, report.text, OUTPUT_BYTES);
    disk_writer_run(&daemon_of(call)->disk_writer, write_file, &report);
    free(report.text);
    if (report.error == 0) {
        reply_text(call, "file", report.name);
        reply_number(call, "size", (double)report.bytes, 0, "bytes");
    }
    return report.error;
}

static int run_bugreport(const struct command_call *call) {
    const int unavailable = files_need_directory(call);
    if (unavailable != 0) {
        return unavailable;
    }
    struct output output;
    struct reply *reply = malloc(sizeof *reply);
    const int wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    int error = ERROR_MEMORY;
    if (reply != NULL && wake_fd >= 0 && output_open(&output, wake_fd)) {
        output_reset(&output, false);
        error = reply_open(reply) ? 0 : ERROR_MEMORY;
        for (int i = 0; error == 0 && i < SECTIONS; i++) {
            add_section(call, sections[i], reply, &output);
            daemon_progress(call, "reading", (uint32_t)i + 1, SECTIONS);
            error = daemon_should_stop(call) ? ERROR_CANCELLED : 0;
        }
        if (error == 0) {
            error = write_report(call, &output);
        }
        reply_close(reply);
        output_close(&output);
    }
    if (wake_fd >= 0) {
        close(wake_fd);
    }
    free(reply);
    return error;
}

static const struct command commands[] = {
    {.name = "bugreport",
     .summary = "write the complete state of the instrument to one file",
     .help = "Version, date, system, configuration, state, health, calibration, saved settings, "
             "files, registers and the log. Fetch it and send it with a request for support.",
     .flags = COMMAND_LONG | COMMAND_UNRECORDED,
     .run = run_bugreport},
};

const struct command *commands_bugreport_table(size_t *count) {
    *count = 1;
    return commands;
}
