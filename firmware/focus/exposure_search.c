// SPDX-License-Identifier: Apache-2.0
#include "focus/exposure_search.h"

#include "core/invariant.h"
#include "core/math.h"

enum {
    GAIN_ONE_Q3 = 8,
    GAIN_FINE_MAX_Q3 = 32,  // above, gains have steps of 2
    COMFORTABLE_ROWS = 32,  // steps of 3 %; where an exposure should be after the iris has closed
    FAR_ROWS = 4 * COMFORTABLE_ROWS,
};

// Saturation begins at 63/64; the noise of bright values needs room below.
static const double high_goal = 0.95;
// Settings within this are as good as exact; those limited by their brightest 0.1 %, which are few
// and noisy, if they are not further below.
static const double close_enough = 0.02, high_close_enough = 0.05;
static const double exact_enough = 0.01, equal_enough = 0.004;
// The best of all measurements is a result if it is not further off; and if brighter ones were
// saturated, so that the light is steady, if it is not further than this.
static const double usable = 0.1, usable_if_steady = 0.5;
// Off a multiple of half a mains period by this, a flicker of 6 % is one of 0.4 %.
static const double mains_slack = 1.0 / 16;
// Below this a mean is as much offset as light: the next setting is only a guess.
static const double mean_min = 0.001, mean_good = 0.004;
// Of an iris that is not known: f/1.6 to f/16 over its travel.
static const double default_iris_range = 100;
static const double iris_margin = 1.25;
// After a move the light is uncertain by this much, and rather too dark.
static const double iris_caution = 0.5;

static double gain_of(uint16_t gain_q3) {
    return (double)gain_q3 / GAIN_ONE_Q3;
}

static double absolute(double x) {
    return x < 0 ? -x : x;
}

static bool is_close(double a, double b, double part) {
    return absolute(a - b) <= part * b;
}

static double product_max(const struct exposure_limits *limits) {
    return limits->max_us * gain_of(limits->gain_max_q3);
}

static double product_min(const struct exposure_limits *limits) {
    return limits->min_us * gain_of(limits->gain_min_q3);
}

static double exposure_of_rows(const struct exposure_limits *limits, double rows) {
    return (rows * limits->row_ns - limits->overhead_ns) / 1000;
}

// The possible exposure nearest to a time.
static double quantized(const struct exposure_limits *limits, double time_us) {
    const double rows =
        (double)(int64_t)((time_us * 1000 + limits->overhead_ns) / limits->row_ns + 0.5);
    const double exposure_us = exposure_of_rows(limits, rows);
    return exposure_us < limits->min_us ? limits->min_us : exposure_us;
}

bool exposure_is_below_mains(double half_us, double time_us) {
    return time_us < half_us * (1 - mains_slack);
}

// Whether lamps on the mains do not flicker in an exposure, or cannot be kept from that.
static bool is_flicker_free(const struct exposure_limits *limits, double time_us) {
    const double half_us = limits->mains_half_us;
    if (half_us == 0 || exposure_is_below_mains(half_us, time_us)) {
        return half_us == 0;
    }
    const double periods = (double)(int64_t)(time_us / half_us + 0.5);
    return is_close(time_us, periods * half_us, mains_slack);
}

// The exposure for this gain, and how far exposure x gain is off then.
static double exposure_at(const struct exposure_limits *limits, double product_us, double gain,
                          double *off) {
    const double time_us = product_us / gain;
    const double possible_us =
        quantized(limits, time_us < limits->max_us ? time_us : limits->max_us);
    *off = absolute(possible_us / time_us - 1);
    return possible_us;
}

static unsigned next_gain(unsigned gain_q3) {
    return gain_q3 + (gain_q3 < GAIN_FINE_MAX_Q3 ? 1 : 2);
}

// The smallest gain at which no exposure beyond the longest is needed.
static unsigned least_gain(const struct exposure_limits *limits, double product_us) {
    unsigned gain_q3 = limits->gain_min_q3;
    while (next_gain(gain_q3) <= limits->gain_max_q3 &&
           product_us / gain_of((uint16_t)gain_q3) > limits->max_us * (1 + exact_enough)) {
        gain_q3 = next_gain(gain_q3);
    }
    return gain_q3;
}

