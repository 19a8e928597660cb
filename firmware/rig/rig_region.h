// SPDX-License-Identifier: Apache-2.0
/// A small, fast view of one camera, for searches: frames as fast as the exposure allows, also
/// while a lens moves. Afterwards the camera is as it was before.
///
/// Behind the bridge the sensor reads only the region, with its shortest blanking, and the bridge
/// passes only this camera; the other camera is left alone. Exposure times stay as they are. A
/// camera with its own port has no windows: it sends whole frames, of which a region is a part; an
/// exposure or gain that such a camera does not report cannot be put back.
///
/// After an error of a part `last_error` names it and the rig is RIG_SAFE; the next bring-up sets
/// the camera. ERROR_CANCELLED, ERROR_FRAME and ERROR_MEMORY leave the rig ready, and the region
/// running until rig_region_end.
///
/// Measured in the simulated rig (sensor clock 48 MHz, 100 x 100 px): 450 frames a second at an
/// exposure of 0.5 ms (every second one that the sensor sends, as the bridge's counters are read
/// after each), 199 at 5 ms; the first one 90 to 100 ms after the begin, from a full window of
/// 128 x 96 px with 20 ms; the end takes 2.5 ms, and the frames after it count two frames later.
#ifndef VERGENCE_RIG_RIG_REGION_H
#define VERGENCE_RIG_RIG_REGION_H

#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A frame of a region. Times are on the hal_clock.
struct rig_region_frame {
    struct raw_image image;  ///< the region; the caller releases it
    /// Middle of the exposure of its middle row. Of a camera with its own port to half a frame
    /// period, as only one end of its frames has a time.
    uint64_t exposed_us;
    uint32_t exposure_us;  ///< 0: not known (a camera with its own port)
    uint16_t gain_q3;      ///< 0: not known
    uint16_t black;        ///< value of black pixels; 0 for a camera with its own port
};

/// A running region. The caller owns it; all fields are rig_region's.
struct rig_region {
    bool running;
    unsigned side;
    struct rig_rectangle where_px;
    uint8_t skip;  ///< skip in force; 1 for a camera with its own port
    uint16_t black;
    struct fpga_bridge_camera counted;  ///< record of the bridge up to the last frame
    uint64_t counted_us;                ///< frames must begin later, as an earlier one was damaged
    // As before rig_region_begin.
    struct mt9t001 sensor;
    struct hal_camera_format format;
    uint32_t exposure_us, initial_exposure_us;
    uint16_t gain_q3, initial_gain_q3;
};

/// Starts a region of a camera. `where_px`: its place on the whole sensor (2048 x 1536 px),
/// whatever the present window is; of a camera with its own port, in its frames of the present
/// size. Column and row are even, width and height multiples of 2 * `skip` (1 .. 8; every skip-th
/// pair of columns and rows is read). Cameras with their own ports ignore `skip`. ERROR_RANGE: no
/// such region, `rejected` has the limits; ERROR_NOT_READY; else as above. After an error no region
/// runs, and everything is as before. Lasts two frames of the present window.
int rig_region_begin(struct rig *self, struct rig_region *region, unsigned side,
                     const struct rig_rectangle *where_px, uint8_t skip);

/// With a region of each camera running, both of one size: passes the frames of this one from now
/// on, as beginning it did. They are ended in the reverse order of their begins.
int rig_region_choose(struct rig *self, struct rig_region *region);

/// Takes the next complete frame that has the present settings, and of which no row was exposed
/// before `not_before_us` (0: the next one). Damaged frames are dropped; ERROR_FRAME: two in a row.
int rig_region_take(struct rig *self, struct rig_region *region, uint64_t not_before_us,
                    struct rig_region_frame *frame);

/// Noise of a frame's values: that of an MT9T001, for frames of fewer bits in their unit. `gain_q3`
/// of the frame counts if `gain_is_factor`, as behind the bridge; else that of gain 1 is assumed.
struct focus_noise rig_region_noise(const struct rig_region_frame *frame, bool gain_is_factor);

/// As rig_exposure and rig_gain for this camera; all frames taken afterwards have the new value.
int rig_region_exposure(struct rig *self, struct rig_region *region, uint32_t exposure_us,
                        uint32_t *applied_us);
int rig_region_gain(struct rig *self, struct rig_region *region, uint16_t gain_q3,
                    uint16_t *applied_q3);

/// Ends a region: window, blanking, size of the frames, exposure and gain are as before the region,
/// register by register. `keep_settings`: exposure and gain stay, the exposure as closely as whole
/// rows of the window allow. To be called after every rig_region_begin, also after errors; without
/// a running region, or with the rig safe, it does nothing. Does not wait and cannot be cancelled.
int rig_region_end(struct rig *self, struct rig_region *region, bool keep_settings);

#ifdef __cplusplus
}
#endif

#endif
