// SPDX-License-Identifier: Apache-2.0
// The client as shipped on the board.
#include "daemon/backends/replay/replay_command.h"
#include "daemon/client/client.h"
#include "daemon/surface/export_command.h"
#include "daemon/surface/reconstruct_command.h"

static int run_reconstruct(int argc, char **argv) {
    return reconstruct_command_run(&reconstruct_program_system, argc, argv);
}

static int run_export(int argc, char **argv) {
    return export_command_run(argc, argv, NULL);
}

int main(int argc, char **argv) {
    static const struct client_command commands[] = {
        {"reconstruct", "measure a surface from a pair of images", run_reconstruct, NULL},
        {"export", "write the pairs of a session as images", run_export, NULL},
        {"replay", "replay a recording and compare the pairs", replay_command_run, NULL},
    };
    return client_main(argc, argv, commands, sizeof commands / sizeof commands[0]);
}
