// SPDX-License-Identifier: Apache-2.0
// Pans the cameras. A servo may ignore a move smaller than its dead band, and its gear has play. So
// each horn first goes AIM_DEAD_BANDS dead bands below its goal, and then up in one step (where the
// slew limit allows that much), which it cannot ignore.
#include "core/error.h"
#include "core/invariant.h"
#include "device/fpga_bridge_event.h"
#include "rig/base/health.h"
#include "rig/base/poll.h"
#include "rig/base/rig_clock.h"
#include "rig/base/rig_error.h"
#include "rig/rig.h"
#include "rig/safe.h"

enum {
    // The horn may lag by one dead band at the waypoint, and must see more than one dead band from
    // there to the goal.
    AIM_DEAD_BANDS = 3,
    LOOK_US = 20000,
    LATE_US = 500000,  // time allowed beyond the longest travel
    Q4_PER_US = 16,
};

// A servo that is moving.
struct horn {
    unsigned side;
    uint16_t goal_q4, waypoint_q4;
    uint16_t actual_q4, slew_q4;
    bool limp;  // no pulses, so its position is unknown
    uint64_t stopped_at_us;
};

static enum rig_part part_of(unsigned side) {
    return rig_part_of(RIG_PART_LEFT_SERVO, side);
}

static int ready(struct rig *self, unsigned side) {
    if (!self->profile.servos) {
        return rig_part_error(self, part_of(side), ERROR_NOT_CONNECTED,
                              "the profile has no pan servos", NULL);
    }
    if (self->state != RIG_READY) {
        return rig_part_error(self, part_of(side), ERROR_NOT_READY,
                              "the rig is not up (run bringup)", NULL);
    }
    return ERROR_OK;
}

// Handles a failed transfer of one servo.
static int failed(struct rig *self, unsigned side, int error) {
    rig_part_used(self, part_of(side), error);
    rig_bus_failed(self, part_of(side), error);
    return rig_fail_safe(self, error);
}

static int look(struct rig *self, struct horn *horn, struct fpga_bridge_servo *servo) {
    const int error = fpga_bridge_servo_read(&self->bridge, horn->side, servo);
    if (error != ERROR_OK) {
        return failed(self, horn->side, error);
    }
    rig_part_used(self, part_of(horn->side), ERROR_OK);
    horn->actual_q4 = servo->actual_q4;
    return ERROR_OK;
}

// Sets the pulse width of the angle, if it is within the limits of profile and servo.
static int set_goal(struct rig *self, struct horn *horn, int32_t angle_urad) {
    const struct rig_profile *profile = &self->profile;
    const struct servo_model *model = &profile->servo[horn->side];
    const bool within = angle_urad >= profile->pan_min_urad && angle_urad <= profile->pan_max_urad;
    if (!within || servo_width_q4(model, angle_urad, &horn->goal_q4) != ERROR_OK) {
        enum { URAD_PER_MRAD = 1000 };
        return rig_part_error(
            self, part_of(horn->side), ERROR_RANGE,
            "angle # mrad is outside # to # mrad, or outside the servo's pulse widths",
            (const int32_t[]){angle_urad / URAD_PER_MRAD, profile->pan_min_urad / URAD_PER_MRAD,
                              profile->pan_max_urad / URAD_PER_MRAD});
    }
    const int32_t below = horn->goal_q4 - AIM_DEAD_BANDS * model->dead_band_q4;
    horn->waypoint_q4 = below > model->min_q4 ? (uint16_t)below : model->min_q4;
    return ERROR_OK;
}

// Reads the state of all horns; `*period_us`: time between pulses.
static int survey(struct rig *self, struct horn *horns, unsigned count, uint16_t *period_us) {
    static const uint16_t active[RIG_SIDES] = {BRIDGE_STATUS_SERVO0_ACTIVE_MASK,
                                               BRIDGE_STATUS_SERVO1_ACTIVE_MASK};
    uint16_t status = 0;
    int error = fpga_bridge_event_status(&self->bridge, &status);
    if (error == ERROR_OK) {
        error = fpga_bridge_read(&self->bridge, BRIDGE_SERVO_PERIOD_US, period_us);
    }
    if (error != ERROR_OK) {
        return failed(self, horns[0].side, error);
    }
    if ((status & BRIDGE_STATUS_WATCHDOG_FIRED_MASK) != 0) {
        rig_part_error(self, RIG_PART_BRIDGE, ERROR_TIMEOUT,
                       "its watchdog fired because this program was late (run bringup)", NULL);
        return rig_fail_safe(self, ERROR_TIMEOUT);
    }
    for (unsigned i = 0; i < count && error == ERROR_OK; i++) {
        struct fpga_bridge_servo servo = {.slew_q4 = 0};
        error = look(self, &horns[i], &servo);
        horns[i].limp = (status & active[horns[i].side]) == 0;
        horns[i].slew_q4 = servo.slew_q4;
    }
    return error;
}

// ---- one leg

// Starts a horn. It will have stopped at `stopped_at_us`.
static int send(struct rig *self, struct horn *horn, uint16_t width_q4, uint16_t period_us) {
    const struct servo_model *model = &self->profile.servo[horn->side];
    int error = fpga_bridge_servo_aim(&self->bridge, horn->side, width_q4);
    if (error == ERROR_OK && horn->limp) {
        error = fpga_bridge_servo_enable(&self->bridge, horn->side, true);
    }
    if (error != ERROR_OK) {
        return failed(self, horn->side, error);
    }
    const uint64_t now_us = rig_now_us(self),
                   before_us = self->camera[horn->side].pan_stopped_at_us;
    uint64_t stopped_at_us = now_us > before_us ? now_us : before_us;
    // With its first pulse a limp horn turns from an unknown position to where the bridge begins.
    stopped_at_us +=
        horn->limp ? servo_travel_us(model, model->min_q4, model->max_q4, 0, period_us) : 0;
    stopped_at_us += servo_travel_us(model, horn->actual_q4, width_q4, horn->slew_q4, period_us);
    horn->limp = false;
    horn->stopped_at_us = stopped_at_us;
    self->camera[horn->side].pan_q4 = width_q4;
    self->camera[horn->side].pan_stopped_at_us = stopped_at_us;
    return ERROR_OK;
}

