// SPDX-License-Identifier: Apache-2.0
// The client as shipped on the board.
#include "daemon/backends/replay/replay_command.h"
#include "daemon/client/client.h"
#include "daemon/images/image_pnm.h"
#include "daemon/surface/export_command.h"
#include "daemon/surface/reconstruct_command.h"

static int run_reconstruct(int argc, char **argv) {
    static const struct image_format formats[] = {
        {"PGM/PPM", "pgm ppm pnm", image_pnm_probe, image_pnm_read},
        {"raw", "raw", NULL, image_raw_read},
    };
    static const struct reconstruct_files files = {formats, sizeof formats / sizeof formats[0],
                                                   calibration_loader_own};
    return reconstruct_command_run(&files, &reconstruct_outputs_plain, argc, argv);
}

int main(int argc, char **argv) {
    static const struct client_command commands[] = {
        {"reconstruct", "measure a surface from a pair of images", run_reconstruct},
        {"export", "write the pairs of a session as images", export_command_run},
        {"replay", "replay a recording and compare the pairs", replay_command_run},
    };
    return client_main(argc, argv, commands, sizeof commands / sizeof commands[0]);
}