void exposure_setting_for(const struct exposure_limits *limits, double product_us,
                          struct exposure_setting *setting) {
    const double wanted_us = math_clamp(product_us, product_min(limits), product_max(limits));
    const bool can_avoid_flicker =
        !exposure_is_below_mains(limits->mains_half_us, wanted_us / gain_of(limits->gain_min_q3));
    const unsigned first_q3 = least_gain(limits, wanted_us);
    // Up to twice the gain that is needed, if it is known what a gain does.
    const unsigned last_q3 = limits->linear ? 2 * first_q3 : first_q3;
    double least = -1;
    bool good = false;
    for (unsigned gain_q3 = first_q3; !good && gain_q3 <= limits->gain_max_q3 && gain_q3 <= last_q3;
         gain_q3 = next_gain(gain_q3)) {
        const double gain = gain_of((uint16_t)gain_q3);
        double off = 0;
        const double possible_us = exposure_at(limits, wanted_us, gain, &off);
        good = off <= exact_enough &&
               (!can_avoid_flicker || is_flicker_free(limits, wanted_us / gain));
        if (good || least < 0 || off < least - exact_enough / 2) {
            least = off;
            setting->exposure_us = (uint32_t)(possible_us + 0.5);
            setting->gain_q3 = (uint16_t)gain_q3;
        }
    }
    INVARIANT(least >= 0 && setting->gain_q3 >= limits->gain_min_q3);
}

void exposure_setting_like(const struct exposure_limits *limits, double product_us,
                           const struct exposure_setting *like, struct exposure_setting *setting) {
    const double wanted_us = math_clamp(product_us, product_min(limits), product_max(limits));
    const unsigned first_q3 = least_gain(limits, wanted_us);
    double least = -1;
    setting->iris = like->iris;
    if (like->gain_q3 >= first_q3) {
        setting->gain_q3 = like->gain_q3;
        setting->exposure_us =
            (uint32_t)(exposure_at(limits, wanted_us, gain_of(like->gain_q3), &least) + 0.5);
    }
    unsigned factor = least < 0 ? 1 : 0;
    if (limits->linear) {
        factor = 2;
    }
    const unsigned last_q3 = factor * (like->gain_q3 > first_q3 ? like->gain_q3 : first_q3);
    for (unsigned gain_q3 = first_q3; (least < 0 || least > equal_enough) &&
                                      gain_q3 <= limits->gain_max_q3 && gain_q3 <= last_q3;
         gain_q3 = next_gain(gain_q3)) {
        double off = 0;
        const double possible_us = exposure_at(limits, wanted_us, gain_of((uint16_t)gain_q3), &off);
        if (least < 0 || off < least) {
            least = off;
            setting->exposure_us = (uint32_t)(possible_us + 0.5);
            setting->gain_q3 = (uint16_t)gain_q3;
        }
    }
    INVARIANT(least >= 0);
}

static int32_t within(int32_t value, int32_t a, int32_t b) {
    const int32_t min = a < b ? a : b, max = a < b ? b : a;
    return math_clamp_int(value, min, max);
}

static bool is_same(const struct exposure_setting *a, const struct exposure_setting *b) {
    return a->exposure_us == b->exposure_us && a->gain_q3 == b->gain_q3 && a->iris == b->iris;
}

static double product_of(const struct exposure_setting *setting) {
    return setting->exposure_us * gain_of(setting->gain_q3);
}

// Whether exposure and gain of the setting are those that would be chosen for their product.
static bool is_chosen(const struct exposure_limits *limits,
                      const struct exposure_setting *setting) {
    struct exposure_setting chosen = *setting;
    exposure_setting_for(limits, product_of(setting), &chosen);
    return chosen.gain_q3 == setting->gain_q3;
}

