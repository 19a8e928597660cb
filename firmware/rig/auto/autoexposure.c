// SPDX-License-Identifier: Apache-2.0
#include "rig/auto/autoexposure.h"

#include "core/error.h"
#include "core/invariant.h"
#include "rig/auto/exposure_camera.h"
#include "rig/base/rig_error.h"
#include "rig/rig_camera.h"
#include "rig/safe.h"

enum {
    US_PER_MS = 1000,
    START_US = 10000,
    MATCHES_MAX = 3,
    IRIS_NEAR_COUNTS = 10,
};

static const double white_max = 0.8;
// A picture that is too dark at the limits is accepted with this part of the target.
static const double usable_part = 0.125;
// Brightness of the cameras is compared as closely as the noise of a measurement allows.
static const double difference_max = 0.004;
static const double room_for_right = 1.03;

// ---- one camera

static int too_dark(struct exposure_job *job, unsigned side,
                    const struct exposure_setting *setting) {
    // There is nothing to open where the iris was opened, or was kept and is open.
    const int32_t open = job->rig->profile.lens.axis[LENS_IRIS].max - IRIS_NEAR_COUNTS;
    const bool iris =
        exposure_has_iris(job, side) && (!job->keep_iris || job->before[side].iris >= open);
    return rig_reject(
        job->rig, rig_part_of(RIG_PART_LEFT_CAMERA, side), ERROR_RANGE,
        iris ? "too dark at the longest exposure of # ms, gain # and open iris (add "
               "light, or take the cap off the lens)"
             : "too dark at the longest exposure of # ms and gain # (add light, open "
               "the iris, or take the cap off the lens)",
        (const int32_t[]){(int32_t)(setting->exposure_us / US_PER_MS), setting->gain_q3 / 8});
}

static int too_bright(struct exposure_job *job, unsigned side,
                      const struct exposure_setting *setting) {
    const bool iris = exposure_has_iris(job, side) && !job->keep_iris;
    return rig_reject(job->rig, rig_part_of(RIG_PART_LEFT_CAMERA, side), ERROR_RANGE,
                      iris
                          ? "too bright at the shortest exposure of # us and closed iris (use less "
                            "light, a region without lamps, or a grey filter)"
                          : "too bright at the shortest exposure of # us (use less light, close "
                            "the iris, or choose a region without lamps)",
                      (const int32_t[]){(int32_t)setting->exposure_us});
}

// The error of a verdict; not one for a picture that can be used.
static int judge(struct exposure_job *job, unsigned side, enum exposure_verdict verdict,
                 const struct exposure_light *light, const struct exposure_setting *setting) {
    const struct exposure_measure *m = &light->measure;
    switch (verdict) {
        case EXPOSURE_TOO_DARK:
            return m->mean >= usable_part * job->target.mean ? ERROR_OK
                                                             : too_dark(job, side, setting);
        case EXPOSURE_TOO_BRIGHT:
            return m->saturated <= EXPOSURE_SATURATED_MAX ? ERROR_OK
                                                          : too_bright(job, side, setting);
        case EXPOSURE_UNSTEADY:
            return rig_reject(job->rig, rig_part_of(RIG_PART_LEFT_CAMERA, side), ERROR_MOVED,
                              "the light changes from frame to frame (keep light and scene "
                              "constant, then again)",
                              NULL);
        case EXPOSURE_FOUND:
        case EXPOSURE_GOING:
            break;
    }
    return ERROR_OK;
}

static int search(struct exposure_job *job, struct rig_region *region,
                  const struct exposure_limits *limits, const struct exposure_setting *start,
                  struct exposure_setting *setting, struct exposure_light *light,
                  struct rig_autoexposure_side *out) {
    struct exposure_search state;
    enum exposure_verdict verdict = EXPOSURE_GOING;
    exposure_search_begin(&state, limits, &job->target, start, setting);
    while (verdict == EXPOSURE_GOING) {
        int error = exposure_region_set(job, region, setting, &state);
        if (error == ERROR_OK) {
            error = exposure_region_measure(job, region, setting, light);
        }
        if (error != ERROR_OK) {
            return error;
        }
        verdict = exposure_search_next(&state, &light->measure, light->exposure_us, setting);
    }
    INVARIANT(state.steps <= EXPOSURE_STEPS_MAX);
    const struct exposure_setting *last = &state.tried[state.steps - 1];
    if (setting->exposure_us != last->exposure_us || setting->gain_q3 != last->gain_q3 ||
        setting->iris != last->iris) {
        // An earlier one was better.
        int error = exposure_region_set(job, region, setting, NULL);
        if (error != ERROR_OK) {
            return error;
        }
        error = exposure_region_measure(job, region, setting, light);
        if (error != ERROR_OK) {
            return error;
        }
    }
    out->steps = state.steps;
    out->bound = state.bound;
    out->verdict = verdict;
    return judge(job, region->side, verdict, light, setting);
}

