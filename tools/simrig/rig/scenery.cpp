// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/rig/scenery.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace simrig {

namespace {

// The first lit pixel of the physical array, in the sensor's count of rows and columns.
constexpr int kFirstRow = 20, kFirstColumn = 32;
constexpr uint16_t kDark = 42;

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
    still_ = {};  // another scene may be at the same address
}

double Stage::Light::at(double time_us) const {
    if (time_us >= end_us) {
        return to;
    }
    if (time_us <= begin_us) {
        return from;  // also of a change at once, while rows before it are exposed
    }
    return from + (to - from) * (time_us - begin_us) / (end_us - begin_us);
}

void Stage::set_light(double share, double begin_us, double end_us) {
    light_ = {light_.at(begin_us), share, begin_us, end_us};
}

void Stage::set_cap(int camera, bool on) {
    capped_[size_t(camera)] = on;
}

world::Mechanics Stage::mechanics(const CameraState &state) {
    world::Mechanics mechanics;
    mechanics.pan_rad = world::radians(state.pan_deg);
    mechanics.zoom = std::clamp(state.zoom, 300.0, 850.0);
    mechanics.focus = std::clamp(state.focus, 300.0, 850.0);
    mechanics.iris = std::clamp(state.iris, 300.0, 850.0);
    mechanics.warm = state.warm;
    return mechanics;
}

