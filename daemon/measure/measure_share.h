// SPDX-License-Identifier: Apache-2.0
/// How much of the subject a surface shows, and how well.
#ifndef VERGENCE_DAEMON_MEASURE_MEASURE_SHARE_H
#define VERGENCE_DAEMON_MEASURE_MEASURE_SHARE_H

#include <stdbool.h>
#include <stdint.h>

#include "daemon/surface/result/result_figures.h"
#include "measure/measure_subject.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Depths of the subject, left camera, both inclusive.
struct measure_depths {
    int32_t near_um, far_um;
};

struct measure_share {
    /// Pixels of the subject with a point; pixels without one between them. Pixels beside the
    /// subject, with another depth or without any, do not count.
    uint32_t measured, missed;
    enum reason hole;                        ///< why most of these have none; VALID: there are few
    struct result_figures_quantiles spread;  ///< of its points; zeros: it has none
};

/// The subject at a ray in a whole surface: the same that its coarse points showed. As
/// measure_subject_find; also false if out of memory.
bool measure_share_find(const struct reconstruct_result *result,
                        const struct measure_subject_request *request,
                        struct measure_subject *subject);

/// False: out of memory.
bool measure_share_of(const struct reconstruct_result *result, const struct measure_depths *depths,
                      struct measure_share *share);

#ifdef __cplusplus
}
#endif

#endif