void exposure_search_begin(struct exposure_search *self, const struct exposure_limits *limits,
                           const struct exposure_target *target,
                           const struct exposure_setting *start, struct exposure_setting *first) {
    INVARIANT(limits->row_ns > 0 && limits->min_us > 0 && limits->max_us >= limits->min_us);
    INVARIANT(limits->gain_min_q3 > 0 && limits->gain_max_q3 >= limits->gain_min_q3);
    INVARIANT(target->mean > 0 && target->mean < 1 && target->white >= 0);
    *self = (struct exposure_search){.limits = *limits, .target = *target, .exponent = 1};
    self->best.off = -1;
    const int32_t travel = limits->iris_open - limits->iris_closed;
    if (self->limits.iris_range <= 1) {
        self->limits.iris_range = default_iris_range;
    }
    self->iris_log = travel != 0 ? math_log(self->limits.iris_range) / travel : 0;
    const double exposure_us = math_clamp(start->exposure_us, limits->min_us, limits->max_us);
    self->tried[0] = (struct exposure_setting){
        .exposure_us = (uint32_t)(quantized(limits, exposure_us) + 0.5),
        .gain_q3 = (uint16_t)within(start->gain_q3, limits->gain_min_q3, limits->gain_max_q3),
        .iris = within(start->iris, limits->iris_closed, limits->iris_open),
    };
    *first = self->tried[0];
}

void exposure_search_adapt(struct exposure_search *self, uint32_t nearest_us, bool is_limit) {
    struct exposure_setting *now = &self->tried[self->steps];
    INVARIANT(nearest_us > 0);
    if (is_limit && nearest_us < now->exposure_us) {
        self->limits.max_us = nearest_us;
        self->limits.min_us = nearest_us < self->limits.min_us ? nearest_us : self->limits.min_us;
    } else if (is_limit) {
        self->limits.min_us = nearest_us;
        self->limits.max_us = nearest_us > self->limits.max_us ? nearest_us : self->limits.max_us;
    }
    now->exposure_us = nearest_us;
}

void exposure_search_adapt_gain(struct exposure_search *self, uint16_t nearest_q3) {
    INVARIANT(nearest_q3 > 0);
    self->tried[self->steps].gain_q3 = nearest_q3;
}

static bool is_saturated(const struct exposure_search *self) {
    return self->measure.saturated > EXPOSURE_SATURATED_MAX;
}

// Whether the measurement is only a bound.
static bool is_guess(const struct exposure_search *self) {
    return is_saturated(self) || self->measure.mean < mean_good;
}

// By which factor the light should change; sets the bound that decides that.
static double factor_of(struct exposure_search *self) {
    const struct exposure_measure *m = &self->measure;
    const double mean = m->mean > mean_min ? m->mean : mean_min;
    const double high = is_saturated(self) ? m->excess : m->high;
    double factor = self->target.mean / mean;
    self->bound = EXPOSURE_BY_MEAN;
    if (high * factor > high_goal) {
        factor = high_goal / high;
        self->bound = EXPOSURE_BY_HIGHLIGHTS;
    }
    if (self->target.white > 0 && m->white * factor > self->target.white) {
        factor = self->target.white / m->white;
        self->bound = EXPOSURE_BY_WHITES;
    }
    return factor;
}

static void learn_iris(struct exposure_search *self, double log_light, double moved) {
    const double assumed =
        math_log(self->limits.iris_range) / (self->limits.iris_open - self->limits.iris_closed);
    const double ratio = log_light / moved / assumed;
    if (ratio > 0.25 && ratio < 4) {
        self->iris_log = ratio * assumed;
    }
}

static void learn_response(struct exposure_search *self, double log_mean, double log_product) {
    const double exponent = log_mean / log_product;
    if (exponent > 0.2 && exponent < 1.5) {
        self->exponent = exponent;
    }
}

// Learns from two good measurements how the camera or the iris responds.
static void learn(struct exposure_search *self, const struct exposure_setting *now,
                  double product_us) {
    const double mean = self->measure.mean;
    if (is_guess(self)) {
        return;
    }
    if (self->last.product_us > 0) {
        const double log_mean = math_log(mean / self->last.mean);
        const double log_product = math_log(product_us / self->last.product_us);
        const int32_t moved = now->iris - self->last.iris;
        if (moved != 0 && self->limits.linear) {
            learn_iris(self, log_mean - log_product, moved);
        } else if (moved == 0 && !self->limits.linear && absolute(log_product) > 0.2) {
            learn_response(self, log_mean, log_product);
        }
    }
    self->last.product_us = product_us;
    self->last.mean = mean;
    self->last.iris = now->iris;
}

