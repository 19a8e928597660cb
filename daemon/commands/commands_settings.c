// SPDX-License-Identifier: Apache-2.0
// The saved settings of the instrument, in the store: show, save, restore, forget.
#include <stdio.h>
#include <string.h>

#include "console/commands.h"
#include "console/lens_table_text.h"
#include "core/math.h"
#include "daemon/commands/commands.h"
#include "daemon/settings/saved_settings.h"

enum { SHOW, SAVE, RESTORE, FORGET };

#define URAD_PER_DEGREE (1e6 * MATH_RAD_PER_DEGREE)

// ---- the answer

/// As the command lens shows it, if it is not empty.
static void put_table(const struct command_call *call, const char *key, enum lens_table_kind kind,
                      const struct lens_table *table) {
    char bytes[LENS_TABLE_TEXT_BYTES];
    struct command_text text = command_text_begin(bytes, sizeof bytes);
    if (table->count > 0) {
        lens_table_print(kind, table, &text);
        reply_text(call, key, bytes);
    }
}

static void put_side(const struct command_call *call, const struct saved_settings *saved,
                     unsigned side) {
    static const struct {
        const char *key;
        double parts;
        int decimals;
        const char *unit;
    } shown[SAVED_VALUES] = {
        [SAVED_EXPOSURE_US] = {"exposure", 1, 0, "us"},
        [SAVED_GAIN_Q3] = {"gain", 8, 3, NULL},
        [SAVED_PAN_URAD] = {"pan", URAD_PER_DEGREE, 3, "deg"},
        [SAVED_ZOOM] = {"zoom", 1, 0, "counts"},
        [SAVED_FOCUS] = {"focus", 1, 0, "counts"},
        [SAVED_IRIS] = {"iris", 1, 0, "counts"},
    };
    reply_group_begin(call, commands_side_name(side), false);
    if (saved->placed) {
        reply_number(call, "column", saved->column_px[side], 0, "px");
        reply_number(call, "row", saved->row_px[side], 0, "px");
    }
    for (int i = 0; i < SAVED_VALUES; i++) {
        const int32_t value = saved->values[side][i];
        if (value != INT32_MIN) {
            reply_number(call, shown[i].key, value / shown[i].parts, shown[i].decimals,
                         shown[i].unit);
        }
    }
    put_table(call, "zoom_to_focus", LENS_TABLE_FOCUS, &saved->lenses.learned[side].focus);
    put_table(call, "iris_to_f_number", LENS_TABLE_IRIS, &saved->lenses.learned[side].iris);
    reply_group_end(call);
}

static void reply_settings(const struct command_call *call, const struct saved_settings *saved) {
    reply_text(call, "profile", saved->profile);
    if (saved->width_px != 0) {
        reply_group_begin(call, "window", false);
        reply_number(call, "width", saved->width_px, 0, "px");
        reply_number(call, "height", saved->height_px, 0, "px");
        reply_number(call, "skip", saved->skip, 0, NULL);
        reply_group_end(call);
    }
    if (saved->lenses.object.known) {
        char bytes[LENS_TABLE_TEXT_BYTES];
        struct command_text text = command_text_begin(bytes, sizeof bytes);
        lens_object_print(&saved->lenses.object, &text);
        reply_text(call, "object", bytes);
    }
    put_side(call, saved, RIG_LEFT);
    put_side(call, saved, RIG_RIGHT);
}

// ---- the record

static int load(const struct command_call *call, struct saved_settings *saved) {
    char text[SAVED_SETTINGS_BYTES];
    size_t length = 0;
    struct message why = {.text = "its checksum is wrong"};
    int error = commands_store_load(call, SAVED_SETTINGS_RECORD, text, sizeof text, &length);
    if (error == ERROR_MISSING) {
        return command_fail(call, error,
                            "settings: none saved (\"settings save\" saves those in force)");
    }
    if (error == ERROR_OK) {
        error = saved_settings_parse(text, length, saved, &why);
    }
    // Longer than any saved record.
    error = error == ERROR_BUFFER ? ERROR_CRC : error;
    if (error == ERROR_CRC || error == ERROR_SYNTAX) {
        return command_fail(call, error,
                            "settings: the record in the store %s is damaged and not used: %s "
                            "(\"settings forget\", or \"settings save\" again)",
                            daemon_of(call)->config.store, why.text);
    }
    if (error == ERROR_VERSION) {
        return command_fail(call, error, "settings: %s", why.text);
    }
    return error == ERROR_OK ? ERROR_OK : command_fail_store(call, error, "settings", "read from");
}

// ---- the commands

/// Runs a command, so that a recording can be replayed without the store.
static int run_line(const struct command_call *call, const char *line) {
    const int error = command_give(call, line, NULL);
    if (error != ERROR_OK && error != ERROR_CANCELLED) {
        char why[256];
        snprintf(why, sizeof why, "%s", call->message);
        return command_fail(call, error, "settings: \"%s\" failed: %s", line, why);
    }
    return error;
}

