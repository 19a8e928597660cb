// SPDX-License-Identifier: Apache-2.0
// Bug report: the output of the commands that show the instrument's state, in one file.
#include <stdio.h>
#include <stdlib.h>

#include "console/line/reply.h"
#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"

static const char *const sections[] = {
    "version",  "system", "config",           "status",         "health",          "calibration",
    "settings", "files",  "registers bridge", "registers left", "registers right", "log 256",
};

enum { SECTIONS = sizeof sections / sizeof sections[0], MESSAGE_LINE_BYTES = 512 };

/// The report, and its write as a job for the disk writer.
struct report {
    const struct command_call *call;
    char name[FILES_NAME_MAX + 1];
    char *text;
    size_t bytes;
    int error;
};

static void put_stream(void *stream, const void *data, size_t bytes) {
    fwrite(data, 1, bytes, stream);
}

/// Adds the answer to one command, as text.
static void add_section(const struct command_call *call, const char *line, struct reply *reply,
                        FILE *stream) {
    char message[MESSAGE_LINE_BYTES] = "";
    struct command_call inner = *call;
    inner.message = message;
    inner.message_bytes = sizeof message;
    const struct reply_sink sink = {put_stream, stream};
    fprintf(stream, "== %s\n", line);
    reply_begin(reply, &sink, &(struct request){.json = false}, false);
    const int error = command_give(&inner, line, &reply->items);
    reply_end(reply, error, message);
    fputc('\n', stream);
}

/// Collects the sections in `report`, whose text the caller frees.
static int collect(const struct command_call *call, struct report *report) {
    struct reply reply;
    FILE *stream = open_memstream(&report->text, &report->bytes);
    if (stream == NULL) {
        return ERROR_MEMORY;
    }
    int error = 0;
    reply_init(&reply);
    for (int i = 0; error == ERROR_OK && i < SECTIONS; i++) {
        add_section(call, sections[i], &reply, stream);
        daemon_progress(call, "reading", (uint32_t)i + 1, SECTIONS);
        error = daemon_should_stop(call) ? ERROR_CANCELLED : 0;
    }
    const bool full = ferror(stream) != 0;
    return fclose(stream) != 0 || full ? ERROR_MEMORY : error;
}

static void write_file(void *cookie) {
    struct report *self = cookie;
    files_name_now(self->call, "bugreport", ".txt", self->name);
    self->error = files_write(self->call, self->name, self->text, self->bytes);
}

static int run_bugreport(const struct command_call *call) {
    struct report report = {.call = call};
    int error = files_need_directory(call);
    error = error != ERROR_OK ? error : collect(call, &report);
    if (error == ERROR_OK) {
        disk_writer_run(&daemon_of(call)->disk_writer, write_file, &report);
        error = report.error;
    }
    free(report.text);
    if (error == ERROR_OK) {
        reply_text(call, "file", report.name);
        reply_number(call, "size", (double)report.bytes, 0, "bytes");
    }
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
