// SPDX-License-Identifier: Apache-2.0
#include "focus_camera.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace focus {
namespace {

constexpr double kPi = 3.14159265358979323846, kMainsHz = 100;
constexpr double kPartsMax = 1000, kGainMinQ3 = 8, kGainMaxQ3 = 1024;
constexpr double kDifferences = 0.008;  // rms part by which pixels differ
// Pixels of the texture from which a row is taken. The right camera's window shows another part of
// the texture, and so does what is at the other depth.
constexpr int kSourcePx = 160;
constexpr int kLeftOf[kSides] = {8, 84};
constexpr int kTopOf[2] = {10, 140};
// The blur jumps by no more than this from one moment of an exposure to the next.
constexpr double kBlurStepPx = 1.5;
constexpr int kMomentsMax = 24;

/// Normal deviates; a row starts anywhere in it.
const std::vector<float> &deviates() {
    static const std::vector<float> all = [] {
        simrig::Noise noise(1);
        std::vector<float> list(1 << 16);
        for (float &value : list) {
            value = float(noise.gauss());
        }
        return list;
    }();
    return all;
}

}  // namespace

FocusCamera::FocusCamera(const Scene &scene, const BlurStack &stack, FocusWorld &world,
                         unsigned side)
    : scene_(scene),
      stack_(stack),
      world_(world),
      side_(side),
      exposure_us_(scene.exposure_us),
      gain_q3_(unsigned(kGainMinQ3)),
      response_(kFramePx * kFramePx),
      noise_(scene.seed + 7 * scene.index + side) {
    static const hal_camera_operations operations = {start, stop, take, control, counts};
    port_ = {&operations, this};
    // Even rows G R, odd rows B G.
    const double filters[2][2] = {{1, 0.62}, {0.55, 1}};
    for (int y = 0; y < kFramePx; y++) {
        for (int x = 0; x < kFramePx; x++) {
            const double own = 1 + kDifferences * noise_.gauss();
            response_[std::size_t(y * kFramePx + x)] = float(filters[y % 2][x % 2] * own);
        }
    }
}

// ---- the image

/// What is in the image of a lens at rest with its rings there.
void FocusCamera::mix_at(const Rings &rings, double part, Image &image) const {
    const SceneSide &own = scene_.side[side_];
    const double spot_px = own.lens.spot_px(rings[simrig::kZoom], rings[simrig::kIris]);
    // The stack has the spot of the iris that the scene began with; a larger one is a disc of the
    // same rms.
    const double more = 16 * (spot_px * spot_px - stack_.spot_px() * stack_.spot_px());
    for (int far = 0; far < (scene_.two_depths ? 2 : 1); far++) {
        const double disc_px =
            own.lens.blur_px(rings[simrig::kFocus], rings[simrig::kZoom], rings[simrig::kIris],
                             far == 1 ? own.far_per_mm : own.per_mm);
        stack_.add(image.mix[far], std::sqrt(std::max(0.0, disc_px * disc_px + more)), part);
        if (far == 0 && !scene_.lamps.empty()) {
            image.discs.emplace_back(std::hypot(disc_px, 4 * spot_px), part);
        }
    }
}

/// A row of relative radiance. scale: of the image, against that in focus.
void FocusCamera::draw_row(const Image &image, int y, double scale, float *row) const {
    const BlurMix *mix = image.mix;
    constexpr int kSize = int(BlurStack::kSize);
    const double up = (y - kFramePx / 2) / scale;
    const int split_px = int(scene_.split * kFramePx);
    for (int far = 0; far < (scene_.two_depths ? 2 : 1); far++) {
        float source[kSourcePx] = {};
        const int from = (kTopOf[far] + kSourcePx / 2 + int(std::lround(up))) & (kSize - 1);
        for (std::size_t i = 0; i < mix[far].parts.size(); i++) {
            const float part = mix[far].parts[i];
            const float *level = stack_.level(mix[far].first + i) + from * kSize + kLeftOf[side_];
            for (int x = 0; x < kSourcePx && part != 0; x++) {
                source[x] += part * level[x];
            }
        }
        for (int x = far == 1 ? split_px : 0; x < kFramePx; x++) {
            const double across = (x - kFramePx / 2) / scale + kSourcePx / 2 + 0.5;
            row[x] = source[int(across)];
        }
    }
}

