// SPDX-License-Identifier: Apache-2.0
// Commands for the state of the instrument: status, health, bringup, safe, wait.
#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "rig/rig.h"
#include "rig/safe.h"

enum { IDLE_US = 50000 };

static const double us_per_s = 1e6;
static const double us_per_ms = 1e3;
static const double urad_per_degree = 1e6 * MATH_RAD_PER_DEGREE;

static const char *state_name(enum rig_state state) {
    static const char *const names[] = {[RIG_DOWN] = "down", [RIG_READY] = "ready", "safe"};
    INVARIANT(state >= RIG_DOWN && state <= RIG_SAFE);
    return names[state];
}

/// Whether the last error is over: a capture was rejected or a lens did not arrive, but the
/// instrument is ready and the part responds.
static bool error_is_over(const struct rig *rig) {
    return rig->state == RIG_READY && rig->health[rig->last_error.part].error == ERROR_OK;
}

static void put_last_error(const struct command_call *call) {
    // A cancelled command leaves no text, as the user wanted it.
    if (call->rig->last_error.error != ERROR_OK && call->rig->last_error.text[0] != '\0') {
        reply_text(call, error_is_over(call->rig) ? "last_error" : "error",
                   call->rig->last_error.text);
    }
}

static int put_pan(const struct command_call *call, unsigned side) {
    int32_t angle_urad = 0;
    const int error = rig_pan_read(call->rig, side, &angle_urad);
    if (error == ERROR_OK) {
        reply_number(call, "pan", (double)angle_urad / urad_per_degree, 3, "deg");
    }
    return error;
}

static int put_lens(const struct command_call *call, unsigned side) {
    static const char *const sigmas[LENS_AXES] = {"zoom_sigma", "focus_sigma", "iris_sigma"};
    struct lens_mean means[LENS_AXES];
    const int error = rig_lens_read_mean(call->rig, side, RIG_LENS_READINGS, means);
    for (int axis = 0; error == ERROR_OK && axis < LENS_AXES; axis++) {
        if (rig_has_axis(&call->rig->profile, side, (enum lens_axis)axis)) {
            reply_number(call, lens_axis_names[axis], means[axis].position_q4 / 16.0, 2, "counts");
            reply_number(call, sigmas[axis], means[axis].sigma_q4 / 16.0, 2, "counts");
            commands_lens_meaning(call, side, (enum lens_axis)axis, lens_mean_counts(&means[axis]));
        }
    }
    return error;
}

static int put_side(const struct command_call *call, unsigned side) {
    const struct rig *rig = call->rig;
    INVARIANT(side < RIG_SIDES);
    int error = ERROR_OK;
    reply_group_begin(call, commands_side_name(side), false);
    if (rig->profile.servos) {
        error = put_pan(call, side);
    }
    if (error == ERROR_OK && rig_has_lens(&rig->profile, side)) {
        error = put_lens(call, side);
    }
    // 0: never set here, so the camera decides.
    if (rig->camera[side].exposure_us != 0) {
        reply_number(call, "exposure", rig->camera[side].exposure_us, 0, "us");
    }
    if (rig->camera[side].gain_q3 != 0) {
        reply_number(call, "gain", rig->camera[side].gain_q3 / 8.0, 3, NULL);
    }
    reply_group_end(call);
    return error;
}

int commands_state_status(const struct command_call *call) {
    const struct rig *rig = call->rig;
    reply_text(call, "state", state_name(rig->state));
    reply_text(call, "profile", rig->profile.name);
    put_last_error(call);
    if (rig->state != RIG_READY) {
        return ERROR_OK;
    }
    reply_group_begin(call, "window", false);
    reply_number(call, "width", rig->format.width_px, 0, "px");
    reply_number(call, "height", rig->format.height_px, 0, "px");
    reply_group_end(call);
    reply_number(call, "pairs", rig->pairs, 0, NULL);
    const int error = put_side(call, RIG_LEFT);
    return error != ERROR_OK ? error : put_side(call, RIG_RIGHT);
}

/// Part, state, and why its device could not be opened, if so.
static void put_state(const struct command_call *call, enum rig_part part, const char *state) {
    const struct rig_devices *devices = call->rig->ports.devices;
    const bool failed = call->rig->health[part].error != ERROR_OK;
    const char *why = failed && devices != NULL ? devices->missing(devices->self, part) : NULL;
    reply_text(call, "part", rig_part_text(part));
    reply_text(call, "state", state);
    if (why != NULL) {
        reply_text(call, "why", why);
    }
}

static const char *part_state(const struct rig_part_health *health) {
    if (!health->present) {
        return "missing";
    }
    return health->error == ERROR_OK ? "works" : error_text(health->error);
}

static void put_part(const struct command_call *call, enum rig_part part, uint64_t now_us) {
    const struct rig_part_health *health = &call->rig->health[part];
    reply_group_begin(call, NULL, false);
    put_state(call, part, part_state(health));
    reply_number(call, "uses", health->uses, 0, NULL);
    reply_number(call, "failures", health->failures, 0, NULL);
    if (health->last_us != 0 && now_us >= health->last_us) {
        reply_number(call, "last", (double)(now_us - health->last_us) / us_per_s, 3, "s ago");
    }
    reply_group_end(call);
}

