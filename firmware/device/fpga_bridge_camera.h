// SPDX-License-Identifier: Apache-2.0
/// The bridge's pixel path: which source goes to the PPI, what the cameras send, and when. Errors:
/// see fpga_bridge.h; ERROR_ARGUMENT: no such camera; ERROR_UNSUPPORTED: not in this bitstream.
#ifndef VERGENCE_DEVICE_FPGA_BRIDGE_CAMERA_H
#define VERGENCE_DEVICE_FPGA_BRIDGE_CAMERA_H

#include "device/fpga_bridge.h"

#ifdef __cplusplus
extern "C" {
#endif

/// 0 left, 1 right.
enum { FPGA_BRIDGE_CAMERAS = 2 };

/// Measurements of a camera's last frame, all latched at one moment, except short_lines,
/// short_frames, lost, frame_valid and cut: these may already include an error of the next frame.
struct fpga_bridge_camera {
    uint16_t frames;        ///< frames seen; wraps
    uint16_t lines;         ///< number of lines in the last frame
    uint16_t pixels;        ///< number of pixels in the first line of the last frame
    uint16_t period_10us;   ///< frame start to frame start
    uint16_t pixclk_khz;    ///< measured
    uint16_t short_lines;   ///< lines of a wrong length; saturates at 8 bits
    uint16_t short_frames;  ///< frames of a wrong height; saturates at 8 bits
    bool lost;              ///< no pixel clock
    bool frame_valid;       ///< a frame is under way
    bool short_line;        ///< the last frame has a line of a wrong length
    bool short_frame;       ///< the last frame has a wrong height
    bool cut;               ///< a frame was cut by a forced switch
};

/// State of the switch.
struct fpga_bridge_source {
    uint16_t active;  ///< BRIDGE_CAM_STATE_ACTIVE_IS_*
    bool gate_open;   ///< frames are passed to the PPI
    bool switching;
    bool forced;  ///< the last switch did not wait for the end of a frame
};

/// Registers of the pattern generator.
struct fpga_bridge_pattern {
    uint16_t width;   ///< pixels, a multiple of 16
    uint16_t height;  ///< lines, a multiple of 8
    uint16_t hblank;  ///< pixel clocks, a multiple of 4
    uint16_t vblank;  ///< lines
    uint16_t kind;    ///< BRIDGE_PATTERN_KIND_IS_*
    uint16_t seed;    ///< seed of "prbs", or the value of "constant"
};

/// Reads a camera's record in one transfer.
int fpga_bridge_camera_read(struct fpga_bridge *self, unsigned camera,
                            struct fpga_bridge_camera *out);

/// Requests a source (BRIDGE_CAM_SELECT_SOURCE_IS_*) and ends alternating.
int fpga_bridge_camera_select(struct fpga_bridge *self, uint16_t source);

/// Reads the state of the switch.
int fpga_bridge_camera_source(struct fpga_bridge *self, struct fpga_bridge_source *out);

/// Maximum time that a switch waits for the end of a frame, in ms.
int fpga_bridge_camera_switch_limit(struct fpga_bridge *self, uint16_t limit_ms);

/// Passes frames of the selected source to the PPI, or stops them.
int fpga_bridge_camera_stream(struct fpga_bridge *self, bool enabled);

/// Format of the PPI's signals: a sum of BRIDGE_PPI_MODE_*_MASK.
int fpga_bridge_camera_ppi_mode(struct fpga_bridge *self, uint16_t mode);

/// Expected size of both cameras' frames; 0: that of the first line of the frame, or of the frame
/// before.
int fpga_bridge_camera_expect(struct fpga_bridge *self, uint16_t width_pixels,
                              uint16_t height_lines);

/// Sets the pattern generator.
int fpga_bridge_camera_pattern(struct fpga_bridge *self, const struct fpga_bridge_pattern *pattern);

#ifdef __cplusplus
}
#endif

#endif