/// Adds a row of the lamps: a disc of uniform light convolved with that of the blur, with edges
/// that fall linearly from where both overlap fully to where they no longer do.
void FocusCamera::draw_lamps(const Image &image, int y, double scale, float *row) const {
    for (const Lamp &lamp : scene_.lamps) {
        for (const auto &[disc_px, part] : image.discs) {
            const double own_px = lamp.diameter_px, most = std::max(own_px, disc_px);
            const double least = std::min(own_px, disc_px);
            const double outer = (most + least) / 2, inner = (most - least) / 2;
            // As much light as in focus.
            const double peak =
                lamp.radiance * part * own_px * own_px / (most * most + least * least / 3);
            const double up = y - kFramePx / 2 - lamp.y_px * scale;
            const double reach = std::sqrt(std::max(0.0, outer * outer - up * up));
            const double middle = kFramePx / 2 + lamp.x_px * scale;
            const int first = int(std::clamp(middle - reach, 0.0, double(kFramePx)));
            const int last = int(std::clamp(middle + reach + 1, 0.0, double(kFramePx)));
            for (int x = first; x < last; x++) {
                const double far = std::hypot(x - middle, up);
                row[x] += float(peak * std::clamp((outer - far) / (outer - inner), 0.0, 1.0));
            }
        }
    }
}

/// Light that a row has which is read at this time, against light without flicker.
double FocusCamera::flicker_at(double end_us) const {
    if (scene_.flicker == 0) {
        return 1;
    }
    const double turns_per_us = 2 * kPi * kMainsHz * 1e-6, half = exposure_us_ * turns_per_us / 2;
    const double middle = (end_us - exposure_us_ / 2) * turns_per_us + scene_.flicker_phase;
    return 1 + scene_.flicker * std::sin(half) / half * std::sin(middle);
}

void FocusCamera::draw(const Image &image, const Rings &rings, double begin_us, bool noisy,
                       std::vector<uint16_t> &values) const {
    const SceneSide &own = scene_.side[side_];
    const double zoom = rings[simrig::kZoom];
    const double scale =
        own.lens.image_mm(rings[simrig::kFocus], zoom) / own.lens.image_mm(own.best_ring(), zoom);
    const double stops =
        own.lens.f_number(own.zoom, own.iris) / own.lens.f_number(zoom, rings[simrig::kIris]);
    const double light = scene_.electrons * exposure_us_ / scene_.exposure_us * stops * stops;
    const float per_electron =
        float((kValueMax - kBlack) / kFullWellElectrons * gain_q3_ / kGainMinQ3);
    constexpr float kFull = float(kFullWellElectrons), kRead = float(kReadElectrons);
    float row[kFramePx];
    for (int y = 0; y < kFramePx; y++) {
        draw_row(image, y, scale, row);
        draw_lamps(image, y, scale, row);
        const auto own_light = float(light * (noisy ? flicker_at(begin_us + kRowUs * y) : 1));
        const float *response = &response_[std::size_t(y * kFramePx)];
        const float *deviate = &deviates()[noise_.next() % (deviates().size() - kFramePx)];
        const float noise = noisy ? 1.0F : 0.0F;
        uint16_t *out = &values[std::size_t(y * kFramePx)];
        for (int x = 0; x < kFramePx; x++) {
            float electrons = std::max(0.0F, row[x] * own_light * response[x]);
            electrons += noise * std::sqrt(electrons + kRead * kRead) * deviate[x];
            electrons = std::min(electrons, kFull);
            const float value = float(kBlack) + 0.5F + electrons * per_electron;
            out[x] = uint16_t(std::clamp(value, 0.0F, float(kValueMax)));
        }
    }
}

/// A frame whose first row is read at begin_us. The lens may move while it is exposed.
void FocusCamera::expose(double begin_us, std::vector<uint16_t> &values) {
    const double end_us = begin_us + kReadoutUs / 2, open_us = end_us - exposure_us_;
    const SceneSide &own = scene_.side[side_];
    const double from = world_.rings_at(side_, open_us)[simrig::kFocus];
    const double to = world_.rings_at(side_, end_us)[simrig::kFocus];
    const double steps = std::abs(from - to) * own.px_per_count() / kBlurStepPx;
    const int moments = std::clamp(int(std::ceil(steps)), 1, kMomentsMax);
    Image image;
    for (int i = 0; i < moments; i++) {
        const double time_us = open_us + exposure_us_ * (i + 0.5) / moments;
        mix_at(world_.rings_at(side_, time_us), 1.0 / moments, image);
    }
    draw(image, world_.rings_at(side_, end_us - exposure_us_ / 2), begin_us, true, values);
}

