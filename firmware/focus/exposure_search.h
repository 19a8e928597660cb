// SPDX-License-Identifier: Apache-2.0
/// Finds exposure, gain and iris: measurement in, next setting out. No camera and no waiting.
///
///     struct exposure_setting setting;
///     exposure_search_begin(&search, &limits, &target, &start, &setting);
///     do {
///         ... set the setting, measure ...
///         verdict = exposure_search_next(&search, &measure, real_us, &setting);
///     } while (verdict == EXPOSURE_GOING);
///
/// The wanted setting is the brightest at which the mean of green is at most the target, at most
/// 0.1 % is saturated and, with `white`, the brightest 1 % is at most at that level. What the
/// camera collects is proportional to exposure x gain, so one measurement that is neither saturated
/// nor black leads to it, and a second one confirms. A saturated measurement is only a bound: the
/// search then goes down by a factor from how the histogram falls off, up to 256.
///
/// Exposure comes first, in multiples of half the mains period where it is long enough for that,
/// then gain, and the iris last: it opens when the longest exposure with the largest gain is too
/// dark, and closes when the shortest exposure is too bright.
///
/// Measured with a sensor model of its own (VERGENCE_DRAWS=100000 exposure_search_test, seed
/// 20090915: random starts, scenes, 6 decades of light, 6 % of flicker, irises that differ from
/// what is assumed by up to 2.5): 3 measurements (p50), 6 (p99), 8 at most, the confirming one
/// included; no setting twice. Those that end by their mean are off by 0.2 % (p50), 1.4 %
/// (p99), 2.5 % at most where the steps of exposure and gain allow it; those that end by their
/// highlights are 4 % (p50), 10 % (p99) below the brightest setting that is possible.
#ifndef VERGENCE_FOCUS_EXPOSURE_SEARCH_H
#define VERGENCE_FOCUS_EXPOSURE_SEARCH_H

#include <stdbool.h>
#include <stdint.h>

#include "focus/exposure_measure.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Measurements until a search ends with EXPOSURE_UNSTEADY.
enum { EXPOSURE_STEPS_MAX = 8 };

/// What a camera can be set to. Exposures are rows * row_ns - overhead_ns.
struct exposure_limits {
    uint32_t row_ns, overhead_ns;
    uint32_t min_us, max_us;            ///< min_us >= 1 row
    uint32_t mains_half_us;             ///< half of the mains period; 0: the light is constant
    uint16_t gain_min_q3, gain_max_q3;  ///< range in steps of 1, above 32 in steps of 2
    int32_t iris_closed, iris_open;     ///< counts; equal: the iris has no motor
    double iris_range;                  ///< open over closed, in light; 0: not known
    bool linear;                        ///< values are proportional to light
};

struct exposure_target {
    double mean;   ///< mean of green, as a part of the range above black: 0.01 .. 0.9
    double white;  ///< highest level of the brightest 1 %; 0: no such limit
};

struct exposure_setting {
    uint32_t exposure_us;
    uint16_t gain_q3;
    int32_t iris;
};

enum exposure_verdict {
    EXPOSURE_GOING,
    EXPOSURE_FOUND,
    EXPOSURE_TOO_DARK,    ///< even at the longest exposure, the largest gain and the open iris
    EXPOSURE_TOO_BRIGHT,  ///< even at the shortest exposure, the smallest gain and the closed iris
    EXPOSURE_UNSTEADY,    ///< the light changes from measurement to measurement
};

/// What keeps a picture from being brighter.
enum exposure_bound { EXPOSURE_BY_MEAN, EXPOSURE_BY_HIGHLIGHTS, EXPOSURE_BY_WHITES };

/// A search under way. The caller owns it, and reads only `steps`, `bound`, `measure`.
struct exposure_search {
    unsigned steps;                   ///< measurements so far
    enum exposure_bound bound;        ///< bound of the last measurement, or that of the result
    struct exposure_measure measure;  ///< the last one, or that of the result
    struct exposure_limits limits;
    struct exposure_target target;
    struct exposure_setting tried[EXPOSURE_STEPS_MAX];  ///< the last one is in force
    double exponent;   ///< exponent of the camera's response: 1 is linear
    double iris_log;   ///< logarithm of light per count
    bool iris_closed;  ///< this search closed the iris on a guess
    /// Exposure x gain, at the present iris: the smallest that was saturated, the largest that was
    /// not; 0: none.
    double saturated_us, dark_us;
    /// The last good measurement, for learning; product 0: none.
    struct {
        double product_us, mean;
        int32_t iris;
    } last;
    /// The best one: its setting is tried[step].
    struct {
        unsigned step;
        double off;  ///< logarithm of the factor that is missing; below 0: none
        enum exposure_bound bound;
        struct exposure_measure measure;
    } best;
};

/// Whether an exposure is so much shorter than half a period of the mains that lamps flicker in it.
/// Never where that is 0: the light is constant.
bool exposure_is_below_mains(double half_us, double time_us);

/// The setting for an exposure x gain in us: exact within the steps of exposure and gain, with the
/// smallest gain that allows it. Beyond the limits the nearest. `iris` is unchanged. A camera that
/// is not linear has gains of a scale of its own: it gets only as much as is needed.
void exposure_setting_for(const struct exposure_limits *limits, double product_us,
                          struct exposure_setting *setting);

/// The setting for an exposure x gain in us that differs least from `like`, of a camera that is to
/// be as bright as another one: its gain if possible, at most twice that.
void exposure_setting_like(const struct exposure_limits *limits, double product_us,
                           const struct exposure_setting *like, struct exposure_setting *setting);

/// Begins. `first` is `start` within the limits: to be set and measured.
void exposure_search_begin(struct exposure_search *self, const struct exposure_limits *limits,
                           const struct exposure_target *target,
                           const struct exposure_setting *start, struct exposure_setting *first);

/// The camera has accepted only this exposure in place of that of the last setting: nearest is a
/// limit of its range if `is_limit`, else a step of its own.
void exposure_search_adapt(struct exposure_search *self, uint32_t nearest_us, bool is_limit);
/// The same for its gain.
void exposure_search_adapt_gain(struct exposure_search *self, uint16_t nearest_q3);

/// Takes what was measured with the last setting. `real_us`: the exposure that the frames had,
/// which may differ a little from the setting. EXPOSURE_GOING: `setting` is to be measured next,
/// else it is the result: the last one, or an earlier one. No setting is measured twice.
enum exposure_verdict exposure_search_next(struct exposure_search *self,
                                           const struct exposure_measure *measure, double real_us,
                                           struct exposure_setting *setting);

#ifdef __cplusplus
}
#endif

#endif
