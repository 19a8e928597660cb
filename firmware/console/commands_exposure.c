// SPDX-License-Identifier: Apache-2.0
// Command autoexpose.
#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "rig/auto/autoexposure.h"
#include "rig/rig.h"

enum { SIDE, REGION, TARGET, WHITES, IRIS };

static const double parts_of_percent = 100;
static const double default_target = 0.5;

// What keeps a picture from being brighter, or the target from being reached.
static const char *limit_of(const struct rig_autoexposure_side *side) {
    if (side->verdict == EXPOSURE_TOO_DARK) {
        return side->iris == INT32_MIN
                   ? "too dark at the longest exposure and the largest gain: add light"
                   : "too dark at the longest exposure, the largest gain and open iris: add light";
    }
    if (side->verdict == EXPOSURE_TOO_BRIGHT) {
        return "too bright at the shortest exposure: use less light, or close the iris";
    }
    static const char *const bounds[] = {[EXPOSURE_BY_MEAN] = "target",
                                         [EXPOSURE_BY_HIGHLIGHTS] = "highlights",
                                         [EXPOSURE_BY_WHITES] = "whites"};
    return bounds[side->bound];
}

static void put_side(const struct command_call *call, unsigned at,
                     const struct rig_autoexposure_side *side) {
    reply_group_begin(call, commands_side_name(at), false);
    reply_number(call, "exposure", side->exposure_us, 0, "us");
    reply_number(call, "gain", side->gain_q3 / 8.0, 3, NULL);
    if (side->iris != INT32_MIN) {
        reply_number(call, "iris", side->iris, 0, "counts");
    }
    reply_number(call, "mean", parts_of_percent * side->mean, 1, "%");
    reply_number(call, "saturated", parts_of_percent * side->saturated, 2, "%");
    reply_number(call, "steps", side->steps, 0, NULL);
    reply_text(call, "limit", limit_of(side));
    reply_group_end(call);
}

int commands_exposure_auto(const struct command_call *call) {
    struct rig_autoexposure_request request = {
        .sides = commands_sides(&call->values[SIDE]),
        .target = call->values[TARGET].given ? call->values[TARGET].number / parts_of_percent
                                             : default_target,
        .whites = command_is_set(&call->values[WHITES]),
        .keep_iris = call->values[IRIS].given && call->values[IRIS].choice == 0,
    };
    int error = commands_region(call, &call->values[REGION], RIG_AUTOEXPOSURE_REGION_MIN_PX,
                                UINT16_MAX, &request.region_px);
    if (error != 0) {
        return error;
    }
    struct rig_autoexposure_result result;
    error = rig_autoexposure(call->rig, &request, &result);
    for (unsigned side = 0; error == 0 && side < RIG_SIDES; side++) {
        if ((request.sides >> side & 1) != 0) {
            put_side(call, side, &result.side[side]);
        }
    }
    if (error == 0 && request.sides == (1u << RIG_LEFT | 1u << RIG_RIGHT)) {
        reply_number(call, "difference", parts_of_percent * result.difference, 1, "%");
    }
    return error;
}
