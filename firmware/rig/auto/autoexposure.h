// SPDX-License-Identifier: Apache-2.0
/// Finds exposure, gain and, if these do not suffice, iris of one or both cameras, by measuring a
/// region or the whole field (focus/exposure_search.h). Both cameras end equally bright in the
/// field that they share.
///
/// The shared field is the region; without one the middle half of each field, where cameras that
/// are toed in to an object both see it. Cameras that are not toed in share it only for far
/// objects: they need a region with the object in both.
///
/// The left camera is measured first, the right one with what was found. If the right one then
/// needs less light, as its brightest parts would saturate, both get less. Then the exposure of the
/// right one, and where that has too coarse steps its gain, make up for the difference between the
/// lenses.
///
/// Light of lamps on the mains is measured over one period of the mains, or with exposures that are
/// a multiple of half a period.
#ifndef VERGENCE_RIG_AUTO_AUTOEXPOSURE_H
#define VERGENCE_RIG_AUTO_AUTOEXPOSURE_H

#include "focus/exposure_search.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Least side of a region, px: its 128 green pixels make the noise of one small in their mean.
enum { RIG_AUTOEXPOSURE_REGION_MIN_PX = 16 };

struct rig_autoexposure_request {
    unsigned sides;  ///< bits RIG_LEFT, RIG_RIGHT
    /// As rig_region_begin (rig/rig_region.h), of both cameras; width 0: the present windows.
    struct rig_rectangle region_px;
    double target;   ///< mean of green, part of the range above black: 0.01 .. 0.9, usually 0.5
    bool whites;     ///< the whites of a calibration board stay at or below 80 %
    bool keep_iris;  ///< it does not move
};

struct rig_autoexposure_side {
    uint32_t exposure_us;
    uint16_t gain_q3;
    int32_t iris;      ///< counts; INT32_MIN: no motor
    double mean;       ///< mean of green, as a part of the range above black
    double saturated;  ///< part of all values
    /// Mean of the middle half of the field, at the same setting; of a region that of all of it.
    double middle;
    unsigned steps;  ///< settings that were measured
    enum exposure_bound bound;
    /// EXPOSURE_FOUND; EXPOSURE_TOO_DARK: the mean is below the target, but usable;
    /// EXPOSURE_TOO_BRIGHT: above it, but not saturated.
    enum exposure_verdict verdict;
};

struct rig_autoexposure_result {
    struct rig_autoexposure_side side[RIG_SIDES];
    /// Of both sides: mean of the right in the shared field over that of the left, minus 1.
    double difference;
    /// Of both sides: light of the left in the shared field over that of the right, at equal
    /// exposure and gain; 0: not compared.
    double ratio;
    /// Of both sides: by which part the mean of the shared field changes from frame to frame.
    double flicker;
};

/// Errors: ERROR_ARGUMENT (sides, target); ERROR_RANGE: no such region, too dark or too bright at
/// the limits of exposure, gain and iris, or the camera rejects a setting, and ERROR_MOVED: the
/// light changes from frame to frame (`rejected` says what to do); ERROR_UNSUPPORTED: the camera
/// has no such control; those of rig_region_begin and of lens moves. After an error and after
/// ERROR_CANCELLED exposure, gain and window are as before, and so is the iris, except that after
/// ERROR_CANCELLED and errors of lenses it rests where it is.
int rig_autoexposure(struct rig *self, const struct rig_autoexposure_request *request,
                     struct rig_autoexposure_result *result);

#ifdef __cplusplus
}
#endif

#endif
