// SPDX-License-Identifier: Apache-2.0
#include "device/fpga_bridge_camera.h"

#include "core/error.h"
#include "core/invariant.h"

enum {
    STRIDE = BRIDGE_CAMERA1_FRAMES - BRIDGE_CAMERA0_FRAMES,
    WORDS = BRIDGE_CAMERA0_FLAGS - BRIDGE_CAMERA0_FRAMES + 1,
};

int fpga_bridge_camera_read(struct fpga_bridge *self, unsigned camera,
                            struct fpga_bridge_camera *out) {
    _Static_assert((int)WORDS <= (int)FPGA_BRIDGE_BLOCK_WORDS, "one transfer");
    INVARIANT(out != NULL);
    if (camera >= FPGA_BRIDGE_CAMERAS) {
        return ERROR_ARGUMENT;
    }
    int error = fpga_bridge_need(self, camera == 1 ? BRIDGE_CAPS_CAMERA1_MASK : 0);
    if (error != ERROR_OK) {
        return error;
    }
    const uint8_t first = (uint8_t)(BRIDGE_CAMERA0_FRAMES + camera * STRIDE);
    INVARIANT((fpga_bridge_register(first)->flags & BRIDGE_HOLDS_BLOCK) != 0);
    uint16_t words[WORDS];
    error = fpga_bridge_read_block(self, first, WORDS, words);
    if (error != ERROR_OK) {
        return error;
    }
    const unsigned flags = words[WORDS - 1];
    *out = (struct fpga_bridge_camera){
        .frames = words[0],
        .lines = words[BRIDGE_CAMERA0_LINES - BRIDGE_CAMERA0_FRAMES],
        .pixels = words[BRIDGE_CAMERA0_PIXELS - BRIDGE_CAMERA0_FRAMES],
        .period_10us = words[BRIDGE_CAMERA0_PERIOD_10US - BRIDGE_CAMERA0_FRAMES],
        .pixclk_khz = words[BRIDGE_CAMERA0_PIXCLK_KHZ - BRIDGE_CAMERA0_FRAMES],
        .short_lines = words[BRIDGE_CAMERA0_SHORT_LINES - BRIDGE_CAMERA0_FRAMES],
        .short_frames = words[BRIDGE_CAMERA0_SHORT_FRAMES - BRIDGE_CAMERA0_FRAMES],
        .lost = (flags & BRIDGE_CAMERA0_FLAGS_LOST_MASK) != 0,
        .frame_valid = (flags & BRIDGE_CAMERA0_FLAGS_FRAME_VALID_MASK) != 0,
        .short_line = (flags & BRIDGE_CAMERA0_FLAGS_SHORT_LINE_MASK) != 0,
        .short_frame = (flags & BRIDGE_CAMERA0_FLAGS_SHORT_FRAME_MASK) != 0,
        .cut = (flags & BRIDGE_CAMERA0_FLAGS_CUT_MASK) != 0,
    };
    return ERROR_OK;
}

static uint16_t needed_caps(uint16_t source) {
    if (source == BRIDGE_CAM_SELECT_SOURCE_IS_RIGHT) {
        return BRIDGE_CAPS_CAMERA1_MASK;
    }
    return source == BRIDGE_CAM_SELECT_SOURCE_IS_PATTERN ? BRIDGE_CAPS_PATTERN_MASK : 0;
}

int fpga_bridge_camera_select(struct fpga_bridge *self, uint16_t source) {
    const int error = fpga_bridge_need(self, needed_caps(source));
    if (error != ERROR_OK) {
        return error;
    }
    const unsigned mask = BRIDGE_CAM_SELECT_SOURCE_MASK | BRIDGE_CAM_SELECT_ALTERNATING_MASK;
    if (source > BRIDGE_CAM_SELECT_SOURCE_MASK >> BRIDGE_CAM_SELECT_SOURCE_SHIFT) {
        return ERROR_RANGE;
    }
    return fpga_bridge_update(self, BRIDGE_CAM_SELECT, (uint16_t)mask,
                              (uint16_t)(source << BRIDGE_CAM_SELECT_SOURCE_SHIFT));
}

int fpga_bridge_camera_source(struct fpga_bridge *self, struct fpga_bridge_source *out) {
    uint16_t word = 0;
    const int error = fpga_bridge_read(self, BRIDGE_CAM_STATE, &word);
    if (error == ERROR_OK) {
        *out = (struct fpga_bridge_source){
            .active = (word & BRIDGE_CAM_STATE_ACTIVE_MASK) >> BRIDGE_CAM_STATE_ACTIVE_SHIFT,
            .gate_open = (word & BRIDGE_CAM_STATE_GATE_OPEN_MASK) != 0,
            .switching = (word & BRIDGE_CAM_STATE_SWITCHING_MASK) != 0,
            .forced = (word & BRIDGE_CAM_STATE_FORCED_MASK) != 0,
        };
    }
    return error;
}

int fpga_bridge_camera_switch_limit(struct fpga_bridge *self, uint16_t limit_ms) {
    return fpga_bridge_write(self, BRIDGE_SWITCH_TIMEOUT_MS, limit_ms);
}

int fpga_bridge_camera_stream(struct fpga_bridge *self, bool enabled) {
    return fpga_bridge_write_field(self, FPGA_BRIDGE_FIELD(CTRL, STREAM_ENABLE), enabled);
}

int fpga_bridge_camera_ppi_mode(struct fpga_bridge *self, uint16_t mode) {
    const bool tag = (mode & BRIDGE_PPI_MODE_TAG_MASK) != 0;
    const int error = fpga_bridge_need(self, tag ? BRIDGE_CAPS_TAG_MASK : 0);
    return error == ERROR_OK ? fpga_bridge_write(self, BRIDGE_PPI_MODE, mode) : error;
}

int fpga_bridge_camera_expect(struct fpga_bridge *self, uint16_t width_pixels,
                              uint16_t height_lines) {
    const int error = fpga_bridge_write(self, BRIDGE_EXPECT_WIDTH, width_pixels);
    return error == ERROR_OK ? fpga_bridge_write(self, BRIDGE_EXPECT_HEIGHT, height_lines) : error;
}

int fpga_bridge_camera_pattern(struct fpga_bridge *self,
                               const struct fpga_bridge_pattern *pattern) {
    const struct {
        uint8_t index;
        uint16_t value;
    } words[] = {
        {BRIDGE_PATTERN_WIDTH, pattern->width},   {BRIDGE_PATTERN_HEIGHT, pattern->height},
        {BRIDGE_PATTERN_HBLANK, pattern->hblank}, {BRIDGE_PATTERN_VBLANK, pattern->vblank},
        {BRIDGE_PATTERN_KIND, pattern->kind},     {BRIDGE_PATTERN_SEED, pattern->seed},
    };
    int error = fpga_bridge_need(self, BRIDGE_CAPS_PATTERN_MASK);
    for (size_t i = 0; error == ERROR_OK && i < sizeof words / sizeof words[0]; i++) {
        error = fpga_bridge_write(self, words[i].index, words[i].value);
    }
    return error;
}
