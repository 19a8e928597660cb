// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/rig/scenery.hpp"

#include <algorithm>
#include <utility>

namespace simrig {

namespace {

// The first lit pixel of the physical array, in the sensor's count of rows and columns.
constexpr int kFirstRow = 20, kFirstColumn = 32;
constexpr uint16_t kDark = 42;

// Outputs of an axis whose array pixels all lie in the world's array: from `begin` on, `count`.
struct Lit {
    int begin = 0, count = 0;
};

Lit lit_part(int start, int skip, int bin, int outputs, int array) {
    const auto first = [=](int output) { return start + skip * 2 * (output / 2) + output % 2; };
    Lit lit;
    while (lit.begin < outputs && first(lit.begin) < 0) {
        lit.begin += 2;
    }
    int end = outputs / 2 * 2;
    while (end > lit.begin && first(end - 1) + 2 * (bin - 1) >= array) {
        end -= 2;
    }
    lit.count = std::max(end - lit.begin, 0);
    return lit;
}

void flip(std::vector<uint16_t> &pixels, const SensorFrame &frame) {
    const auto columns = long(frame.columns), rows = long(frame.rows);
    if (frame.flip_columns) {
        for (long row = 0; row < rows; row++) {
            std::reverse(pixels.begin() + row * columns, pixels.begin() + (row + 1) * columns);
        }
    }
    if (frame.flip_rows) {
        for (long row = 0; row < rows / 2; row++) {
            std::swap_ranges(pixels.begin() + row * columns, pixels.begin() + (row + 1) * columns,
                             pixels.begin() + (rows - 1 - row) * columns);
        }
    }
}

}  // namespace

Stage::Stage(const std::string &scene, const std::string &rig, uint64_t seed, int threads)
    : Stage(std::make_shared<world::Scene>(world::load_scene(scene)), rig, seed, threads) {}

Stage::Stage(std::shared_ptr<world::Scene> scene, const std::string &rig, uint64_t seed,
             int threads)
    : rig_(world::load_rig(rig)), scene_(std::move(scene)), seed_(seed), threads_(threads) {}

void Stage::set_scene(std::shared_ptr<world::Scene> scene) {
    scene_ = std::move(scene);
}

world::Mechanics Stage::mechanics(const CameraState &state) {
    world::Mechanics mechanics;
    mechanics.pan_rad = world::radians(state.pan_deg);
    mechanics.zoom = std::clamp(state.zoom, 300.0, 850.0);
    mechanics.focus = std::clamp(state.focus, 300.0, 850.0);
    mechanics.iris = std::clamp(state.iris, 300.0, 850.0);
    return mechanics;
}

std::vector<uint16_t> Stage::picture(int camera, const SensorFrame &frame, double begin_us,
                                     const std::function<CameraState(double time_us)> &state) {
    const int row_start = int(frame.row_start) - kFirstRow;
    const int column_start = int(frame.column_start) - kFirstColumn;
    const auto skip_x = int(frame.skip_columns), skip_y = int(frame.skip_rows);
    const auto bin_x = int(frame.bin_columns), bin_y = int(frame.bin_rows);
    const Lit columns =
        lit_part(column_start, skip_x, bin_x, int(frame.columns), world::kArrayColumns);
    const Lit rows = lit_part(row_start, skip_y, bin_y, int(frame.rows), world::kArrayRows);
    std::vector<uint16_t> pixels(size_t(frame.columns) * frame.rows, kDark);
    Asked &asked = asked_[size_t(camera)];
    asked.ready = columns.count > 0 && rows.count > 0;
    if (!asked.ready) {
        return pixels;
    }
    asked.scene = scene_;  // another one may be set before its truth is asked for
    world::FrameRequest &request = asked.request;
    request.window.column = column_start + skip_x * columns.begin;
    request.window.row = row_start + skip_y * rows.begin;
    request.window.columns = columns.count * skip_x;
    request.window.rows = rows.count * skip_y;
    request.window.skip_x = skip_x;
    request.window.skip_y = skip_y;
    request.window.bin_x = bin_x;
    request.window.bin_y = bin_y;
    request.exposure_us = std::max(frame.exposure_us, 1.0);
    for (size_t i = 0; i < 4; i++) {
        request.gains.analog[i] = frame.analog_gain[i];
        request.gains.digital[i] = frame.digital_gain[i];
    }
    request.row_time_us = frame.row_us;
    request.start_time_us = begin_us + rows.begin * frame.row_us - request.exposure_us;
    request.mechanics = [&state](double time_us) { return mechanics(state(time_us)); };
    request.seed = seed_;
    request.frame = frame.number;
    request.threads = threads_;
    const world::Frame lit = world::render(*scene_, rig_, world::Side(camera), request);
    for (int row = 0; row < rows.count; row++) {
        const auto from = lit.pixels.begin() + long(row) * lit.columns;
        std::copy(from, from + lit.columns,
                  pixels.begin() + long(row + rows.begin) * long(frame.columns) + columns.begin);
    }
    // Truth is asked for later, when the moving parts have moved on: they are kept as they were.
    const world::Mechanics then = mechanics(state(begin_us));
    request.mechanics = [then](double) { return then; };
    flip(pixels, frame);
    return pixels;
}

bool Stage::truth(int camera, world::Truth &truth) const {
    const Asked &asked = asked_[size_t(camera)];
    if (asked.ready) {
        truth = world::truth(*asked.scene, rig_, world::Side(camera), asked.request);
    }
    return asked.ready;
}

}  // namespace simrig
