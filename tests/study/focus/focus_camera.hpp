// SPDX-License-Identifier: Apache-2.0
/// A camera with a port of its own, which sees a scene through a lens that may be moving.
#ifndef VERGENCE_TESTS_FOCUS_FOCUS_CAMERA_HPP
#define VERGENCE_TESTS_FOCUS_FOCUS_CAMERA_HPP

#include <cstdint>
#include <utility>
#include <vector>

#include "blur_stack.hpp"
#include "focus_scene.hpp"
#include "focus_world.hpp"
#include "hal/camera.h"

namespace focus {

/// The sensor: electrons that fill a pixel, which is the full range at a gain of 1.
constexpr double kFullWellElectrons = 8500, kReadElectrons = 8;
constexpr int kBlack = 0, kValueMax = 1023;  ///< values that rig_region uses for such a camera
constexpr int kFramePx = 128;
/// The region that is focused on, in the middle.
constexpr int kRegionPx = 100, kMarginPx = (kFramePx - kRegionPx) / 2;
constexpr double kRowUs = 26, kReadoutUs = kFramePx * kRowUs, kFrameMinUs = 4000;

class FocusCamera {
  public:
    FocusCamera(const Scene &scene, const BlurStack &stack, FocusWorld &world, unsigned side);
    FocusCamera(const FocusCamera &) = delete;

    const hal_camera *port() const { return &port_; }
    unsigned frames() const { return frames_; }  ///< number of frames taken
    /// A frame of a lens at rest, without noise and flicker.
    std::vector<uint16_t> still(const Rings &rings) const;
    /// rms over mean above black of the green pixels in a frame's region.
    static double contrast(const std::vector<uint16_t> &frame);

  private:
    static FocusCamera &of(void *self) { return *static_cast<FocusCamera *>(self); }
    static int start(void *self, const hal_camera_format *format);
    static int stop(void *self);
    static int take(void *self, uint64_t not_before_us, uint64_t deadline_us,
                    hal_camera_frame *frame);
    static int control(void *self, hal_camera_control which, int32_t value, int32_t *applied);
    static void counts(void *self, hal_camera_counts *counts);

    double period_us() const { return std::max(exposure_us_, kFrameMinUs); }
    double flicker_at(double end_us) const;
    void expose(double begin_us, std::vector<uint16_t> &values);
    /// What a frame is made of: parts of levels of the stack for both depths; discs of lamps.
    struct Image {
        BlurMix mix[2];
        std::vector<std::pair<double, double>> discs;  ///< diameter of the blur, part
    };
    void mix_at(const Rings &rings, double part, Image &image) const;
    void draw_lamps(const Image &image, int y, double scale, float *row) const;
    void draw(const Image &image, const Rings &rings, double begin_us, bool noisy,
              std::vector<uint16_t> &values) const;
    void draw_row(const Image &image, int y, double scale, float *row) const;

    const Scene &scene_;
    const BlurStack &stack_;
    FocusWorld &world_;
    unsigned side_;
    double exposure_us_;
    unsigned gain_q3_;
    bool streaming_ = false;
    double origin_us_ = 0, last_begin_us_ = -1;
    unsigned frames_ = 0;
    std::vector<float> response_;  ///< response of each pixel: colour filter and differences
    mutable simrig::Noise noise_;
    hal_camera port_;
};

}  // namespace focus

#endif
