// SPDX-License-Identifier: Apache-2.0
/// The types of focus_search.h.
#ifndef VERGENCE_FOCUS_FOCUS_SEARCH_TYPES_H
#define VERGENCE_FOCUS_FOCUS_SEARCH_TYPES_H

#include "focus/focus_curve.h"
#include "focus/focus_stop.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { FOCUS_TRIES = 4 };

// X(name, text, help)
#define FOCUS_VERDICT_LIST(X)                                                                  \
    X(PENDING, "not known", "")                                                                \
    X(FOCUSED, "focused", "")                                                                  \
    X(SHARP_EVERYWHERE, "sharp everywhere",                                                    \
      "the focus hardly changes the picture: for a more exact distance zoom in or open "       \
      "the iris")                                                                              \
    X(NO_CONTRAST, "no contrast",                                                              \
      "choose a region with texture, add light, remove the lens cap, or move a subject that "  \
      "is too near away")                                                                      \
    X(PEAK_AT_END, "peak at end of range",                                                     \
      "the subject is nearer or farther than the lens can focus: move it, or zoom out")        \
    X(TWO_PEAKS, "two peaks",                                                                  \
      "the region shows two distances: choose with prefer=near or prefer=far, or a smaller "   \
      "region")                                                                                \
    X(LIGHTS, "misled by lights",                                                              \
      "lights in or beside the region outshine it out of focus: choose a region away from "    \
      "them, shorten the exposure until they are not white, or focus by hand")                 \
    X(SCENE_CHANGED, "scene changed", "keep subject, cameras and light still, then try again") \
    X(LENS_JAMMED, "lens jammed", "free the ring, then run bringup")

enum focus_verdict {
#define FOCUS_VERDICT_ENUM(name, text, help) FOCUS_##name,
    FOCUS_VERDICT_LIST(FOCUS_VERDICT_ENUM)
#undef FOCUS_VERDICT_ENUM
        FOCUS_VERDICTS
};

/// Of two peaks.
enum focus_choice { FOCUS_STRONGER, FOCUS_NEARER, FOCUS_FARTHER };

/// What is known before. Positions in counts; larger ones are nearer.
struct focus_search_options {
    double min, max;             ///< range of the ring, min < max
    bool from_above;             ///< side of approach
    double run_up;               ///< counts by which an approach overshoots; >= 0
    double tolerance;            ///< largest distance of the ring from its target, counts; > 0
    double blur_per_count_px;    ///< diameter of the blur that one count makes; 0: not known
    double counts_per_frame;     ///< movement of the ring between two frames at full speed; > 0
    double counts_per_exposure;  ///< movement of the ring during an exposure
    double noise_ratio;          ///< variance of the noise in the search over that of the
                                 ///< settings before it (higher gain); >= 1
    double region_px;            ///< smaller side of the region
    double expected, expected_half_range;  ///< range of the expected peak; half range 0: not known
    enum focus_measure measure;            ///< measure of FOCUS_CHANNEL_CHOSEN
    enum focus_choice choice;
    bool curve_only;  ///< sweep, then return to where the ring was
};

enum focus_step_kind {
    FOCUS_STEP_GO,        ///< move to `position`; frames are not needed
    FOCUS_STEP_SWEEP,     ///< move to `position`, with a frame every `spacing` counts
    FOCUS_STEP_APPROACH,  ///< move to `position` exactly, from the side of approach, also if it is
                          ///< there already; frames are not needed
    FOCUS_STEP_LOOK,      ///< take `frames` frames at rest
    FOCUS_STEP_END
};

struct focus_step {
    enum focus_step_kind kind;
    enum focus_leg leg;  ///< leg that the frames belong to
    double position, spacing;
    unsigned frames;
    bool slow;  ///< exposure and gain are those before the search, whose noise is less
};

/// What a finished step led to.
struct focus_event {
    double position, deviation;  ///< position of the ring at rest and its sigma, counts
    bool jammed;
};

struct focus_result {
    enum focus_verdict verdict;
    double position;                 ///< final position of the ring
    double blur_px;                  ///< remaining diameter of the blur; < 0: not known
    double blur_counts;              ///< the same as a distance from the peak
    struct focus_peak peak, second;  ///< second.height 0: none
    unsigned tries, frames;
    bool light_changed;  ///< the light changed by more than a tenth; it was divided out
};

struct focus_search {
    struct focus_search_options options;
    struct focus_curve curve;
    struct focus_result result;
    enum focus_search_phase {
        FOCUS_SEARCH_TO_START,
        FOCUS_SEARCH_SWEEP,
        FOCUS_SEARCH_TO_PASS,
        FOCUS_SEARCH_PASS,
        FOCUS_SEARCH_STOP,
        FOCUS_SEARCH_STOP_LOOK,
        FOCUS_SEARCH_APPROACH,
        FOCUS_SEARCH_LOOK,
        FOCUS_SEARCH_RETURN,
        FOCUS_SEARCH_END
    } phase;
    double begin;                   ///< position at the start
    double sweep_end, spacing;      ///< end and spacing of the present sweep
    bool near_only;                 ///< the sweep covers the expected neighbourhood only
    double target;                  ///< target of the present approach
    enum focus_channel finder;      ///< channel that the peak is sought in
    enum focus_channel channel;     ///< channel that decides where the top is
    double floors[FOCUS_CHANNELS];  ///< floors of the sweep
    double noises[FOCUS_CHANNELS];
    double pass_min, pass_max;
    unsigned passes, stops;
    uint16_t step_begin;  ///< samples before this step
    struct focus_stop_sample stop_samples[FOCUS_TRIES];
    double off_sum;  ///< sum of the tries' distances from their targets
    bool slow;       ///< the sweep's noise hid a peak: looked at again
    bool wide;       ///< a picture at rest does not show how far it is
    bool guessed;    ///< it is wide, and was not seen in the sweep
};

#ifdef __cplusplus
}
#endif

#endif