static void put_bus(const struct command_call *call) {
    const struct fpga_bridge_counts *counts = &call->rig->bridge.bus.counts;
    reply_group_begin(call, "bus", false);
    reply_number(call, "transfers", counts->transfers, 0, NULL);
    reply_number(call, "nacks", counts->nacks, 0, NULL);
    reply_number(call, "arbitration", counts->arbitration, 0, NULL);
    reply_number(call, "timeouts", counts->timeouts, 0, NULL);
    reply_number(call, "stuck", counts->stuck, 0, NULL);
    reply_number(call, "verify", counts->verify, 0, NULL);
    reply_number(call, "repeats", counts->repeats, 0, NULL);
    reply_number(call, "recoveries", counts->recoveries, 0, NULL);
    reply_number(call, "unrecovered", counts->unrecovered, 0, NULL);
    reply_group_end(call);
}

static void put_watchdog(const struct command_call *call) {
    reply_group_begin(call, "watchdog", false);
    reply_number(call, "period", call->rig->profile.watchdog_ms, 0, "ms");
    reply_number(call, "longest_gap", (double)call->rig->feed_gap_us / us_per_ms, 3, "ms");
    reply_group_end(call);
}

static void put_cameras(const struct command_call *call) {
    const struct rig *rig = call->rig;
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const struct hal_camera *camera = rig->ports.camera[side];
        if (camera == NULL || (side == RIG_RIGHT && rig->profile.bridge)) {
            continue;
        }
        struct hal_camera_counts counts = {0};
        camera->operations->counts(camera->self, &counts);
        reply_group_begin(call, rig->profile.bridge ? "port" : commands_side_name(side), false);
        reply_number(call, "frames", counts.frames, 0, NULL);
        reply_number(call, "faulty", counts.faulty, 0, NULL);
        reply_number(call, "gaps", counts.gaps, 0, NULL);
        // Time-outs are left out: the rig waits in slices of 100 ms, and most of these time out.
        reply_number(call, "restarts", counts.restarts, 0, NULL);
        reply_group_end(call);
    }
}

int commands_state_health(const struct command_call *call) {
    struct rig *rig = call->rig;
    // A check only takes time; before the bring-up there is nothing to check.
    const int error = rig->state == RIG_DOWN ? ERROR_OK : rig_check(rig);
    const uint64_t now_us = rig->ports.clock->operations->now_us(rig->ports.clock->self);
    reply_text(call, "state", state_name(rig->state));
    put_last_error(call);
    reply_group_begin(call, "parts", true);
    for (int part = RIG_PART_NONE + 1; part < RIG_PARTS; part++) {
        if (rig->health[part].present || rig->health[part].error != ERROR_OK) {
            put_part(call, (enum rig_part)part, now_us);
        }
    }
    reply_group_end(call);
    if (rig->profile.bridge && rig->state != RIG_DOWN) {
        put_bus(call);
        put_watchdog(call);
    }
    put_cameras(call);
    if (rig->state != RIG_SAFE) {
        return error;
    }
    // Report the failure that made the rig safe; it may be from this check.
    const bool failed =
        rig->last_error.error != ERROR_OK && rig->health[rig->last_error.part].error != ERROR_OK;
    return failed ? rig->last_error.error : commands_not_ready(call, "health");
}

int commands_state_bringup(const struct command_call *call) {
    const int error = rig_bringup(call->rig);
    reply_text(call, "state", state_name(call->rig->state));
    reply_group_begin(call, "parts", true);
    for (int part = RIG_PART_NONE + 1; part < RIG_PARTS; part++) {
        const struct rig_part_health *health = &call->rig->health[part];
        if (health->present || health->error != ERROR_OK) {
            reply_group_begin(call, NULL, false);
            put_state(call, (enum rig_part)part,
                      health->error == ERROR_OK ? "works" : error_text(health->error));
            reply_group_end(call);
        }
    }
    reply_group_end(call);
    return error;
}

int commands_state_safe(const struct command_call *call) {
    if (error_is_over(call->rig)) {
        // Otherwise it would be reported as the reason.
        call->rig->last_error = (struct rig_error){.error = ERROR_OK};
    }
    const int error = rig_safe(call->rig);
    reply_text(call, "state", state_name(call->rig->state));
    return error;
}

int commands_state_wait(const struct command_call *call) {
    struct rig *rig = call->rig;
    const struct hal_clock *clock = rig->ports.clock;
    const uint64_t begin_us = clock->operations->now_us(clock->self);
    const uint64_t total_us = (uint64_t)(call->values[0].number * us_per_s);
    const uint64_t end_us = begin_us + total_us;
    for (uint64_t now_us = begin_us; now_us < end_us;) {
        if (rig->observer.should_stop != NULL && rig->observer.should_stop(rig->observer.self)) {
            return ERROR_CANCELLED;
        }
        if (rig->observer.progress != NULL) {
            rig->observer.progress(rig->observer.self, "waiting",
                                   (uint32_t)((now_us - begin_us) / 1000),
                                   (uint32_t)(total_us / 1000));
        }
        const int error = rig_serve(rig);
        if (error != ERROR_OK) {
            return error;
        }
        const uint64_t next_us = now_us + IDLE_US;
        clock->operations->wait_until_us(clock->self, next_us < end_us ? next_us : end_us);
        now_us = clock->operations->now_us(clock->self);
    }
    return ERROR_OK;
}
