// SPDX-License-Identifier: Apache-2.0
/// How much of the subject a surface shows, and how well.
#ifndef VERGENCE_CONSOLE_MEASURE_MEASURE_SHARE_H
#define VERGENCE_CONSOLE_MEASURE_MEASURE_SHARE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/arena.h"
#include "measure/measure_subject.h"
#include "surface/surface_figures.h"

#ifdef __cplusplus
extern "C" {
#endif

struct measure_share {
    /// Pixels of the subject with a point; pixels without one between them. Pixels beside the
    /// subject, with another depth or without any, do not count.
    uint32_t measured, missed;
    enum reason hole;                      ///< why most of these have none; VALID: there are few
    struct surface_figures_spread spread;  ///< of its points; zeros: it has none
};

/// The subject at a ray in a whole surface: the same that its coarse points showed. As
/// measure_subject_find; also false if the arena is too small.
bool measure_share_find(const struct reconstruct_result *result,
                        const struct measure_subject_request *request, struct arena *arena,
                        struct measure_subject *subject);

/// How much of the subject, which has these depths, the surface shows. False: the arena is too
/// small.
bool measure_share_of(const struct reconstruct_result *result,
                      const struct surface_figures_depths *depths, struct arena *arena,
                      struct measure_share *share);

/// For either.
size_t measure_share_need_bytes(const struct reconstruct_result *result);

#ifdef __cplusplus
}
#endif

#endif