// Narrows the range of exposure x gain, and keeps the best.
static void record(struct exposure_search *self, const struct exposure_setting *now,
                   double product_us, double wanted_us) {
    const bool saturated = is_saturated(self);
    if (saturated && (self->saturated_us == 0 || product_us < self->saturated_us)) {
        self->saturated_us = product_us;
    }
    if (saturated) {
        return;
    }
    self->dark_us = product_us > self->dark_us ? product_us : self->dark_us;
    const double off = absolute(math_log(wanted_us / product_of(now)));
    if (self->best.off < 0 || off < self->best.off) {
        self->best.step = self->steps - 1;
        self->best.off = off;
        self->best.bound = self->bound;
        self->best.measure = self->measure;
    }
}

// Stays between what was saturated and what was not.
static double between(const struct exposure_search *self, double product_us, double wanted_us) {
    const double high_us = self->saturated_us, low_us = self->dark_us;
    INVARIANT(product_us > 0 && wanted_us > 0);
    if (is_saturated(self) && low_us > 0 && low_us < product_us && wanted_us < low_us) {
        return low_us * math_exp(math_log(product_us / low_us) / 4);
    }
    if (high_us > product_us && wanted_us >= high_us) {
        return product_us * math_exp(math_log(high_us / product_us) / 2);
    }
    return wanted_us;
}

// Moves the iris so that the light changes by a factor. Returns the factor that is expected.
static double move_iris(struct exposure_search *self, struct exposure_setting *setting,
                        double factor) {
    const struct exposure_limits *limits = &self->limits;
    const int32_t travel = limits->iris_open - limits->iris_closed;
    const double most = absolute((double)travel), counts = math_log(factor) / self->iris_log;
    const int32_t by = (int32_t)math_clamp(counts, -most, most);
    const int32_t before = setting->iris;
    setting->iris = within(before + by, limits->iris_closed, limits->iris_open);
    self->saturated_us = self->dark_us = 0;
    return math_exp(self->iris_log * (setting->iris - before));
}

// An exposure with fine steps, for after the iris has closed.
static double comfortable(const struct exposure_search *self, int rows) {
    return exposure_of_rows(&self->limits, rows) * gain_of(self->limits.gain_min_q3);
}

// Too dark at the largest exposure x gain, so that the iris opens. Guesses first go to that limit.
static bool is_iris_too_small(const struct exposure_search *self, int32_t iris, double asked_us,
                              double wanted_us) {
    const double max_us = product_max(&self->limits);
    return iris != self->limits.iris_open && wanted_us > max_us * (1 + close_enough) &&
           (!is_guess(self) || asked_us >= max_us * (1 - close_enough));
}

static bool is_iris_too_large(const struct exposure_search *self, int32_t iris, double asked_us,
                              double wanted_us) {
    const double min_us = product_min(&self->limits);
    return iris != self->limits.iris_closed && wanted_us < min_us * (1 - close_enough) &&
           (!is_guess(self) || asked_us <= min_us * (1 + close_enough));
}

// The exposure x gain to try next, after moving the iris if nothing else is left.
static double next_product(struct exposure_search *self, struct exposure_setting *setting,
                           double asked_us, double wanted_us) {
    const double fine_us = comfortable(self, COMFORTABLE_ROWS);
    if (is_iris_too_small(self, setting->iris, asked_us, wanted_us)) {
        const double factor = wanted_us / product_max(&self->limits) * iris_margin;
        return iris_caution * wanted_us / move_iris(self, setting, factor);
    }
    if (is_iris_too_large(self, setting->iris, asked_us, wanted_us)) {
        self->iris_closed = true;
        return iris_caution * wanted_us / move_iris(self, setting, wanted_us / fine_us);
    }
    if (self->iris_closed && !is_guess(self) && wanted_us > comfortable(self, FAR_ROWS)) {
        // It was closed further than needed.
        self->iris_closed = false;
        return iris_caution * wanted_us / move_iris(self, setting, wanted_us / fine_us);
    }
    return wanted_us;
}

