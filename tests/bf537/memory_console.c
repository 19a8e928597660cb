// SPDX-License-Identifier: Apache-2.0
// The commands of an instrument without a disk, those of firmware/bf537, on this machine: lines
// from standard input, progress ("... ") and answers to standard output, in front of the simulated
// rig at the address given. SIGINT is Ctrl-C. Memory is that of the board.
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/line/reply.h"
#include "core/error.h"
#include "daemon/backends/sim/sim_backend.h"
#include "memory/calibration.h"
#include "memory/files.h"
#include "memory/host.h"
#include "memory/measure.h"
#include "memory/pair.h"
#include "memory/reconstruct.h"
#include "rig/base/profile.h"

enum { STARTING_MS = 60000, COMMANDS_ROOM = 64, POOL_BYTES = 37 << 20, MESSAGE_ROOM = 1024 };

static void put(void *self, const void *data, size_t bytes) {
    (void)self;
    fwrite(data, 1, bytes, stdout);
}

static volatile sig_atomic_t stopped;

static void stop(int number) {
    (void)number;
    stopped = 1;
}

static bool should_stop(void *self) {
    (void)self;
    return stopped;
}

static void show_progress(void *self, const char *what, uint32_t done, uint32_t total) {
    (void)self;
    (void)done;
    (void)total;
    printf("... %s\n", what);
    fflush(stdout);
}

static void ignore_log(void *self, enum hal_log_level level, const char *text) {
    (void)self;
    (void)level;
    (void)text;
}

// A store that keeps nothing.
static int load_nothing(void *self, const char *name, void *data, size_t capacity, size_t *bytes) {
    (void)self;
    (void)name;
    (void)data;
    (void)capacity;
    (void)bytes;
    return ERROR_MISSING;
}

static int save_nothing(void *self, const char *name, const void *data, size_t bytes) {
    (void)self;
    (void)name;
    (void)data;
    (void)bytes;
    return ERROR_OK;
}

static int remove_nothing(void *self, const char *name) {
    (void)self;
    (void)name;
    return ERROR_MISSING;
}

static void take_line(const char *line, struct rig *rig, struct command_table table) {
    static struct reply reply;
    static struct command_value values[COMMAND_ARGUMENTS_MAX];
    static char storage[COMMAND_LINE_MAX + 1], message[MESSAGE_ROOM];
    const struct reply_sink sink = {put, NULL};
    const struct command *command = NULL;
    struct request request = {.json = false};
    int error = request_parse(line, &request, message, sizeof message);
    reply_init(&reply);
    error = error != ERROR_OK ? error
                              : command_parse(request.command, table.rows, table.count, storage,
                                              values, &command, message, sizeof message);
    const struct command_call call = {.rig = rig,
                                      .values = values,
                                      .reply = &reply.items,
                                      .message = message,
                                      .message_bytes = sizeof message,
                                      .table = table,
                                      .line = request.command};
    reply_begin(&reply, &sink, &request, false);
    if (error == ERROR_OK) {
        message[0] = '\0';
        error = command_run(command, &call);
    }
    reply_end(&reply, error, message);
    fflush(stdout);
}

int main(int argc, char **argv) {
    static const struct command *(*const tables[])(size_t *) = {
        memory_files_table,       memory_pair_table,    memory_calibration_table,
        memory_reconstruct_table, memory_measure_table, memory_rig_table};
    static const struct hal_log_operations log_operations = {ignore_log};
    static const struct hal_log log = {&log_operations, NULL};
    static const struct hal_store_operations store_operations = {load_nothing, save_nothing,
                                                                 remove_nothing};
    static const struct hal_store store = {&store_operations, NULL};
    static const struct rig_observer observer = {should_stop, show_progress, NULL};
    static struct command all[COMMANDS_ROOM];
    static struct sim_backend sim;
    static struct rig rig;
    static char line[COMMAND_LINE_MAX + 2];
    struct rig_profile profile;
    void *pool = malloc(POOL_BYTES);
    if (argc != 2 || pool == NULL || rig_profile_named("rig", &profile) != ERROR_OK ||
        sim_backend_open(&sim, argv[1], STARTING_MS) != ERROR_OK) {
        fputs("memory_console: no simulated rig\n", stderr);
        return 1;
    }
    struct rig_ports ports = sim_backend_ports(&sim);
    ports.log = &log;
    rig_init(&rig, &profile, &ports, &observer);
    struct arena lent;
    arena_init(&lent, pool, POOL_BYTES);
    memory_pair_begin(&lent);
    memory_calibration_begin(&store);
    (void)signal(SIGINT, stop);
    const struct command_table table =
        command_join(tables, sizeof tables / sizeof tables[0], all, COMMANDS_ROOM);
    while (fgets(line, sizeof line, stdin) != NULL) {
        line[strcspn(line, "\n")] = '\0';
        stopped = 0;
        take_line(line, &rig, table);
        (void)rig_serve(&rig);
    }
    free(pool);
    sim_backend_close(&sim);
    return 0;
}
