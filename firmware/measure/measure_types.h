// SPDX-License-Identifier: Apache-2.0
/// The types of measure.h.
#ifndef VERGENCE_MEASURE_MEASURE_TYPES_H
#define VERGENCE_MEASURE_MEASURE_TYPES_H

#include <stdbool.h>
#include <stdint.h>

#include "measure/zoom_field.h"

#ifdef __cplusplus
extern "C" {
#endif

/// X(name, seconds, text). Seconds: what the phase takes, for the time left: on the simulated rig's
/// clock, with whole frames; those of the surface are the machine's.
#define MEASURE_PHASE_LIST(X)                    \
    X(BRINGUP, 1, "bring up")                    \
    X(AHEAD, 1, "look ahead")                    \
    X(WIDE_ZOOM, 2, "zoom out")                  \
    X(WIDE_IRIS, 2, "iris for the wide view")    \
    X(WIDE_LIGHT, 3, "light of the wide view")   \
    X(WIDE_FOCUS, 2, "focus of the wide view")   \
    X(WIDE_PAIR, 3, "wide pair")                 \
    X(WIDE_SURFACE, 1, "coarse surface")         \
    X(AIM, 2, "aim")                             \
    X(AIMED_PAIR, 3, "wide pair after the aim")  \
    X(AIMED_SURFACE, 1, "coarse surface")        \
    X(OTHER_ZOOM, 4, "other zoom")               \
    X(OTHER_FOCUS, 2, "focus at the other zoom") \
    X(OTHER_LIGHT, 3, "light at the other zoom") \
    X(OTHER_PAIR, 3, "pair at the other zoom")   \
    X(ZOOM, 4, "zoom")                           \
    X(FOCUS, 15, "focus")                        \
    X(IRIS, 2, "iris")                           \
    X(MIDDLE, 2, "focus on the middle")          \
    X(LIGHT, 6, "light")                         \
    X(PAIR, 4, "pair")                           \
    X(MERGED, 4, "merged pair")                  \
    X(SURFACE, 10, "surface")

enum measure_phase {
#define MEASURE_PHASE_ENUM(name, seconds, text) MEASURE_##name,
    MEASURE_PHASE_LIST(MEASURE_PHASE_ENUM)
#undef MEASURE_PHASE_ENUM
        MEASURE_PHASES
};

/// Why a step is taken. X(name, text); each # is one of the reason's numbers.
#define MEASURE_WHY_LIST(X)                                                                       \
    X(NOT_READY, "the instrument is not up")                                                      \
    X(AHEAD, "the servos have not been set since the bring-up: both aim # mm ahead")              \
    X(FIND, "the widest view, to find the subject")                                               \
    X(WIDE_SHARP, "f/#: most depths are sharp at the widest zoom")                                \
    X(SEE, "so that its texture shows")                                                           \
    X(FOCUS_WIDE, "# mm by the calibration: sharp enough from half of that on")                   \
    X(FOCUS_COLD, "the distance is not known yet")                                                \
    X(FOCUS_LOST, "the wide view showed no surface")                                              \
    X(FOCUS_KNOWN, "# mm by the coarse surface")                                                  \
    X(FOCUS_SURFACE, "the surface has the subject at # mm, out of focus")                         \
    X(DISTANCE, "distance and depth of the subject")                                              \
    X(AIM, "the subject is at # mm, # mm to the right: it would leave the zoomed view")           \
    X(AIM_AGAIN, "the servos came to rest with only # % of the view around the subject")          \
    X(PAN_RESTS, "pan rests from here on, so that both zooms have the same cameras")              \
    X(ZOOM_FIT, "both see # mm at # mm: # px/mm^2, # mm per px of disparity")                     \
    X(ZOOM_DENSITY, "# px/mm^2 at # mm: both see # mm, # mm per px of disparity")                 \
    X(ZOOM_NEAREST, "the wish is out of reach; nearest to it both see # mm at # mm: # px/mm^2")   \
    X(ZOOM_FACTOR, "#x as requested: both see # mm, # px/mm^2")                                   \
    X(IRIS_NEEDED, "f/#: sharp from # to # mm")                                                   \
    X(IRIS_STEADY, "f/#: wider open, lamps would flicker; sharp from # to # mm")                  \
    X(IRIS_OPEN, "f/# is fully open: sharp from # to # mm")                                       \
    X(IRIS_DIFFRACTION, "f/#: closed further, diffraction would blur more; sharp from # to # mm") \
    X(IRIS_CLOSED, "f/# is as far as it closes: sharp from # to # mm only")                       \
    X(IRIS_LIGHT, "f/#: closed further, it would be too dark; sharp from # to # mm")              \
    X(FOCUS_NEAR, "expected at # mm")                                                             \
    X(FOCUS_AGAIN, "# mm, nearer to which the lenses did not come to rest")                       \
    X(FOCUS_CALIBRATED, "no focus was found: to # mm by the calibration")                         \
    X(LIGHT_KEEPS_IRIS, "exposure and gain only: the iris is for the depth")                      \
    X(LIGHT_OPENS_IRIS, "too dark at f/#: light before depth")                                    \
    X(TAKE, "the pair to measure")                                                                \
    X(AGAIN, "something moved during the last one")                                               \
    X(BRACKET, "# % of the subject is dark: # exposures")                                         \
    X(AVERAGE, "the mean of # frames has less noise")                                             \
    X(OTHER_ZOOM, "#x: a second zoom shows where the cameras point")                              \
    X(COMPUTE, "from # to # mm")                                                                  \
    X(COMPUTE_ALL, "all depths")                                                                  \
    X(COMPUTE_ALONE, "without the pair at the other zoom")

enum measure_why {
#define MEASURE_WHY_ENUM(name, text) MEASURE_WHY_##name,
    MEASURE_WHY_LIST(MEASURE_WHY_ENUM)
#undef MEASURE_WHY_ENUM
        MEASURE_WHYS
};

enum { MEASURE_NUMBERS = 4 };

struct measure_reason {
    enum measure_why why;
    double number[MEASURE_NUMBERS];
};

/// What a measurement lost on its way; bits 1 << these. X(name, text).
#define MEASURE_LOSS_LIST(X)                                                               \
    X(COARSE, "the wide view gave no surface: the distance is that of the focus")          \
    X(NOT_AIMED, "the cameras were not aimed")                                             \
    X(OFF_CENTRE, "the subject is not in the middle of both views")                        \
    X(OUT_OF_REACH, "the wish is out of reach of the calibrated zooms")                    \
    X(NOT_ZOOMED, "the zoom did not move")                                                 \
    X(NOT_SHARP, "not all of its depth is sharp")                                          \
    X(FOCUS_CALIBRATED, "no focus was found: the lenses are where the calibration has it") \
    X(NOT_EXPOSED, "the light could not be set: exposure and gain are as they were")       \
    X(DARK, "it is too dark")                                                              \
    X(ONE_EXPOSURE, "it was taken with one exposure only")                                 \
    X(UNLIKE, "most of both pictures does not match: see the notes")                       \
    X(MISFIT, "the cameras are not where the calibration has them")                        \
    X(ONE_ZOOM, "without a second zoom all depths share a larger error")                   \
    X(STOPPED, "the instrument stopped after the pair")

enum measure_loss {
#define MEASURE_LOSS_ENUM(name, text) MEASURE_LOSS_##name,
    MEASURE_LOSS_LIST(MEASURE_LOSS_ENUM)
#undef MEASURE_LOSS_ENUM
        MEASURE_LOSSES
};

// ---- what is wanted

enum measure_wish {
    MEASURE_WISH_SUBJECT,  ///< as the coarse surface shows it
    MEASURE_WISH_FIT,      ///< mm that both cameras see
    MEASURE_WISH_DENSITY,  ///< px/mm^2
    MEASURE_WISH_ZOOM,     ///< times the smallest calibrated focal length
};

struct measure_request {
    enum measure_wish wish;
    double value;            ///< of the wish
    bool has_place;          ///< elsewhere than in the middle; only the driver uses where:
    int place_px[2];         ///< in the picture that shows both cameras
    double near_mm, far_mm;  ///< depths of the subject; 0: not known
    bool quick;              ///< one look, one zoom
};

/// The instrument, as it is when the measurement begins.
struct measure_instrument {
    bool ready;
    struct zoom_state axes;                      ///< as in struct measure_event, if it is ready
    bool servos, zoom, focus, iris, exposure;    ///< parts that move
    bool brackets;                               ///< merges different exposures
    bool mosaic;                                 ///< its frames have one colour a pixel
    struct zoom_frames frames;                   ///< as the pairs have them
    const struct zoom_calibration *calibration;  ///< of all zooms; NULL: none
    double f_number_open, f_number_closed;       ///< 0: not known
    double exposure_max_us, gain_max;            ///< that pairs allow
    double steady_us;  ///< exposure times gain below which lamps flicker; 0: constant light
};

// ---- steps

enum measure_step_kind {
    MEASURE_STEP_BRINGUP,
    MEASURE_STEP_ZOOM,       ///< both lenses to `axes`' zoom
    MEASURE_STEP_IRIS,       ///< to `f_number`
    MEASURE_STEP_FOCUS,      ///< both lenses to `axes`' focus
    MEASURE_STEP_AUTOFOCUS,  ///< around `place_px`
    MEASURE_STEP_LIGHT,      ///< autoexposure around `place_px`
    MEASURE_STEP_AIM,        ///< both servos to `axes`' pan
    MEASURE_STEP_PAIR,       ///< with `bracket` or `average` frames
    MEASURE_STEP_LOOK,       ///< coarse surface of the last pair; finds the subject
    MEASURE_STEP_SURFACE,    ///< the surface of `pair`, with `with_pair`
    MEASURE_STEP_END
};

struct measure_step {
    enum measure_step_kind kind;
    enum measure_phase phase;
    struct zoom_state axes;
    double f_number;
    bool keep_iris;
    bool has_place;         ///< else the middle, or what the request asks for
    double place_px[2][2];  ///< where each camera has the subject, px of the whole sensor
    unsigned bracket, average;
    uint32_t pair, with_pair;  ///< numbers that events gave; 0: none
    double near_mm, far_mm;    ///< depths to search; 0 0: not known
    double scale;              ///< SURFACE: of the pictures that it is computed from
    struct measure_reason reason;
    double seconds, seconds_left;  ///< of this step; of those after it
};

/// What a step showed. Members of other kinds of step are not read.
struct measure_event {
    int error;    ///< 0, or why it failed
    bool lost;    ///< the instrument is not ready any more
    bool misfit;  ///< SURFACE: ADJUST_CALIBRATE of stereo/zoom/adjust_pair.h
    bool unlike;  ///< SURFACE: most of the pictures does not match, which the pictures explain
    /// Where the motors are: read, not commanded; pan as commanded. NAN: not known. After the
    /// bring-up and each step that moves, and of a pair.
    struct zoom_state axes;
    double f_number;  ///< of the iris after it; 0: not known
    struct {          // LIGHT
        double exposure_us, gain;
        double reached;  ///< mean over its target: below 1 it is too dark, also with an error
    } light;
    double focus_mm;  ///< AUTOFOCUS: the distance found by data sheet or calibration; 0: none
    struct {          // PAIR
        uint32_t number;
        double dark_part;  ///< of the subject, 0 .. 1
    } pair;
    struct {                               // LOOK
        double left_mm[3];                 ///< the subject's middle in the left camera's frame
        double right_px[2];                ///< where the right camera has it
        double near_mm, far_mm, width_mm;  ///< of the subject, left depth
    } subject;
    struct {                     // SURFACE
        bool with_used;          ///< the pair at the other zoom helped
        double depth_mm;         ///< median
        double near_mm, far_mm;  ///< of the subject; 0 0: not known
        double sigma_mm;         ///< median of the points
        double common_mm;        ///< that all points share; < 0: not known
        double share;            ///< of the subject that has points, 0 .. 1
        const char *hole;  ///< why most of the rest has none; NULL: there is little. Static storage
        /// `common_mm` as expected with a pair at another zoom, or with a board in view
        /// (zoom_expect_at); <= 0: not known.
        double other_mm, board_mm;
    } surface;
};

// ---- the measurement

/// What would make the next one better. X(name, text).
#define MEASURE_ADVICE_LIST(X)                                   \
    X(NOTHING, "")                                               \
    X(BOARD, "hold a board or a known length into the view")     \
    X(LIGHT, "add light")                                        \
    X(NEARER, "aim at something nearer")                         \
    X(TEXTURE, "give it texture")                                \
    X(STILL, "keep it still")                                    \
    X(AIM, "see that both cameras aim at it, unobstructed")      \
    X(CALIBRATE, "calibrate the instrument again")               \
    X(FREE, "free the lens that does not move")                  \
    X(SECOND_ZOOM,                                               \
      "measure without quick: a second zoom reduces the common " \
      "error")

enum measure_advice {
#define MEASURE_ADVICE_ENUM(name, text) MEASURE_ADVICE_##name,
    MEASURE_ADVICE_LIST(MEASURE_ADVICE_ENUM)
#undef MEASURE_ADVICE_ENUM
        MEASURE_ADVICES
};

struct measure_result {
    int error;                 ///< 0: there is a surface; ERROR_CANCELLED; else why there is none
    enum measure_phase phase;  ///< in which it ended
    uint32_t losses;           ///< bits 1 << enum measure_loss
    uint32_t pair, with_pair;  ///< numbers of those that were taken; 0: none
    double distance_mm;        ///< of the subject; of the surface if that is not known
    double sigma_mm, common_mm, share, depth_mm;  ///< of the surface; common < 0: not known
    const char *hole;                             ///< as the event's
    double density_per_mm2, width_mm;             ///< by the positions read; 0: not known
    double sharp_near_mm, sharp_far_mm;           ///< 0 0: not known
    enum measure_advice advice;
    double advised_mm;  ///< the common error with what is advised; <= 0: not known
};

/// A measurement. The caller owns it, and reads only `result`.
struct measure {
    struct measure_result result;
    struct measure_request request;
    struct measure_instrument instrument;
    enum measure_phase phase;
    struct zoom_state axes;  ///< as read last; pan corrected by what the pairs show
    bool pan_known;
    double pan_offset_rad[2];  ///< what the pairs show of where the servos rest
    bool subject_known;        ///< `point_mm`
    double point_mm[3];
    double distance_mm;                                   ///< 0: not known
    double near_mm, far_mm, width_mm;                     ///< of the subject; 0: not known
    double middle_mm;                                     ///< its middle's depth, as the two above
    double f_number;                                      ///< 0: not known
    double light_exposure_us, light_gain, light_reached;  ///< 0: not measured
    double light_f_number;                                ///< at which it was
    double dark_part;
    struct zoom_state pair_axes;   ///< of the pair to measure
    double pair_f_px, other_f_px;  ///< focal lengths of the pairs, left; 0: none
    uint32_t other_pair;           ///< the wide pair since pan rests, or a longer one; 0: none
    double other_factor;           ///< of the smallest focal length: the zoom that helps most
    unsigned tries;                ///< of this phase, after the first one
    unsigned aims;
    bool wide_searched;  ///< the wide view showed no surface, and its focus was searched
    double focus_wanted[2],
        focus_off[2];  ///< of the focus on the middle, counts: sum of its errors
    bool focus_missed, iris_opens;
    struct measure_result unfocused;  ///< before that
    bool refocused;                   ///< the surface showed the subject out of focus
    bool dark;                        ///< the light that was set last is far from its target
    bool jammed;                      ///< a lens did not move
    bool other_missed;                ///< the pair at another zoom failed
    bool alone;                       ///< the surface is computed without it
};

#ifdef __cplusplus
}
#endif

#endif
