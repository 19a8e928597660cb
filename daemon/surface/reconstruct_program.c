// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_program.h"

#include "daemon/images/image_pnm.h"

static const struct image_format formats[] = {
    {"PGM/PPM", "pgm ppm pnm", image_pnm_probe, image_pnm_read},
    {"raw", "raw", NULL, image_raw_read},
};

const struct reconstruct_program reconstruct_program_system = {
    .formats = formats,
    .format_count = sizeof formats / sizeof formats[0],
    .load_calibration = calibration_loader_own,
    .writers = {[RESULT_DISPARITY_PFM] = write_pfm,
                [RESULT_REASONS_PGM] = write_reasons,
                [RESULT_POINTS_PCD] = write_pcd,
                [RESULT_MESH_PLY] = write_ply,
                [RESULT_COMPACT] = compact_write,
                [RESULT_RESULT_JSON] = write_result},
};
