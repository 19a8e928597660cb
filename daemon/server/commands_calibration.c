// SPDX-License-Identifier: Apache-2.0
// The calibration that the instrument keeps: shown, set from a file, forgotten.
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "core/calibration.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/server/commands_daemon.h"
#include "daemon/server/files.h"
#include "daemon/server/item.h"
#include "daemon/server/surroundings.h"

enum { SHOW, SET, FORGET };

_Static_assert((int)SURROUNDINGS_CALIBRATION_BYTES == (int)CALIBRATION_TEXT_MAX_BYTES,
               "whoever loads the record has room for it");

static void show(const struct command_call *call, const struct calibration *calibration) {
    char crc[9];
    snprintf(crc, sizeof crc, "%08" PRIX32, calibration_crc(calibration));
    item_text(call, "id", calibration->id);
    item_text(call, "crc", crc);
    if (calibration->date[0] != '\0') {
        item_text(call, "date", calibration->date);
    }
    item_number(call, "baseline", calibration_baseline_mm(calibration), 3, "mm");
    if (calibration->depth_far_mm > 0) {
        item_number(call, "depth_near", calibration->depth_near_mm, 1, "mm");
        item_number(call, "depth_far", calibration->depth_far_mm, 1, "mm");
    }
    if (calibration->rms_px > 0) {
        item_number(call, "rms", calibration->rms_px, 3, "px");
    }
}

static int parse(const struct command_call *call, const char *name, const char *text, size_t length,
                 struct calibration *calibration) {
    struct calibration_fault fault = {.field = "", .reason = ""};
    const int error = calibration_parse(text, length, calibration, &fault);
    if (error == 0) {
        return 0;
    }
    return surroundings_refuse(call, error, "%s:%d: %s%s%s%s%s", name, fault.line, fault.field,
                               fault.field[0] != '\0' ? ": " : "", error_text(error),
                               fault.reason[0] != '\0' ? ": " : "", fault.reason);
}

static int refuse_store(const struct command_call *call, const char *what, int error) {
    return surroundings_refuse_store(call, error, "calibration: it", what);
}

static int run_show(const struct command_call *call) {
    const struct hal_store *store = surroundings_of(call)->store;
    char text[CALIBRATION_TEXT_MAX_BYTES];
    size_t length = 0;
    struct calibration calibration;
    int error =
        store->operations->load(store->self, SURROUNDINGS_CALIBRATION, text, sizeof text, &length);
    if (error == ERROR_MISSING) {
        return surroundings_refuse(call, error,
                                   "there is no calibration: \"calibration set FILE\" first");
    }
    if (error != 0) {
        return refuse_store(call, "read", error);
    }
    INVARIANT(length <= sizeof text);
    error = parse(call, SURROUNDINGS_CALIBRATION, text, length, &calibration);
    if (error == 0) {
        show(call, &calibration);
    }
    return error;
}

static int run_set(const struct command_call *call) {
    const struct surroundings *around = surroundings_of(call);
    const char *name = call->values[1].text;
    // One byte more shows that a file is longer.
    char text[CALIBRATION_TEXT_MAX_BYTES + 1];
    struct calibration calibration;
    const int fd = files_open(call, name);
    if (fd < 0) {
        return fd;
    }
    const ssize_t length = read(fd, text, sizeof text);
    close(fd);
    if (length < 0 || length > CALIBRATION_TEXT_MAX_BYTES) {
        return surroundings_refuse(call, ERROR_SYNTAX, "%s: is no calibration of Vergence", name);
    }
    int error = parse(call, name, text, (size_t)length, &calibration);
    if (error != 0) {
        return error;
    }
    error = around->store->operations->save(around->store->self, SURROUNDINGS_CALIBRATION, text,
                                            (size_t)length);
    if (error != 0) {
        return refuse_store(call, "kept", error);
    }
    show(call, &calibration);
    return 0;
}

static int run_forget(const struct command_call *call) {
    const struct hal_store *store = surroundings_of(call)->store;
    const int error = store->operations->remove(store->self, SURROUNDINGS_CALIBRATION);
    if (error == ERROR_MISSING) {
        return surroundings_refuse(call, error, "calibration forget: none is kept");
    }
    return error == 0 ? 0 : refuse_store(call, "removed", error);
}

static int run_calibration(const struct command_call *call) {
    const struct hal_store *store = surroundings_of(call)->store;
    const int what = call->values[0].given ? call->values[0].choice : SHOW;
    if (store == NULL) {
        return surroundings_refuse(call, ERROR_UNSUPPORTED,
                                   "calibration: nothing is kept: the setting \"store\" is none");
    }
    if (what == SET && !call->values[1].given) {
        return surroundings_refuse(call, ERROR_MISSING,
                                   "calibration: FILE is missing: expected is one of \"files\"");
    }
    if (what != SET && call->values[1].given) {
        return surroundings_refuse(
            call, ERROR_ARGUMENT,
            "calibration: FILE \"%s\" is too much; it goes with \"set\" alone",
            call->values[1].text);
    }
    return what == SET ? run_set(call) : what == FORGET ? run_forget(call) : run_show(call);
}

static const struct command_argument arguments[] = {
    {.name = "WHAT",
     .kind = COMMAND_CHOICE,
     .choices = "show set forget",
     .optional = true,
     .help = "what to do; show when left out"},
    {.name = "FILE",
     .kind = COMMAND_TEXT,
     .least = 1,
     .most = FILES_NAME_MAX,
     .optional = true,
     .help = "the calibration to be set, one of the instrument's files",
     .candidates = files_candidates_file},
};

static const struct command commands[] = {
    {.name = "calibration",
     .summary = "show, set or forget the calibration that the instrument keeps",
     .help = "It outlives restarts. What is set is checked first.",
     .arguments = arguments,
     .argument_count = 2,
     .flags = COMMAND_NO_RIG,
     .run = run_calibration},
};

const struct command *commands_calibration_table(size_t *count) {
    *count = 1;
    return commands;
}
