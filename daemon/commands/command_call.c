// SPDX-License-Identifier: Apache-2.0
#include <stdarg.h>
#include <stdio.h>

#include "daemon/commands/commands.h"

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
    if (self->loaded != NULL) {
        self->error = operations->load(store, self->name, self->loaded, self->bytes, self->length);
    } else if (self->saved != NULL) {
        self->error = operations->save(store, self->name, self->saved, self->bytes);
    } else {
        self->error = operations->remove(store, self->name);
    }
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
    INVARIANT(error != ERROR_OK || *length <= capacity);
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

static int give(const struct command_call *call, const struct command *table, size_t count,
                const char *line, const struct command_reply *reply) {
    char storage[COMMAND_LINE_MAX + 1];
    struct command_value values[COMMAND_ARGUMENTS_MAX];
    const struct command *command = NULL;
    const int error = command_parse(line, table, count, storage, values, &command, call->message,
                                    call->message_bytes);
    INVARIANT(error == ERROR_OK && command != NULL);
    struct command_call inner = *call;
    inner.values = values;
    inner.line = line;
    inner.reply = reply;
    return record_run(&daemon_of(call)->record, command, &inner, line);
}

int command_give(const struct command_call *call, const char *line,
                 const struct command_reply *reply) {
    const struct daemon *daemon = daemon_of(call);
    return give(call, daemon->table.rows, daemon->table.count, line, reply);
}

int command_give_rig(const struct command_call *call, const char *line,
                     const struct command_reply *reply) {
    size_t count = 0;
    const struct command *table = command_rig_table(&count);
    return give(call, table, count, line, reply);
}