// Waits until the bridge sends the width and the horn has had time to turn.
static int arrive(struct rig *self, struct horn *horn, uint16_t width_q4) {
    while (horn->actual_q4 != width_q4) {
        int error = rig_wait_until(self, rig_now_us(self) + LOOK_US);
        struct fpga_bridge_servo servo;
        if (error != ERROR_OK) {
            return error;
        }
        error = look(self, horn, &servo);
        if (error != ERROR_OK) {
            return error;
        }
        if (horn->actual_q4 != width_q4 && rig_now_us(self) > horn->stopped_at_us + LATE_US) {
            rig_part_used(self, part_of(horn->side), ERROR_TIMEOUT);
            return rig_part_error(
                self, part_of(horn->side), ERROR_TIMEOUT,
                "the bridge sends # us instead of # us: check its limits, slew and watchdog, then "
                "run bringup",
                (const int32_t[]){horn->actual_q4 / Q4_PER_US, width_q4 / Q4_PER_US});
        }
    }
    return rig_wait_until(self, horn->stopped_at_us);
}

static int run_leg(struct rig *self, struct horn *horns, unsigned count, bool last,
                   uint16_t period_us) {
    int error = ERROR_OK;
    for (unsigned i = 0; i < count && error == ERROR_OK; i++) {
        error = send(self, &horns[i], last ? horns[i].goal_q4 : horns[i].waypoint_q4, period_us);
    }
    for (unsigned i = 0; i < count && error == ERROR_OK; i++) {
        error = arrive(self, &horns[i], last ? horns[i].goal_q4 : horns[i].waypoint_q4);
    }
    return error;
}

// Holds the horns at the width that is being sent now.
static void hold(struct rig *self, struct horn *horns, unsigned count, uint16_t period_us) {
    for (unsigned i = 0; i < count; i++) {
        struct fpga_bridge_servo servo;
        if (look(self, &horns[i], &servo) != ERROR_OK ||
            send(self, &horns[i], horns[i].actual_q4, period_us) != ERROR_OK) {
            return;
        }
    }
}

// ---- all together

static bool is_at_target(const struct rig *self, const struct horn *horn) {
    return !horn->limp && horn->actual_q4 == horn->goal_q4 &&
           self->camera[horn->side].pan_q4 == horn->goal_q4;
}

static int turn(struct rig *self, struct horn *horns, unsigned count) {
    uint16_t period_us = 0;
    int error = survey(self, horns, count, &period_us);
    if (error != ERROR_OK) {
        return error;
    }
    unsigned still = 0;
    for (unsigned i = 0; i < count; i++) {
        still += is_at_target(self, &horns[i]) ? 1 : 0;
    }
    if (still == count) {
        for (unsigned i = 0; i < count && error == ERROR_OK; i++) {
            error = rig_wait_until(self, self->camera[horns[i].side].pan_stopped_at_us);
        }
        return error;
    }
    error = run_leg(self, horns, count, false, period_us);
    error = error == ERROR_OK ? run_leg(self, horns, count, true, period_us) : error;
    if (error == ERROR_CANCELLED) {
        hold(self, horns, count, period_us);
    }
    return error;
}

int rig_pan(struct rig *self, unsigned side, int32_t angle_urad) {
    if (side >= RIG_SIDES) {
        return rig_part_error(self, RIG_PART_NONE, ERROR_ARGUMENT,
                              "no such servo (expected left or right)", NULL);
    }
    struct horn horn = {.side = side};
    int error = ready(self, side);
    if (error != ERROR_OK) {
        return error;
    }
    error = set_goal(self, &horn, angle_urad);
    if (error != ERROR_OK) {
        return error;
    }
    return rig_end(self, turn(self, &horn, 1));
}

int rig_pan_both(struct rig *self, int32_t left_urad, int32_t right_urad) {
    struct horn horns[RIG_SIDES] = {{.side = RIG_LEFT}, {.side = RIG_RIGHT}};
    int error = ready(self, RIG_LEFT);
    if (error != ERROR_OK) {
        return error;
    }
    error = set_goal(self, &horns[RIG_LEFT], left_urad);
    if (error != ERROR_OK) {
        return error;
    }
    error = set_goal(self, &horns[RIG_RIGHT], right_urad);
    if (error != ERROR_OK) {
        return error;
    }
    return rig_end(self, turn(self, horns, RIG_SIDES));
}

int rig_pan_read(struct rig *self, unsigned side, int32_t *angle_urad) {
    INVARIANT(angle_urad != NULL);
    if (side >= RIG_SIDES) {
        return rig_part_error(self, RIG_PART_NONE, ERROR_ARGUMENT,
                              "no such servo (expected left or right)", NULL);
    }
    struct horn horn = {.side = side};
    struct fpga_bridge_servo servo;
    int error = ready(self, side);
    error = error == ERROR_OK ? look(self, &horn, &servo) : error;
    if (error == ERROR_OK) {
        *angle_urad = servo_angle_urad(&self->profile.servo[side], servo.actual_q4);
    }
    return error;
}