/// Applies the saved settings to the instrument after checking all of them.
static int restore(const struct command_call *call, bool axes, struct saved_settings *saved) {
    char lines[SAVED_SETTINGS_LINES][SAVED_SETTINGS_LINE_BYTES];
    struct message why;
    size_t of_cameras = 0;
    int error = load(call, saved);
    if (error != ERROR_OK) {
        return error;
    }
    error = saved_settings_check(saved, call->rig, &why);
    if (error != ERROR_OK) {
        return command_fail(call, error, "settings: %s", why.text);
    }
    const size_t all = saved_settings_commands(saved, call->rig, lines, &of_cameras);
    const size_t count = axes ? all : of_cameras;
    for (size_t i = 0; i < count && error == ERROR_OK; i++) {
        daemon_progress(call, "restoring", (uint32_t)i, (uint32_t)count);
        error = daemon_should_stop(call) ? ERROR_CANCELLED : run_line(call, lines[i]);
    }
    return error;
}

static int run_show(const struct command_call *call) {
    struct saved_settings saved;
    const int error = load(call, &saved);
    if (error == ERROR_OK) {
        reply_settings(call, &saved);
    }
    return error;
}

static int run_save(const struct command_call *call) {
    struct saved_settings saved;
    char text[SAVED_SETTINGS_BYTES];
    saved_settings_take(call->rig, &saved);
    const size_t length = saved_settings_print(&saved, text);
    const int error = commands_store_save(call, SAVED_SETTINGS_RECORD, text, length);
    if (error != ERROR_OK) {
        return command_fail_store(call, error, "settings", "save to");
    }
    reply_settings(call, &saved);
    return ERROR_OK;
}

static int run_restore(const struct command_call *call) {
    struct saved_settings saved;
    const int error = restore(call, true, &saved);
    if (error == ERROR_OK) {
        reply_settings(call, &saved);
    }
    return error;
}

static int run_forget(const struct command_call *call) {
    const int error = commands_store_remove(call, SAVED_SETTINGS_RECORD);
    if (error == ERROR_MISSING) {
        return command_fail(call, error, "settings: none saved");
    }
    return error == ERROR_OK ? ERROR_OK
                             : command_fail_store(call, error, "settings", "remove from");
}

static int run_settings(const struct command_call *call) {
    const int what = call->values[0].given ? call->values[0].choice : SHOW;
    if (daemon_of(call)->store == NULL) {
        return command_fail(call, ERROR_UNSUPPORTED,
                            "settings: saving is disabled: \"store\" is not set");
    }
    if ((what == SAVE || what == RESTORE) && call->rig->state != RIG_READY) {
        return commands_not_ready(call, what == SAVE ? "settings save" : "settings restore");
    }
    switch (what) {
        case SAVE:
            return run_save(call);
        case RESTORE:
            return run_restore(call);
        case FORGET:
            return run_forget(call);
        default:
            return run_show(call);
    }
}

/// Restores the settings of the cameras after a bring-up.
static int restore_cameras(const struct command_call *call) {
    struct daemon *daemon = daemon_of(call);
    struct saved_settings saved;
    if (!daemon->config.restore || daemon->store == NULL) {
        return ERROR_OK;
    }
    const int error = restore(call, false, &saved);
    if (error == ERROR_CANCELLED || (error != ERROR_OK && call->rig->state != RIG_READY)) {
        return error;
    }
    if (error != ERROR_OK && error != ERROR_MISSING) {
        // The instrument works, with other settings: reported, but not a failure of the bring-up.
        log_ring_print(&daemon->log_ring, HAL_LOG_WARNING, "%s", call->message);
    }
    const char *outcome = call->message;
    if (error == ERROR_OK) {
        outcome = "restored";
    } else if (error == ERROR_MISSING) {
        outcome = "none saved";
    }
    reply_text(call, "settings", outcome);
    call->message[0] = '\0';
    return ERROR_OK;
}

int commands_settings_bringup(const struct command_call *call) {
    const int error = command_give_rig(call, COMMANDS_BRINGUP, call->reply);
    return error != ERROR_OK ? error : restore_cameras(call);
}

static const struct command_argument arguments[] = {
    {.name = "WHAT",
     .kind = COMMAND_CHOICE,
     .choices = "show save restore forget",
     .optional = true,
     .help = "what to do; default: show"},
};

static const struct command commands[] = {
    {.name = "settings",
     .summary = "save the settings of the instrument, or restore them",
     .help = "Exposure, gain, window, the commanded positions of pan, zoom, focus and iris, and "
             "what was learned about the lenses. "
             "\"save\" stores those in force, across restarts; \"restore\" applies them after a "
             "bring-up, to the cameras first, then to the axes. Nothing is applied if they are of "
             "another profile or out of this instrument's range. With restore = yes in the "
             "configuration, bringup restores the settings of the cameras, and tables of lenses "
             "about which nothing was learned since the start.",
     .arguments = arguments,
     .argument_count = 1,
     .flags = COMMAND_LONG | COMMAND_MOVES | COMMAND_UNRECORDED,
     .run = run_settings},
};

const struct command *commands_settings_table(size_t *count) {
    *count = 1;
    return commands;
}
