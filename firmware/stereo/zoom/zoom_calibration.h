// SPDX-License-Identifier: Apache-2.0
/// The calibration of a rig with motorized zooms and pans: lenses, mounts and pan axes as functions
/// of the motors' positions, with the covariance of all parameters. From it follows the pair's
/// `struct calibration` at any state within the calibrated ranges.
///
/// Frames: the instrument's frame is that of the left camera at pan 0 and its smallest calibrated
/// focal length: x right, y down, z forward, origin at the entrance pupil. It does not turn with
/// pan. Lengths in mm, angles in rad, lens positions in counts, pixels of the whole sensor.
///
/// Model of a camera, with T_i Chebyshev's polynomials and u(x) = (2 x - min - max) / (max - min)
/// the position within a calibrated range:
///   f(zoom)       sum of term[i] T_i(u(zoom)): focal length in px, focused at infinity
///   focus_dioptre reciprocal of the distance in focus, 1/m: sum of term[i] T_i(u(log f)), plus
///                 focus[0] T_1(u(focus)) + focus[1] T_2(u(focus)), which do not depend on zoom
///   F             image distance in px, what K holds: f / (1 - f_mm focus_dioptre / 1000), thin
///   lens centre, distortion, pupil   sums of term[i] T_i(u(log f)); the pupil's is 0 at the
///   smallest f pose          at pan angle a the camera is turned about its axis by a (1 + scale),
///   then
///                 shifted along its own z by the pupil function
/// Every function also has an irregularity: a standard deviation of independent deviations from the
/// smooth curve from setting to setting (a cam's ripple).
#ifndef VERGENCE_STEREO_ZOOM_ZOOM_CALIBRATION_H
#define VERGENCE_STEREO_ZOOM_ZOOM_CALIBRATION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/parallel.h"
#include "stereo/geometry/calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    ZOOM_TERMS_MAX = 8,
    ZOOM_FOCUS_TERMS = 2,
    /// Of both cameras together. The covariance has as many rows.
    ZOOM_PARAMETERS_MAX = 192,
    ZOOM_TEXT_MAX_BYTES = 384 * 1024,
};

/// Functions of a lens, with R = `radius_px`. Distortion is stated as what it does to the pixel.
enum zoom_function_name {
    ZOOM_FOCAL,          // px, of the zoom position; all others of log f
    ZOOM_FOCUS_DIOPTRE,  // 1/m
    ZOOM_CENTRE_X,       // px of the whole sensor; 0 is the centre of the first pixel
    ZOOM_CENTRE_Y,
    ZOOM_RADIAL_2,      // px outwards at R: k1 = value F^2 / R^3
    ZOOM_RADIAL_4,      // k2 = value F^4 / R^5
    ZOOM_RADIAL_6,      // k3 = value F^6 / R^7
    ZOOM_TANGENTIAL_1,  // px: p1 = value F / R^2
    ZOOM_TANGENTIAL_2,  // p2
    ZOOM_PUPIL,         // mm forward along the optical axis
    ZOOM_FUNCTIONS
};

struct zoom_function {
    int terms;  // 0: the function is 0
    double term[ZOOM_TERMS_MAX];
    double
        irregularity;  // standard deviation of one setting from the curve, in the function's unit
};

struct zoom_range {
    double min, max;
};

/// Axis of the servo and how the camera sits on it.
enum zoom_mount_parameter {
    ZOOM_AXIS_DIRECTION_X,  // the axis' direction is (x, 1, z), normalised
    ZOOM_AXIS_DIRECTION_Z,
    ZOOM_AXIS_POINT_X,  // point where the axis meets y = 0 of the instrument's frame
    ZOOM_AXIS_POINT_Z,
    ZOOM_PAN_SCALE,   // the turned angle is (1 + this) times the commanded one
    ZOOM_ROTATION_X,  // rotation vector of R_instrument_camera at pan 0; left: 0
    ZOOM_ROTATION_Y,
    ZOOM_ROTATION_Z,
    ZOOM_POSITION_X,  // entrance pupil at pan 0 and the smallest focal length; left: 0
    ZOOM_POSITION_Y,
    ZOOM_POSITION_Z,
    ZOOM_MOUNT_PARAMETERS
};

struct zoom_camera {
    char name[CALIBRATION_NAME_BYTES];  // serial number or port; "" if not known
    int width_px, height_px;            // size of the whole sensor
    double radius_px;  // radius for which distortion is stated, such as half of the diagonal
    double pixel_mm;
    struct zoom_range zoom, focus;  // counts: calibrated, nothing is known beyond
    struct zoom_range log_focal;    // range of log f over `zoom`: u(log f) is -1 at the smallest f
    struct zoom_range pan_rad;      // commanded angles: calibrated, nothing is known beyond
    struct zoom_function function[ZOOM_FUNCTIONS];
    double focus_dioptre_by_count[ZOOM_FOCUS_TERMS];  // 1/m
    double mount[ZOOM_MOUNT_PARAMETERS];
    // What the motors add: standard deviations of one reading's mean (counts), of the drift between
    // calibration and use (counts), of the servo's resting angle, and of how it moves at rest
    // (rad).
    double reading_sigma_counts, drift_sigma_counts, pan_sigma_rad, creep_sigma_rad;
};