// Outputs whose array pixels all lie in the world's array.
Stage::Lit Stage::lit_part(int start, int skip, int bin, int outputs, int array) {
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

void Stage::ask(Asked &asked, const SensorFrame &frame, double begin_us) const {
    const int row_start = int(frame.row_start) - kFirstRow;
    const int column_start = int(frame.column_start) - kFirstColumn;
    const auto skip_x = int(frame.skip_columns), skip_y = int(frame.skip_rows);
    const auto bin_x = int(frame.bin_columns), bin_y = int(frame.bin_rows);
    // The scene is kept: it may be replaced before its truth is requested.
    asked.pictured = {int(frame.columns), int(frame.rows), scene_};
    asked.flip_columns = frame.flip_columns;
    asked.flip_rows = frame.flip_rows;
    asked.columns = lit_part(column_start, skip_x, bin_x, int(frame.columns), world::kArrayColumns);
    asked.rows = lit_part(row_start, skip_y, bin_y, int(frame.rows), world::kArrayRows);
    asked.ready = asked.columns.count > 0 && asked.rows.count > 0;
    world::FrameRequest &request = asked.request;
    request.window = {column_start + skip_x * asked.columns.begin,
                      row_start + skip_y * asked.rows.begin,
                      asked.columns.count * skip_x,
                      asked.rows.count * skip_y,
                      skip_x,
                      skip_y,
                      bin_x,
                      bin_y};
    request.exposure_us = std::max(frame.exposure_us, 1.0);
    for (size_t i = 0; i < 4; i++) {
        request.gains.analog[i] = frame.analog_gain[i];
        request.gains.digital[i] = frame.digital_gain[i];
    }
    request.row_time_us = frame.row_us;
    request.start_time_us = begin_us + asked.rows.begin * frame.row_us - request.exposure_us;
    request.seed = seed_;
    request.frame = frame.number;
    request.threads = threads_;
}

std::vector<uint16_t> Stage::picture(int camera, const SensorFrame &frame, double begin_us,
                                     const std::function<CameraState(double time_us)> &state) {
    std::vector<uint16_t> pixels(size_t(frame.columns) * frame.rows, kDark);
    Asked &asked = asked_[size_t(camera)];
    ask(asked, frame, begin_us);
    if (!asked.ready) {
        return pixels;
    }
    asked.request.mechanics = [&state](double time_us) { return mechanics(state(time_us)); };
    const bool capped = capped_[size_t(camera)];
    asked.request.light = [this, capped](double time_us) {
        return capped ? 0 : light_.at(time_us);
    };
    const world::Frame lit =
        world::render(*scene_, rig_, world::Side(camera), asked.request, &still_[size_t(camera)]);
    for (int row = 0; row < lit.rows; row++) {
        const auto from = lit.pixels.begin() + long(row) * lit.columns;
        std::copy(from, from + lit.columns,
                  pixels.begin() + long(row + asked.rows.begin) * long(frame.columns) +
                      asked.columns.begin);
    }
    // Truth is requested later, when the parts have moved: their state is saved.
    const world::Mechanics then = mechanics(state(begin_us));
    asked.request.mechanics = [then](double) { return then; };
    auto &remembered = remembered_[size_t(camera)];
    remembered.emplace_back(begin_us, asked);
    if (remembered.size() > kRemembered) {
        remembered.pop_front();
    }
    flip(pixels, frame);
    return pixels;
}

void Stage::recall(int camera, double begin_us) {
    const auto &remembered = remembered_[size_t(camera)];
    const auto nearest =
        std::min_element(remembered.begin(), remembered.end(), [=](const auto &a, const auto &b) {
            return std::fabs(a.first - begin_us) < std::fabs(b.first - begin_us);
        });
    if (nearest != remembered.end()) {
        asked_[size_t(camera)] = nearest->second;
    }
}

const Stage::Pictured *Stage::pictured(int camera) const {
    const Asked &asked = asked_[size_t(camera)];
    return asked.ready ? &asked.pictured : nullptr;
}

std::vector<float> Stage::depth_mm(int camera, const world::Window &part,
                                   const world::Mechanics &mechanics) const {
    world::FrameRequest request;
    request.window = part;
    request.mechanics = [&mechanics](double) { return mechanics; };
    return world::truth(*scene_, rig_, world::Side(camera), request).depth_mm;
}

world::Truth Stage::truth(int camera, int first_row, int rows) const {
    const Asked &asked = asked_[size_t(camera)];
    const int columns = asked.pictured.columns;
    world::Truth all;
    all.columns = columns;
    all.rows = rows;
    const world::Window &lit_window = asked.request.window;
    all.window = lit_window;
    all.window.column -= lit_window.skip_x * asked.columns.begin;
    all.window.row -= lit_window.skip_y * (asked.rows.begin - first_row);
    all.window.columns = lit_window.skip_x * columns;
    all.window.rows = lit_window.skip_y * rows;
    all.mirrored_x = asked.flip_columns;
    all.mirrored_y = asked.flip_rows;
    for (const auto &object : asked.pictured.scene->objects) {
        all.objects.push_back(object->name);
    }
    all.depth_mm.resize(size_t(columns) * size_t(rows));
    all.normal.resize(3 * all.depth_mm.size());
    all.id.resize(all.depth_mm.size());
    // Of the lit part, before it is mirrored: the pairs of rows that hold those.
    const int from = asked.flip_rows ? asked.pictured.rows - first_row - rows : first_row;
    const int begin = std::clamp(from - asked.rows.begin, 0, asked.rows.count) / 2 * 2;
    const int end = std::clamp(from + rows - asked.rows.begin + 1, 0, asked.rows.count) / 2 * 2;
    world::FrameRequest request = asked.request;
    all.cameras = {world::camera_at(rig_.of(world::Side(camera)), request.mechanics(0))};
    if (begin >= end) {
        return all;
    }
    request.window.row += request.window.skip_y * begin;
    request.window.rows = request.window.skip_y * (end - begin);
    const world::Truth lit =
        world::truth(*asked.pictured.scene, rig_, world::Side(camera), request);
    for (int row = 0; row < rows; row++) {
        const int lit_row =
            (asked.flip_rows ? from + rows - 1 - row : from + row) - asked.rows.begin - begin;
        for (int column = 0; column < columns && lit_row >= 0 && lit_row < lit.rows; column++) {
            const int lit_column =
                (asked.flip_columns ? columns - 1 - column : column) - asked.columns.begin;
            if (lit_column >= 0 && lit_column < lit.columns) {
                all.take(size_t(row * columns + column), lit,
                         size_t(lit_row * lit.columns + lit_column));
            }
        }
    }
    return all;
}

}  // namespace simrig
