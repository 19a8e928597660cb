// SPDX-License-Identifier: Apache-2.0
// The command `selftest`: checks every part, then sends a test picture of the bridge through the
// whole frame path and compares it bit for bit. Nothing moves.
#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "rig/base/health.h"
#include "rig/base/poll.h"
#include "rig/base/rig_clock.h"
#include "rig/rig.h"
#include "rig/rig_camera.h"
#include "rig/safe.h"

enum {
    PICTURE_WIDTH_PX = 256,
    PICTURE_HEIGHT_PX = 64,
    PICTURE_SEED = 0x155,
    PICTURE_BITS = 10,
    PICTURE_LIMIT_US = 500000,
    SETTLE_US = RIG_CAMERA_SWITCH_LIMIT_MS * 1000,  ///< a change of the source ends within this
};

/// Counts pixels that differ from the pseudo-random sequence `prbs` of fpga/registers.rdl, and
/// collects the bits that ever differ.
static uint32_t wrong_pixels(const struct raw_image *image, uint16_t *wrong_bits) {
    uint32_t wrong = 0;
    uint16_t expected = PICTURE_SEED;
    *wrong_bits = 0;
    for (int y = 0; y < image->height_px; y++) {
        const uint16_t *values = raw_image_row(image, y);
        for (int x = 0; x < image->width_px; x++) {
            const uint16_t difference = values[x] ^ expected;
            wrong += difference != 0;
            *wrong_bits |= difference;
            const unsigned next = ((unsigned)expected >> 9 ^ (unsigned)expected >> 6) & 1U;
            expected = (uint16_t)(((unsigned)expected << 1 | next) & ((1U << PICTURE_BITS) - 1));
        }
    }
    return wrong;
}

static int assess(const struct command_call *call, const struct hal_camera_frame *frame) {
    INVARIANT(frame->image.data != NULL);
    if (frame->faults != 0 || frame->image.width_px != PICTURE_WIDTH_PX ||
        frame->image.height_px != PICTURE_HEIGHT_PX) {
        struct command_text sentence = commands_sentence(call);
        command_text_add(&sentence, "selftest: the bridge's test picture arrives incomplete");
        return ERROR_FRAME;
    }
    uint16_t wrong_bits = 0;
    const uint32_t wrong = wrong_pixels(&frame->image, &wrong_bits);
    reply_number(call, "wrong_pixels", wrong, 0, NULL);
    if (wrong == 0) {
        return ERROR_OK;
    }
    struct command_text sentence = commands_sentence(call);
    command_text_add(&sentence,
                     "selftest: the bridge's test picture arrives with wrong data bits ");
    command_text_add_hex(&sentence, wrong_bits, 4);
    command_text_add(&sentence, ": check the lines from the bridge to the parallel port");
    return ERROR_VERIFY;
}

static int nothing_arrived(const struct command_call *call, int error) {
    struct command_text sentence = commands_sentence(call);
    if (error == ERROR_TIMEOUT) {
        command_text_add(&sentence,
                         "selftest: the bridge's test picture does not arrive: check the lines "
                         "from the bridge to the parallel port");
    } else {
        command_text_join(&sentence, "selftest: no frame from the port behind the bridge (",
                          error_text(error), "): see the system log");
    }
    return error;
}

static int take_picture(const struct command_call *call) {
    struct rig *rig = call->rig;
    const struct hal_camera *port = rig->ports.camera[RIG_LEFT];
    struct hal_camera_frame frame;
    const uint64_t begin_us = rig_now_us(rig) + SETTLE_US;
    int error = ERROR_TIMEOUT;
    for (uint64_t now_us = begin_us - SETTLE_US;
         error == ERROR_TIMEOUT && now_us < begin_us + PICTURE_LIMIT_US; now_us = rig_now_us(rig)) {
        error = rig_poll(rig);
        if (error != ERROR_OK) {
            return error;  // already reported
        }
        error = port->operations->take(port->self, begin_us, now_us + RIG_POLL_US, &frame);
    }
    if (error != ERROR_OK) {
        return nothing_arrived(call, error);
    }
    error = assess(call, &frame);
    raw_image_release(&frame.image);
    return error;
}

static int show_picture(const struct command_call *call) {
    static const struct fpga_bridge_pattern pattern = {
        .width = PICTURE_WIDTH_PX,
        .height = PICTURE_HEIGHT_PX,
        .hblank = 144,
        .vblank = 25,
        .kind = BRIDGE_PATTERN_KIND_IS_PRBS,
        .seed = PICTURE_SEED,
    };
    const struct hal_camera_format format = {PICTURE_WIDTH_PX, PICTURE_HEIGHT_PX};
    struct rig *rig = call->rig;
    int error = rig_camera_stop(rig);  // the port's frame size has been changed
    if (error == ERROR_OK) {
        error = rig_bridge_used(rig, fpga_bridge_camera_pattern(&rig->bridge, &pattern));
    }
    if (error == ERROR_OK) {
        error = rig_bridge_used(
            rig, fpga_bridge_camera_select(&rig->bridge, BRIDGE_CAM_SELECT_SOURCE_IS_PATTERN));
    }
    if (error == ERROR_OK) {
        error = rig_camera_start(rig, &format);
    }
    return error == ERROR_OK ? take_picture(call) : error;
}

// Returns to the frames of the cameras, from the source selected before.
static int restore(struct rig *rig, uint16_t select, const struct hal_camera_format *format) {
    const int stopped = rig_camera_stop(rig);
    int error = rig_bridge_used(rig, fpga_bridge_write(&rig->bridge, BRIDGE_CAM_SELECT, select));
    if (error == ERROR_OK) {
        error = rig_camera_start(rig, format);
    }
    rig->format = *format;
    return error != ERROR_OK ? error : stopped;
}

static int test_picture(const struct command_call *call) {
    struct rig *rig = call->rig;
    const struct hal_camera_format format = rig->format;
    uint16_t select = 0;
    int error = rig_bridge_used(rig, fpga_bridge_read(&rig->bridge, BRIDGE_CAM_SELECT, &select));
    if (error != ERROR_OK) {
        return error;  // nothing was changed
    }
    error = show_picture(call);
    const struct rig_error first = rig->last_error;
    const int restored = restore(rig, select, &format);
    if (error == ERROR_OK) {
        error = restored;
    } else {
        rig->last_error = first;
    }
    // If the cameras or their bridge failed, the rig is not ready.
    const bool ready = restored == ERROR_OK && rig->state == RIG_READY;
    return ready ? error : rig_fail_safe(rig, error);
}

int commands_selftest_run(const struct command_call *call) {
    struct rig *rig = call->rig;
    int error = rig_check(rig);
    reply_text(call, "parts", error == ERROR_OK ? "all work" : error_text(error));
    if (error != ERROR_OK || !rig->profile.bridge) {
        return error;
    }
    if ((rig->bridge.caps & BRIDGE_CAPS_PATTERN_MASK) == 0) {
        reply_text(call, "picture", "this bridge makes no test picture");
        return ERROR_OK;
    }
    error = test_picture(call);
    reply_text(call, "picture", error == ERROR_OK ? "arrives bit for bit" : error_text(error));
    return error;
}