/// How well the calibration was checked: on settings that were left out.
struct zoom_validation {
    int settings, boards, corners, rejected_corners;
    double rms_px;          // RMS over all corners
    double held_out_px;     // epipolar, at settings left out; 0: not checked
    double held_out_focal;  // relative
    double chi_square_z;    // standard score of the fit
};

struct zoom_calibration {
    char id[CALIBRATION_ID_BYTES];
    char date[11];
    char note[CALIBRATION_NOTE_BYTES];
    char instrument[CALIBRATION_NAME_BYTES];
    struct zoom_camera camera[2];  // left, right
    double scale_sigma;            // relative, of all lengths (the print of the board)
    struct zoom_validation validation;
    /// Covariance of the parameters in the order of `zoom_parameter_list`, lower triangle by rows:
    /// element i (i + 1) / 2 + j, j <= i. 0 parameters: not stated.
    int parameters;
    double covariance[ZOOM_PARAMETERS_MAX * (ZOOM_PARAMETERS_MAX + 1) / 2];
};

/// Where the motors are: positions in counts as means of readings, pan as commanded. `deviation` is
/// added to the functions' values: what is known of this setting beyond the smooth curve; else 0.
struct zoom_camera_state {
    double zoom_counts, focus_counts, pan_rad;
    double deviation[ZOOM_FUNCTIONS];
};
struct zoom_state {
    struct zoom_camera_state side[2];
};

/// Both cameras at a state, in the instrument's frame.
struct zoom_pair {
    struct {
        struct lens lens;      // lens of the whole sensor
        double f_px;           // focal length, focused at infinity
        double focus_dioptre;  // 1/m
        double R_instrument_camera[9];
        double position_mm[3];  // entrance pupil
    } side[2];
};

/// Addresses of all parameters of both cameras, in the order of the covariance: for each camera the
/// terms of its functions, its focus terms, its mount (without rotation and position for the left
/// one). Returns their number.
int zoom_parameter_list(struct zoom_camera camera[2], double *parameter[ZOOM_PARAMETERS_MAX]);

/// u of a value in a range with min < max: -1 at min, 1 at max.
double zoom_range_unit(const struct zoom_range *range, double value);

/// Chebyshev's polynomials T_0(u) to T_count-1(u), count <= ZOOM_TERMS_MAX.
void zoom_chebyshev(double u, int count, double *value);

/// Value of a function, 0 <= name < ZOOM_FUNCTIONS: of the zoom position in counts for
/// ZOOM_FOCAL, else of log f.
double zoom_function_value(const struct zoom_camera *camera, enum zoom_function_name name,
                           double argument);

/// Values of all functions of one camera at a state where its focal length at infinity is
/// `f_px` > 0. The solver in calib/ estimates with this and the next two functions.
void zoom_values_at(const struct zoom_camera *camera, const struct zoom_camera_state *state,
                    double f_px, double value[ZOOM_FUNCTIONS]);

/// Focal length at infinity divided by the image distance F.
double zoom_focal_ratio(const struct zoom_camera *camera, const double value[ZOOM_FUNCTIONS]);

/// R_instrument_camera and the entrance pupil, with the mount turned by `angle_rad` (the commanded
/// pan times 1 + its scale) and the pupil `pupil_mm` forward.
void zoom_pose_at(const struct zoom_camera *camera, double angle_rad, double pupil_mm, double R[9],
                  double position_mm[3]);

/// Both cameras at a state. Neither the ranges nor the result are checked.
void zoom_pair_at(const struct zoom_camera camera[2], const struct zoom_state *state,
                  struct zoom_pair *pair);

/// The pair as a calibration: lenses and relative pose.
int zoom_pair_calibration(const struct zoom_pair *pair, struct calibration *result);

/// ERROR_RANGE if a position lies outside its calibrated range by more than four standard
/// deviations of what the motors add; `fault` (may be NULL) names the axis, such as
/// "left_zoom_counts".
int zoom_state_check(const struct zoom_calibration *calibration, const struct zoom_state *state,
                     struct calibration_fault *fault);

/// The pair's calibration at a state, for whole frames of the sensor, with the axes in its origin
/// and its uncertainty. ERROR_RANGE as `zoom_state_check`, or what `calibration_validate` returns.
int zoom_calibration_at(const struct zoom_calibration *calibration, const struct zoom_state *state,
                        struct calibration *result, struct calibration_fault *fault);

/// The text: canonical, fixed decimals, CRC-32 on the last line, as that of calibration.h.
/// print(parse(text)) == text. Errors as there; after an error `result` is undefined.
/// `watch` may be NULL.
int zoom_calibration_parse(const char *text, size_t length, const struct watch *watch,
                           struct zoom_calibration *result, struct calibration_fault *fault);
/// Returns the length without the zero, or ERROR_BUFFER, or an error of
/// `zoom_calibration_validate`.
int zoom_calibration_print(const struct zoom_calibration *calibration, char *text,
                           size_t size_bytes);
/// Texts, ranges, counts, and that the model is defined over its ranges.
int zoom_calibration_validate(const struct zoom_calibration *calibration,
                              struct calibration_fault *fault);
/// Whether a text begins as one of these.
bool zoom_calibration_is_text(const char *text, size_t length);

#ifdef __cplusplus
}
#endif

#endif