// The result of a side for a setting near the measured one.
static void set_result(struct exposure_job *job, unsigned side,
                       const struct exposure_setting *setting, const struct exposure_light *light,
                       struct rig_autoexposure_side *out) {
    out->exposure_us = setting->exposure_us;
    out->gain_q3 = setting->gain_q3;
    out->iris = job->iris_moved ? job->iris : job->before[side].iris;
    if (!exposure_has_iris(job, side)) {
        out->iris = INT32_MIN;
    }
    out->mean = light->measure.mean * (exposure_product(setting) / light->real_us);
    out->saturated = light->measure.saturated;
    out->middle = light->shared * (exposure_product(setting) / light->real_us);
}

// Ends a region that has worked or failed.
static int end_side(struct exposure_job *job, struct rig_region *region, int error,
                    const struct exposure_setting *setting) {
    if (error != ERROR_OK) {
        (void)rig_region_end(job->rig, region, false);
        return error;
    }
    return exposure_region_end(job, region, setting);
}

// Finds the setting of one camera. Only the first one of both moves the irises.
static int search_side(struct exposure_job *job, unsigned side,
                       const struct exposure_setting *begin, struct exposure_setting *setting,
                       struct exposure_light *light, struct rig_autoexposure_side *out) {
    const struct rig_profile *profile = &job->rig->profile;
    const bool first = begin == &job->before[side];
    struct exposure_limits limits = exposure_camera_limits(job->rig, side);
    struct exposure_setting start = *begin;
    struct rig_region region;
    start.exposure_us = start.exposure_us != 0 ? start.exposure_us : START_US;
    limits.iris_closed = limits.iris_open = start.iris;
    if (first && exposure_has_iris(job, side) && !job->keep_iris) {
        const double open = profile->optics.f_number_open;
        const double closed = profile->optics.f_number_closed;
        limits.iris_closed = profile->lens.axis[LENS_IRIS].min;
        limits.iris_open = profile->lens.axis[LENS_IRIS].max;
        limits.iris_range = open > 0 ? closed * closed / (open * open) : 0;
    }
    int error = exposure_region_begin(job, &region, side, EXPOSURE_WHOLE_FIELD);
    if (error == ERROR_OK) {
        error = search(job, &region, &limits, &start, setting, light, out);
    }
    return end_side(job, &region, error, setting);
}

// ---- both cameras

static bool is_equal(const struct exposure_setting *a, const struct exposure_setting *b) {
    return a->exposure_us == b->exposure_us && a->gain_q3 == b->gain_q3;
}

// The mean of a camera's shared field per exposure x gain, measured with fine sampling: a board's
// edges and its pixels beat. Leaves the region running.
static int begin_shared(struct exposure_job *job, struct rig_region *region, unsigned side,
                        struct exposure_setting *setting, struct exposure_light *light) {
    int error = exposure_region_begin(job, region, side, EXPOSURE_SHARED_FIELD);
    if (error == ERROR_OK) {
        error = exposure_region_set(job, region, setting, NULL);
    }
    return error == ERROR_OK ? exposure_region_measure(job, region, setting, light) : error;
}

// Makes the right camera as bright as the left one, whose shared field has the mean `wanted`.
static int match(struct exposure_job *job, struct rig_region *region,
                 const struct exposure_limits *limits, double wanted,
                 const struct exposure_setting *left, struct exposure_setting *setting,
                 struct exposure_light *light, double *difference) {
    for (int i = 0; i < MATCHES_MAX && light->measure.mean > 0; i++) {
        struct exposure_setting next = *setting;
        exposure_setting_like(limits, wanted / light->measure.mean * light->real_us, left, &next);
        if (!is_equal(&next, setting)) {
            *setting = next;
            int error = exposure_region_set(job, region, setting, NULL);
            if (error == ERROR_OK) {
                error = exposure_region_measure(job, region, setting, light);
            }
            if (error != ERROR_OK) {
                return error;
            }
        }
        const double mean = light->measure.mean * (exposure_product(setting) / light->real_us);
        *difference = mean / wanted - 1;
        if (*difference <= difference_max && *difference >= -difference_max) {
            break;
        }
    }
    return ERROR_OK;
}

static int match_both(struct exposure_job *job, struct exposure_setting *left,
                      struct exposure_setting *right, struct rig_autoexposure_result *result) {
    // Before the regions, which have other rows.
    const struct exposure_limits limits = exposure_camera_limits(job->rig, RIG_RIGHT);
    struct rig_region region;
    struct exposure_light left_light, right_light;
    int error = begin_shared(job, &region, RIG_LEFT, left, &left_light);
    error = end_side(job, &region, error, left);
    if (error != ERROR_OK || left_light.measure.mean <= 0) {
        return error;
    }
    const double left_rate = left_light.measure.mean / left_light.real_us;
    error = begin_shared(job, &region, RIG_RIGHT, right, &right_light);
    if (error == ERROR_OK) {
        const double right_rate = right_light.measure.mean / right_light.real_us;
        result->ratio = right_rate > 0 ? left_rate / right_rate : 0;
        result->flicker =
            left_light.spread > right_light.spread ? left_light.spread : right_light.spread;
        error = match(job, &region, &limits, left_rate * exposure_product(left), left, right,
                      &right_light, &result->difference);
    }
    return end_side(job, &region, error, right);
}

