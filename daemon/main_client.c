// SPDX-License-Identifier: Apache-2.0
// The client as the board carries it.
#include "daemon/client.h"
#include "daemon/image_pnm.h"
#include "daemon/image_raw.h"
#include "daemon/reconstruct_command.h"
#include "daemon/write.h"

static int run_reconstruct(int argc, char **argv) {
    static const struct image_format formats[] = {
        {"PGM/PPM", "pgm ppm pnm", image_pnm_probe, image_pnm_read},
        {"raw", "raw", NULL, image_raw_read},
    };
    static const struct result_writer writers[] = {
        {"disparity.pfm", false, write_pfm},  {"reasons.pgm", false, write_reasons},
        {"points.pcd", false, write_pcd},     {"mesh.ply", false, write_ply},
        {"result.json", false, write_result},
    };
    static const struct reconstruct_command_abilities abilities = {
        .formats = formats,
        .format_count = sizeof formats / sizeof formats[0],
        .load_calibration = calibration_loader_own,
        .writers = writers,
        .writer_count = sizeof writers / sizeof writers[0],
    };
    return reconstruct_command_run(&abilities, argc, argv);
}

int main(int argc, char **argv) {
    static const struct client_command commands[] = {
        {"reconstruct", "measure a surface from a pair of images", run_reconstruct},
    };
    return client_main(argc, argv, commands, sizeof commands / sizeof commands[0]);
}
