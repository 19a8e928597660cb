// SPDX-License-Identifier: Apache-2.0
/// What the positions of a lens mean in millimetres, f-numbers and pixels of blur: the data sheet
/// in the profile (focus/lens_optics.h) with what was learned about this lens
/// (focus/lens_learned.h).
///
/// Nothing here moves or reads a lens: "present" is where the last move went, or the last reading.
/// All functions return 0; ERROR_NOT_CONNECTED (no such motor); ERROR_MISSING (neither profile nor
/// table knows the relation: rig_optics_missing says which); ERROR_NOT_READY (a position that it
/// needs was never read). Pixels are those of the sensor, whatever window and skipping are.
#ifndef VERGENCE_RIG_RIG_OPTICS_H
#define VERGENCE_RIG_RIG_OPTICS_H

#include "focus/depth_iris.h"
#include "focus/lens_learned.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Blur diameter at which an image counts as sharp, for depths of field.
#define RIG_OPTICS_SHARP_PX 1.0

/// Which relation a call needs.
enum rig_optics_relation {
    RIG_OPTICS_FOCAL_LENGTH,
    RIG_OPTICS_DISTANCE,
    RIG_OPTICS_F_NUMBER,
    RIG_OPTICS_BLUR
};

/// The settings that are missing in this profile for a relation, as text: "rig.focal_length_wide
/// and rig.focal_length_tele"; NULL: none. Static storage.
const char *rig_optics_missing(const struct rig *self, enum rig_optics_relation relation);

/// The position of an axis at which the lens is now, within its range.
int rig_optics_position(const struct rig *self, unsigned side, enum lens_axis axis,
                        int32_t *position);

/// Focal length at a zoom position, and the inverse within the range of zoom (ERROR_RANGE:
/// outside). The magnification is the focal length over that at the smallest position.
int rig_optics_focal_length(const struct rig *self, unsigned side, int32_t zoom, double *focal_mm);
int rig_optics_zoom_for(const struct rig *self, unsigned side, double focal_mm, int32_t *zoom);
int rig_optics_wide(const struct rig *self, unsigned side, double *focal_mm);

/// Distance in focus at a focus position at the present zoom (INFINITY), and the inverse within the
/// range of focus (ERROR_RANGE: nearer than it reaches).
int rig_optics_distance_at(const struct rig *self, unsigned side, int32_t focus,
                           double *distance_mm);
int rig_optics_focus_for(const struct rig *self, unsigned side, double distance_mm, int32_t *focus);

/// The distances between which an object is with a probability of 95 % whose focus was found at a
/// position (counts) with this standard deviation: it and that of a lens from its data sheet.
int rig_optics_distance_bounds(const struct rig *self, unsigned side, double focus,
                               double sigma_counts, double *near_mm, double *far_mm);

/// f-number at an iris position, and the inverse within the range of iris (ERROR_RANGE: outside).
int rig_optics_f_number(const struct rig *self, unsigned side, int32_t iris, double *f_number);
int rig_optics_iris_for(const struct rig *self, unsigned side, double f_number, int32_t *iris);

/// Blur diameter in px that one count of focus makes at the present zoom and iris. Without an iris
/// motor, that of the open iris.
int rig_optics_blur_per_count(const struct rig *self, unsigned side, double *px);

/// Blur diameter in px of an object at a distance at the present state; `*diffraction_px` that of
/// diffraction.
int rig_optics_blur_at(const struct rig *self, unsigned side, double distance_mm, double *px,
                       double *diffraction_px);

/// Depth of field with the focus at a distance and the present zoom and iris: the distances with a
/// blur of at most `blur_px` (> 0).
int rig_optics_sharp_range(const struct rig *self, unsigned side, double distance_mm,
                           double blur_px, double *near_mm, double *far_mm);

/// f-numbers at the ends of the iris, 0 < open <= closed.
int rig_optics_iris_ends(const struct rig *self, unsigned side, double *open, double *closed);

/// An iris for a depth range at the present zoom and focus.
struct rig_optics_iris {
    int32_t iris;
    double f_number;
    double blur_px;         ///< blur at the worse end of the depth range
    double diffraction_px;  ///< everywhere
    double focus_mm;        ///< the distance in focus that would serve best
    int32_t focus;          ///< its position
    double best_px;         ///< blur of both ends with that focus and this iris
    enum depth_iris_limit limit;
};
/// The iris of depth_iris_for, for RIG_OPTICS_SHARP_PX. ERROR_RANGE: not 2 focal lengths < near <=
/// far.
int rig_optics_iris_for_range(const struct rig *self, unsigned side, double near_mm, double far_mm,
                              struct rig_optics_iris *found);

/// Iris position that makes `reach_mm` before and behind a distance sharp, when the focus is there,
/// to help with a verdict: "iris 480: +-11 mm"; and the diameter of the diffraction there.
/// ERROR_RANGE: the iris does not close so far, or not 2 focal lengths < distance - reach.
int rig_optics_iris_for_reach(const struct rig *self, unsigned side, double distance_mm,
                              double reach_mm, int32_t *iris, double *diffraction_px);

/// Where the present object should be in focus at the present zoom, from what was learned, and the
/// half range in which to search for it: three standard deviations of table and object, the drift
/// of the potentiometer, and the play where there is no room for an approach. The object may have
/// been found by the other lens. ERROR_MISSING: nothing was learned.
int rig_optics_focus_prediction(const struct rig *self, unsigned side, int32_t *position,
                                int32_t *half_range);

/// The same for an object that the other lens has in focus at the position `other` (counts, with
/// this standard deviation), before that is learned.
int rig_optics_focus_from_other(const struct rig *self, unsigned side, double other,
                                double sigma_counts, int32_t *position, int32_t *half_range);

/// An autofocus at the present zoom found the object here, with this standard deviation, both in
/// 1/16 count. `distance_mm`: the object's distance if that was measured otherwise, else 0.
int rig_optics_learn_focus(struct rig *self, unsigned side, int32_t position_q4, uint16_t sigma_q4,
                           double distance_mm);

#ifdef __cplusplus
}
#endif

#endif
