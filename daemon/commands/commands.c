// SPDX-License-Identifier: Apache-2.0
#include "daemon/commands/commands.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/commands.h"

enum { COMMANDS_MAX = 64 };

int command_fail(const struct command_call *call, int error, const char *format, ...) {
    INVARIANT(error < 0);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(call->message, call->message_bytes, format, arguments);
    va_end(arguments);
    for (char *at = call->message; *at != '\0'; at++) {
        *at = (unsigned char)*at < ' ' || *at == 0x7F ? '?' : *at;
    }
    return error;
}

int command_fail_store(const struct command_call *call, int error, const char *subject,
                       const char *action) {
    const char *why = error_text(error);
    if (error == ERROR_REFUSED) {
        why = "permission denied: check its owner, and whether its disk is read-only";
    } else if (error == ERROR_IO) {
        why =
            "its disk has failed, or the directory was removed: restore it and restart the daemon";
    }
    return command_fail(call, error, "%s: cannot %s the store %s: %s", subject, action,
                        daemon_of(call)->config.store, why);
}

/// An access to a record: it is loaded, else saved, else removed.
struct store_access {
    const struct hal_store *store;
    const char *name;
    char *loaded;
    const char *saved;
    size_t bytes;
    size_t *length;
    int error;
};

static void access_store(void *cookie) {
    struct store_access *self = cookie;
    const struct hal_store_operations *operations = self->store->operations;
    void *store = self->store->self;
    self->error = self->loaded != NULL
                      ? operations->load(store, self->name, self->loaded, self->bytes, self->length)
                  : self->saved != NULL
                      ? operations->save(store, self->name, self->saved, self->bytes)
                      : operations->remove(store, self->name);
}

static int run_access(const struct command_call *call, struct store_access *access) {
    struct daemon *daemon = daemon_of(call);
    INVARIANT(daemon->store != NULL);
    access->store = daemon->store;
    disk_writer_run(&daemon->disk_writer, access_store, access);
    return access->error;
}

int commands_store_load(const struct command_call *call, const char *name, char *text,
                        size_t capacity, size_t *length) {
    struct store_access access = {
        .name = name, .loaded = text, .bytes = capacity, .length = length};
    const int error = run_access(call, &access);
    INVARIANT(error != 0 || *length <= capacity);
    return error;
}

int commands_store_save(const struct command_call *call, const char *name, const char *text,
                        size_t length) {
    struct store_access access = {.name = name, .saved = text, .bytes = length};
    return run_access(call, &access);
}

int commands_store_remove(const struct command_call *call, const char *name) {
    struct store_access access = {.name = name};
    return run_access(call, &access);
}

int command_give(const struct command_call *call, const char *line,
                 const struct command_reply *reply) {
    struct daemon *daemon = daemon_of(call);
    char storage[COMMAND_LINE_MAX + 1];
    struct command_value values[COMMAND_ARGUMENTS_MAX];
    const struct command *command = NULL;
    const int error = command_parse(line, daemon->table, daemon->table_count, storage, values,
                                    &command, call->message, call->message_bytes);
    INVARIANT(error == 0 && command != NULL);
    struct command_call inner = *call;
    inner.values = values;
    inner.reply = reply;
    return record_run(&daemon->record, command, &inner, line);
}

/// The rig's `status`, and the daemon's part of the state.
static int run_status(const struct command_call *call) {
    const int error = commands_state_status(call);
    if (error != 0) {
        return error;
    }
    commands_session_put_state(call);
    commands_calibration_put_state(call);
    return 0;
}

static int by_name(const void *a, const void *b) {
    return strcmp(((const struct command *)a)->name, ((const struct command *)b)->name);
}

/// Adapts a rig's command to the daemon.
static void adapt(struct command *command) {
    if (strcmp(command->name, "status") == 0) {
        command->run = run_status;
    } else if (strcmp(command->name, COMMANDS_BRINGUP) == 0) {
        command->run = commands_settings_bringup;
        command->flags |= COMMAND_UNRECORDED;  // it gives the rig's, and others
    }
}

const struct command *commands_all(size_t *count) {
#define TABLE(name) commands_##name##_table,
    static const struct command *(*const tables[])(size_t *) = {COMMAND_MODULES(TABLE)
                                                                    command_rig_table};
#undef TABLE
    static struct command all[COMMANDS_MAX];
    *count = 0;
    for (size_t i = 0; i < sizeof tables / sizeof tables[0]; i++) {
        size_t more = 0;
        const struct command *table = tables[i](&more);
        INVARIANT(*count + more <= COMMANDS_MAX);
        memcpy(all + *count, table, more * sizeof *all);
        *count += more;
    }
    for (size_t i = 0; i < *count; i++) {
        adapt(&all[i]);
    }
    qsort(all, *count, sizeof *all, by_name);
    return all;
}
