// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_job.h"
#include "daemon/surface/result/write.h"

static const struct result_writer writers[] = {
    {"disparity.pfm", false, write_pfm},  {"reasons.pgm", false, write_reasons},
    {"points.pcd", false, write_pcd},     {"mesh.ply", false, write_ply},
    {"result.json", false, write_result},
};

const struct reconstruct_outputs reconstruct_outputs_plain = {
    .writers = writers,
    .writer_count = sizeof writers / sizeof writers[0],
};