std::vector<uint16_t> FocusCamera::still(const Rings &rings) const {
    std::vector<uint16_t> values(kFramePx * kFramePx);
    Image image;
    mix_at(rings, 1, image);
    draw(image, rings, 0, false, values);
    return values;
}

double FocusCamera::contrast(const std::vector<uint16_t> &frame) {
    double sum = 0, squares = 0;
    for (int y = kMarginPx; y < kFramePx - kMarginPx; y++) {
        for (int x = kMarginPx + y % 2; x < kFramePx - kMarginPx; x += 2) {
            const double value = frame[std::size_t(y * kFramePx + x)] - kBlack;
            sum += value;
            squares += value * value;
        }
    }
    constexpr double kCount = kRegionPx * kRegionPx / 2;
    const double mean = sum / kCount;
    return std::sqrt(std::max(0.0, squares / kCount - mean * mean)) / std::max(mean, 1.0);
}

// ---- the port

int FocusCamera::start(void *self, const hal_camera_format *format) {
    if (format->width_px != kFramePx || format->height_px != kFramePx) {
        return ERROR_UNSUPPORTED;
    }
    FocusCamera &me = of(self);
    me.streaming_ = true;
    me.origin_us_ = me.world_.lenses.now_us() + me.period_us();
    return ERROR_OK;
}

int FocusCamera::stop(void *self) {
    of(self).streaming_ = false;
    return ERROR_OK;
}

// The next frame of a regular series; of those that have come already, the source keeps one.
int FocusCamera::take(void *self, uint64_t not_before_us, uint64_t deadline_us,
                      hal_camera_frame *frame) {
    FocusCamera &me = of(self);
    if (!me.streaming_) {
        return ERROR_DEVICE;
    }
    const double period_us = me.period_us(), now_us = me.world_.lenses.now_us();
    double earliest_us = std::max(double(not_before_us), me.origin_us_);
    earliest_us = std::max(earliest_us, me.last_begin_us_ + 0.5 * period_us);
    earliest_us = std::max(earliest_us, now_us - kReadoutUs - period_us + 1);
    const double begin_us =
        me.origin_us_ + std::ceil((earliest_us - me.origin_us_) / period_us) * period_us;
    const double end_us = begin_us + kReadoutUs;
    if (end_us > double(deadline_us)) {
        me.world_.lenses.advance(double(deadline_us));
        return ERROR_TIMEOUT;
    }
    me.world_.lenses.advance(end_us);
    me.last_begin_us_ = begin_us;
    auto *values = new std::vector<uint16_t>(kFramePx * kFramePx);
    me.expose(begin_us, *values);
    frame->image = {values->data(),
                    kFramePx,
                    kFramePx,
                    kFramePx,
                    10,
                    RAW_BAYER_GRBG,
                    [](void *owner) { delete static_cast<std::vector<uint16_t> *>(owner); },
                    values};
    frame->sequence = me.frames_++;
    frame->faults = 0;
    frame->begin_us = uint64_t(begin_us);
    frame->end_us = uint64_t(end_us);
    return ERROR_OK;
}

int FocusCamera::control(void *self, hal_camera_control which, int32_t value, int32_t *applied) {
    FocusCamera &me = of(self);
    switch (which) {
        case HAL_CAMERA_EXPOSURE_US:
            me.exposure_us_ = std::clamp(double(value), 10.0, 1e6);
            *applied = int32_t(me.exposure_us_);
            break;
        case HAL_CAMERA_GAIN_PART:
            me.gain_q3_ =
                unsigned(kGainMinQ3 + value * (kGainMaxQ3 - kGainMinQ3) / kPartsMax + 0.5);
            *applied = value;
            break;
        case HAL_CAMERA_EXPOSURE_FOUND_US:
            *applied = int32_t(me.exposure_us_);
            return ERROR_OK;
        default:
            return ERROR_UNSUPPORTED;
    }
    // A frame that was being exposed is dropped.
    me.origin_us_ = me.world_.lenses.now_us() + me.period_us();
    return ERROR_OK;
}

void FocusCamera::counts(void *self, hal_camera_counts *counts) {
    *counts = {};
    counts->frames = of(self).frames_;
}

}  // namespace focus