static int search_both(struct exposure_job *job, struct rig_autoexposure_result *result) {
    struct exposure_setting left, right;
    struct exposure_light left_light, right_light;
    struct rig_autoexposure_side *sides = result->side;
    int error =
        search_side(job, RIG_LEFT, &job->before[RIG_LEFT], &left, &left_light, &sides[RIG_LEFT]);
    if (error == ERROR_OK) {
        error = search_side(job, RIG_RIGHT, &left, &right, &right_light, &sides[RIG_RIGHT]);
    }
    if (error != ERROR_OK) {
        return error;
    }
    if (left_light.shared > 0 && right_light.shared > 0) {
        // What the left one may have at most, so that the right one is not too bright.
        const double ratio =
            (left_light.shared / left_light.real_us) / (right_light.shared / right_light.real_us);
        const double possible_us = exposure_product(&right) * room_for_right / ratio;
        if (possible_us < exposure_product(&left)) {
            const struct exposure_limits limits = exposure_camera_limits(job->rig, RIG_LEFT);
            exposure_setting_for(&limits, possible_us, &left);
            sides[RIG_LEFT].bound = sides[RIG_RIGHT].bound;
        }
    }
    error = match_both(job, &left, &right, result);
    set_result(job, RIG_LEFT, &left, &left_light, &sides[RIG_LEFT]);
    set_result(job, RIG_RIGHT, &right, &right_light, &sides[RIG_RIGHT]);
    return error;
}

// ---- before and after

static int remember(struct exposure_job *job) {
    struct rig *rig = job->rig;
    int error = ERROR_OK;
    for (unsigned side = 0; side < RIG_SIDES && error == ERROR_OK; side++) {
        struct exposure_setting *before = &job->before[side];
        *before = (struct exposure_setting){rig_camera_exposure_us(rig, side),
                                            rig_camera_gain_q3(rig, side), 0};
        if ((job->sides >> side & 1) != 0 && exposure_has_iris(job, side)) {
            int32_t positions[LENS_AXES];
            error = rig_lens_read(rig, side, positions);
            before->iris = error == ERROR_OK ? positions[LENS_IRIS] : 0;
        }
    }
    return error;
}

// After a failure. A setting that was not known before stays.
static void restore(struct exposure_job *job, int error) {
    struct rig *rig = job->rig;
    const struct rig_error last_error = rig->last_error, rejected = rig->rejected;
    const bool moves_back = job->iris_moved && (error == ERROR_RANGE || error == ERROR_MOVED);
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        if ((job->sides >> side & 1) != 0 && rig->state == RIG_READY) {
            (void)exposure_camera_set(job, side, &job->before[side]);
        }
        if ((job->sides >> side & 1) != 0 && rig->state == RIG_READY && moves_back &&
            exposure_has_iris(job, side)) {
            (void)exposure_move_iris(job, 1u << side, job->before[side].iris);
        }
    }
    if (rig->state == RIG_READY) {
        rig->last_error = last_error;
        rig->rejected = rejected;
    }
}

int rig_autoexposure(struct rig *self, const struct rig_autoexposure_request *request,
                     struct rig_autoexposure_result *result) {
    if (request->sides == 0 || (request->sides & ~(unsigned)EXPOSURE_BOTH_SIDES) != 0 ||
        !(request->target >= 0.01 && request->target <= 0.9)) {
        return ERROR_ARGUMENT;
    }
    if (self->state != RIG_READY) {
        return ERROR_NOT_READY;
    }
    const unsigned first = (request->sides >> RIG_LEFT & 1) != 0 ? RIG_LEFT : RIG_RIGHT;
    struct exposure_job job = {
        .rig = self, .sides = request->sides, .region_px = request->region_px};
    job.keep_iris = request->keep_iris;
    job.target = (struct exposure_target){request->target, request->whites ? white_max : 0};
    *result = (struct rig_autoexposure_result){.difference = 0};
    int error = remember(&job);
    job.iris = job.before[first].iris;
    if (error != ERROR_OK) {
        return rig_end(self, error);
    }
    exposure_report(&job);
    if (request->sides == EXPOSURE_BOTH_SIDES) {
        error = search_both(&job, result);
    } else {
        struct exposure_setting setting;
        struct exposure_light light;
        error =
            search_side(&job, first, &job.before[first], &setting, &light, &result->side[first]);
        if (error == ERROR_OK) {
            set_result(&job, first, &setting, &light, &result->side[first]);
        }
    }
    if (error != ERROR_OK) {
        restore(&job, error);
    }
    return rig_end(self, error);
}
