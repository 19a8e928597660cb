// SPDX-License-Identifier: Apache-2.0
/// One camera for autoexposure: its limits, setting it, measuring it. For autoexposure.c only.
#ifndef VERGENCE_RIG_AUTO_EXPOSURE_CAMERA_H
#define VERGENCE_RIG_AUTO_EXPOSURE_CAMERA_H

#include "focus/exposure_search.h"
#include "rig/rig_region.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { EXPOSURE_BOTH_SIDES = 1 << RIG_LEFT | 1 << RIG_RIGHT };

enum exposure_field {
    EXPOSURE_WHOLE_FIELD,   ///< coarsely sampled, for a search
    EXPOSURE_SHARED_FIELD,  ///< finely, and for longer, to compare the cameras
};

/// What one measurement shows.
struct exposure_light {
    struct exposure_measure measure;
    double shared;   ///< mean of the field that both cameras see, of EXPOSURE_WHOLE_FIELD
    double spread;   ///< spread of the means of its frames, relative; 0: too few frames
    double real_us;  ///< exposure x gain
    double exposure_us;
};

/// An autoexposure under way.
struct exposure_job {
    struct rig *rig;
    unsigned sides;                  ///< bits RIG_LEFT, RIG_RIGHT
    struct rig_rectangle region_px;  ///< width 0: the present windows
    struct exposure_target target;
    uint32_t measured;                          ///< settings so far
    struct exposure_setting before[RIG_SIDES];  ///< 0: not known
    bool keep_iris, iris_moved;
    int32_t iris;               ///< present position of the iris
    enum exposure_field field;  ///< field of the running region
    struct exposure_histogram all, shared;
};

double exposure_product(const struct exposure_setting *setting);

/// What a camera can be set to. Exposures are those of its present window, in which pairs are
/// taken; the longest one keeps pairs within their skew limit.
struct exposure_limits exposure_camera_limits(const struct rig *rig, unsigned side);

bool exposure_has_iris(const struct exposure_job *job, unsigned side);
/// Moves the irises of these sides, and waits.
int exposure_move_iris(struct exposure_job *job, unsigned sides, int32_t position);

/// Begins the region of the request, or of that the field that both cameras share.
int exposure_region_begin(struct exposure_job *job, struct rig_region *region, unsigned side,
                          enum exposure_field which);
/// Sets a region's camera. A camera with its own port may change the setting to what it accepts;
/// `search` (NULL: none) then learns that.
int exposure_region_set(struct exposure_job *job, struct rig_region *region,
                        struct exposure_setting *setting, struct exposure_search *search);
/// Measures with this setting.
int exposure_region_measure(struct exposure_job *job, struct rig_region *region,
                            const struct exposure_setting *setting, struct exposure_light *light);
/// Sets exposure and gain of a camera without a region, where they differ; 0: keeps them.
int exposure_camera_set(struct exposure_job *job, unsigned side,
                        const struct exposure_setting *setting);
/// Ends a region and leaves its camera with this setting.
int exposure_region_end(struct exposure_job *job, struct rig_region *region,
                        const struct exposure_setting *setting);

/// Reports progress to the observer.
void exposure_report(const struct exposure_job *job);

#ifdef __cplusplus
}
#endif

#endif
