// SPDX-License-Identifier: Apache-2.0
#include "memory/calibration.h"

#include <stdbool.h>

#include "console/line/file_blocks.h"
#include "console/pair/calibration_reply.h"
#include "core/error.h"
#include "memory/files.h"

enum { SHOW, SET, FORGET };
enum { WHAT, FILE_NAME, ARGUMENTS };

static struct {
    bool set;
    struct calibration calibration;
} kept;

const struct calibration *memory_calibration(void) {
    return kept.set ? &kept.calibration : NULL;
}

/// "NAME:LINE: field: reason".
static int refuse(const struct command_call *call, int error,
                  const struct calibration_fault *fault) {
    struct command_text sentence = command_text_begin(call->message, call->message_bytes);
    command_text_add_typed(&sentence, call->values[FILE_NAME].text);
    if (fault->line > 0) {
        command_text_add(&sentence, ":");
        command_text_add_integer(&sentence, fault->line);
    }
    if (fault->field[0] != '\0') {
        command_text_join(&sentence, ": ", fault->field);
    }
    command_text_join(&sentence, ": ",
                      fault->reason[0] != '\0' ? fault->reason : error_text(error));
    return error;
}

static int set(const struct command_call *call) {
    struct calibration_fault fault = {.field = "", .reason = ""};
    size_t bytes = 0;
    const char *text = memory_files_sent(call->values[FILE_NAME].text, &bytes);
    if (text == NULL) {
        fault.reason = "not here (\"send\" it first)";
        return refuse(call, ERROR_MISSING, &fault);
    }
    if (zoom_calibration_is_text(text, bytes)) {
        fault.reason = "this instrument takes no calibration of all zooms (send that of one state)";
        return refuse(call, ERROR_UNSUPPORTED, &fault);
    }
    const int error = calibration_parse(text, bytes, &kept.calibration, &fault);
    if (error != ERROR_OK) {
        return refuse(call, error, &fault);
    }
    kept.set = true;
    calibration_reply_put(call, &kept.calibration);
    return ERROR_OK;
}

static int run_calibration(const struct command_call *call) {
    const int what = call->values[WHAT].given ? call->values[WHAT].choice : SHOW;
    struct command_text sentence = command_text_begin(call->message, call->message_bytes);
    if ((what == SET) != call->values[FILE_NAME].given) {
        command_text_add(&sentence, "calibration: \"set\" requires FILE, the others take none");
        return what == SET ? ERROR_MISSING : ERROR_ARGUMENT;
    }
    if (what == SET) {
        return set(call);
    }
    if (!kept.set) {
        command_text_add(&sentence, "calibration: none is set (\"calibration set FILE\")");
        return ERROR_MISSING;
    }
    if (what == SHOW) {
        calibration_reply_put(call, &kept.calibration);
    }
    kept.set = what == SHOW;
    return ERROR_OK;
}

const struct command *memory_calibration_table(size_t *count) {
    static const struct command_argument arguments[ARGUMENTS] = {
        [WHAT] = {.name = "WHAT",
                  .kind = COMMAND_CHOICE,
                  .choices = "show set forget",
                  .optional = true,
                  .help = "what to do; default: show"},
        [FILE_NAME] = {.name = "FILE",
                       .kind = COMMAND_TEXT,
                       .min = 1,
                       .max = FILE_BLOCKS_SENT_NAME_MAX,
                       .optional = true,
                       .help = "calibration to set: the file that was sent last"},
    };
    static const struct command commands[] = {
        {.name = "calibration",
         .summary = "show, set or forget the calibration in force",
         .help = "It is that of one state of the axes, of the whole sensor or of the window, and "
                 "is lost when the board restarts.",
         .arguments = arguments,
         .argument_count = ARGUMENTS,
         .flags = COMMAND_NO_RIG | COMMAND_GROUP_MEASURE,
         .run = run_calibration},
    };
    *count = 1;
    return commands;
}