static bool was_tried(const struct exposure_search *self, const struct exposure_setting *setting) {
    bool tried = false;
    for (unsigned i = 0; i < self->steps && !tried; i++) {
        tried = is_same(&self->tried[i], setting);
    }
    return tried;
}

static bool is_found(const struct exposure_search *self, const struct exposure_setting *now,
                     double wanted_us) {
    if (is_saturated(self) || (self->steps == 1 && !is_chosen(&self->limits, now))) {
        return false;
    }
    const double off = wanted_us / product_of(now) - 1;
    const double up = self->bound == EXPOSURE_BY_HIGHLIGHTS ? high_close_enough : close_enough;
    // Not saturated, though brighter than the goal: as good.
    const double down = self->bound == EXPOSURE_BY_HIGHLIGHTS ? 1 : close_enough;
    return off <= up && off >= -down;
}

// Whether the best measurement so far can be the result. Where it is not known what a gain does,
// light may be steady although the search did not settle.
static bool is_usable(const struct exposure_search *self) {
    const bool steady =
        !self->limits.linear || (self->dark_us > 0 && self->saturated_us > self->dark_us);
    return self->best.off >= 0 && self->best.off <= (steady ? usable_if_steady : usable);
}

// Why there is no result.
static enum exposure_verdict failure_of(const struct exposure_search *self, double asked_us,
                                        double wanted_us) {
    const double min_us = product_min(&self->limits), max_us = product_max(&self->limits);
    const bool at_min = asked_us <= min_us * (1 + usable);
    if (wanted_us < min_us * (1 - usable) || (is_saturated(self) && at_min)) {
        return EXPOSURE_TOO_BRIGHT;
    }
    return wanted_us > max_us * (1 + usable) ? EXPOSURE_TOO_DARK : EXPOSURE_UNSTEADY;
}

// Nothing new is left to try: at a limit, between two steps, or after too many changes of the
// light.
static enum exposure_verdict end(struct exposure_search *self, double asked_us, double wanted_us,
                                 struct exposure_setting *setting) {
    const enum exposure_verdict failure = failure_of(self, asked_us, wanted_us);
    const bool between_steps =
        failure == EXPOSURE_UNSTEADY && self->best.off >= 0 && self->steps < EXPOSURE_STEPS_MAX;
    if (!is_usable(self) && !between_steps) {
        return failure;
    }
    self->bound = self->best.bound;
    self->measure = self->best.measure;
    *setting = self->tried[self->best.step];
    return EXPOSURE_FOUND;
}

enum exposure_verdict exposure_search_next(struct exposure_search *self,
                                           const struct exposure_measure *measure, double real_us,
                                           struct exposure_setting *setting) {
    INVARIANT(self->steps < EXPOSURE_STEPS_MAX && real_us > 0);
    const struct exposure_setting now = self->tried[self->steps];
    const double product_us = real_us * gain_of(now.gain_q3);
    self->steps++;
    self->measure = *measure;
    learn(self, &now, product_us);
    double factor = factor_of(self);
    if (self->exponent != 1) {
        factor = math_exp(math_log(factor) / self->exponent);
    }
    record(self, &now, product_us, product_us * factor);
    const double wanted_us = between(self, product_us, product_us * factor);
    *setting = now;
    if (is_found(self, &now, wanted_us)) {
        return EXPOSURE_FOUND;
    }
    struct exposure_setting next = now;
    exposure_setting_for(&self->limits, next_product(self, &next, product_of(&now), wanted_us),
                         &next);
    if (was_tried(self, &next) || self->steps == EXPOSURE_STEPS_MAX) {
        return end(self, product_of(&now), wanted_us, setting);
    }
    self->tried[self->steps] = next;
    *setting = next;
    return EXPOSURE_GOING;
}
