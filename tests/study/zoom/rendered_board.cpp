// SPDX-License-Identifier: Apache-2.0
#include "tests/study/zoom/rendered_board.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "calib/detect/detect.hpp"
#include "stereo/develop.h"
#include "tests/study/zoom/trial.hpp"

namespace zoom_study {
namespace {

// Closed as far as the capture guide closes it.
constexpr double kIris = 340;

// The scene of the kept capture with its board anywhere.
class Room {
  public:
    Room()
        : scene_(world::load_scene(std::string(SIMRIG_FILES) +
                                   "/../../tests/data/zoom_capture/board.yaml")) {
        // The wall is nearer than the farthest boards.
        scene_.objects.erase(scene_.objects.begin());
    }

    void put_board(const world::Pose &world_board) {
        world::Object &board = *scene_.objects.front();
        if (world::length(board.middle_mm - world_board.translation_mm) > 0) {
            board.world_object = world_board;
            board.object_world = world::inverse(world_board);
            board.middle_mm = world_board.translation_mm;
            world::light_scene(scene_);
        }
    }

    const world::Scene &scene() const { return scene_; }

  private:
    world::Scene scene_;
};

// The frame's part around some pixels, on even places so that its colours stay.
world::Window window_around(const std::vector<calib::corner> &corners, double margin_px) {
    double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
    for (const calib::corner &corner : corners) {
        const double at[2] = {corner.x_px, corner.y_px};
        for (int i = 0; i < 2; i++) {
            low[i] = std::min(low[i], at[i] - margin_px);
            high[i] = std::max(high[i], at[i] + margin_px);
        }
    }
    world::Window window;
    window.column = int(std::clamp(low[0], 0.0, 2048.0) / 8) * 8;
    window.row = int(std::clamp(low[1], 0.0, 1536.0) / 8) * 8;
    window.columns = std::min(2048, int(high[0] / 8 + 1) * 8) - window.column;
    window.rows = std::min(1536, int(high[1] / 8 + 1) * 8) - window.row;
    return window;
}

// By how much longer a frame should be exposed for its whites to be at 70 %.
double exposure_factor(const std::function<world::Frame()> &render, world::Window *window) {
    constexpr int kBlack = 42, kWhite = 716, kSkip = 8;
    window->skip_x = window->skip_y = kSkip;
    std::vector<uint16_t> pixels = render().pixels;
    window->skip_x = window->skip_y = 1;
    std::sort(pixels.begin(), pixels.end());
    return double(kWhite - kBlack) / std::max(1, pixels[pixels.size() * 97 / 100] - kBlack);
}

std::vector<calib::corner> detect(const calib::board &board, const world::Frame &frame) {
    std::vector<uint8_t> grey = develop_grey(frame);
    const calib::board_view view =
        calib::detect_board(board, {grey.data(), frame.columns, frame.rows, frame.columns}, {});
    if (view.overexposed()) {
        throw std::runtime_error("a rendered board is overexposed");
    }
    return view.corners;
}

}  // namespace

std::vector<uint8_t> develop_grey(const world::Frame &frame) {
    raw_image raw = {};
    raw.data = frame.pixels.data();
    raw.width_px = frame.columns;
    raw.height_px = frame.rows;
    raw.stride = frame.columns;
    raw.bits = 10;
    raw.layout = RAW_BAYER_GRBG;
    const size_t pixels = size_t(frame.columns) * size_t(frame.rows);
    std::vector<uint8_t> grey(pixels), rgb(3 * pixels);
    Memory memory(develop_need_bytes(frame.columns, raw.bits, 1));
    image_u8 to = {grey.data(), frame.columns, frame.rows, frame.columns};
    image_rgb8 colour = {rgb.data(), frame.columns, frame.rows, 3 * frame.columns};
    const uint16_t one = DEVELOP_BALANCE_ONE;
    const develop_balance balance = {{one, one, one}};
    if (develop_image(&raw, &balance, &parallel_serial, &memory.pool, &to, &colour) != 0) {
        throw std::runtime_error("a frame cannot be developed");
    }
    return grey;
}

calib::zoom_observations rendered_capture(const std::string &name, uint64_t seed, int only) {
    StudyRig rig(name, seed, 0);
    Room room;
    int frames = 0;
    CapturePlan plan;
    plan.is_exact = true;
    plan.detect = [&](const calib::board &board, const world::Pose &world_board, int side,
                      const std::vector<calib::corner> &expected) {
        const int frame_number = frames++;
        if (only >= 0 && frame_number / 2 != only) {
            return expected;
        }
        room.put_board(world_board);
        world::FrameRequest request;
        world::Mechanics still = rig.mechanics(side);
        still.iris = kIris;
        const double n = world::optics_of(rig.world().camera[side].lens, 3.2, still).f_number;
        request.mechanics = [still](double) { return still; };
        request.frame = uint64_t(frame_number);
        const world::Camera camera = rig.camera(side);
        const double distance_mm =
            (world::inverse(camera.world_camera) * world_board.translation_mm).z;
        request.window = window_around(
            expected, std::max(40.0, 2.5 * 24 * camera.optics.focal_px / distance_mm));
        const auto render = [&] {
            return world::render(room.scene(), rig.world(), world::Side(side), request);
        };
        request.exposure_us = 850 * n * n;
        request.exposure_us *= exposure_factor(render, &request.window);
        std::vector<calib::corner> corners = detect(board, render());
        for (calib::corner &corner : corners) {
            corner.x_px += request.window.column;
            corner.y_px += request.window.row;
        }
        std::fprintf(stderr, "frame %d: %d x %d px, %zu of %zu corners, %.0f CPU s\n", frame_number,
                     request.window.columns, request.window.rows, corners.size(), expected.size(),
                     cpu_s());
        return corners;
    };
    return capture(rig, plan, seed + 1);
}

void write_corners(const calib::zoom_observations &seen, const std::string &path) {
    std::ofstream file(path);
    for (const calib::capture &pair : seen.captures) {
        char line[200];
        std::snprintf(line, sizeof line, "pair %d %d", pair.position, pair.visit);
        file << line;
        for (const calib::zoom_axes &axes : pair.axes) {
            std::snprintf(line, sizeof line, " %.3f %.3f %.9f", axes.zoom_counts, axes.focus_counts,
                          axes.pan_rad);
            file << line;
        }
        file << "\n";
        for (int side = 0; side < 2; side++) {
            for (const calib::corner &corner : pair.view[size_t(side)].corners) {
                std::snprintf(line, sizeof line, "%c %d %.3f %.3f %.4f\n", "lr"[side], corner.index,
                              corner.x_px, corner.y_px, corner.sigma_px);
                file << line;
            }
        }
    }
    if (!file.flush()) {
        throw std::runtime_error("cannot write " + path);
    }
}

calib::zoom_observations read_corners(const std::string &path) {
    std::ifstream file(path);
    if (!file) {
        throw std::runtime_error("cannot read " + path);
    }
    calib::zoom_observations seen = empty_observations();
    seen.reading_noise = false;
    std::string text;
    while (std::getline(file, text)) {
        std::istringstream line(text);
        std::string kind;
        line >> kind;
        if (kind == "pair") {
            calib::capture pair;
            line >> pair.position >> pair.visit;
            for (size_t side = 0; side < 2; side++) {
                calib::zoom_axes &axes = pair.axes[side];
                line >> axes.zoom_counts >> axes.focus_counts >> axes.pan_rad;
                pair.name[side] = kind + std::to_string(seen.captures.size());
            }
            seen.captures.push_back(pair);
        } else if (kind == "l" || kind == "r") {
            calib::corner corner;
            line >> corner.index >> corner.x_px >> corner.y_px >> corner.sigma_px;
            seen.captures.back().view[kind == "r"].corners.push_back(corner);
        }
        if (line.fail()) {
            throw std::runtime_error(path + ": " + text);
        }
    }
    return seen;
}

double corner_distance(const calib::zoom_observations &seen, const calib::zoom_observations &kept,
                       size_t pair) {
    double largest = 0;
    for (size_t side = 0; side < 2; side++) {
        const auto &one = seen.captures.at(pair).view[side].corners;
        const auto &other = kept.captures.at(pair).view[side].corners;
        if (one.size() != other.size()) {
            throw std::runtime_error("not the corners that are kept");
        }
        for (size_t i = 0; i < one.size(); i++) {
            const double dx = one[i].x_px - other[i].x_px, dy = one[i].y_px - other[i].y_px;
            largest =
                std::max(largest, std::hypot(dx, dy) + 1e9 * (one[i].index != other[i].index));
        }
    }
    return largest;
}

}  // namespace zoom_study
