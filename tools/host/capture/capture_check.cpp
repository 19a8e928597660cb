// SPDX-License-Identifier: Apache-2.0
#include "tools/host/capture/capture_check.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "tools/host/formats/report_text.hpp"

namespace {

const double growth_tolerance = 0.15;  // error of the picture's growth from one zoom to the next
const double sides_tolerance = 0.25;   // a board near one camera fills more of its picture
const double shift_allowed = 0.05;     // share of the frame's width that the centre may shift by
const int focus_px = 100;              // side of the region for autofocus
const double bright_share = 0.9;       // quantile of the white squares' pixels taken as their level
const char *const sides[2] = {"Left", "Right"};

/// Corners that both views have: their middles, and mean distances from these.
struct common_corners {
    int count = 0;
    double middle[2][2] = {{0, 0}, {0, 0}}, spread[2] = {0, 0};

    common_corners(const calib::board_view &before, const calib::board_view &after) {
        std::map<int, const calib::corner *> known;
        for (const calib::corner &one : before.corners) {
            known[one.index] = &one;
        }
        std::vector<std::array<const calib::corner *, 2>> pairs;
        for (const calib::corner &one : after.corners) {
            if (known.count(one.index) != 0) {
                pairs.push_back({known[one.index], &one});
            }
        }
        count = static_cast<int>(pairs.size());
        for (size_t i = 0; i < 2; i++) {
            for (const auto &pair : pairs) {
                middle[i][0] += pair[i]->x_px / count;
                middle[i][1] += pair[i]->y_px / count;
            }
            for (const auto &pair : pairs) {
                spread[i] +=
                    std::hypot(pair[i]->x_px - middle[i][0], pair[i]->y_px - middle[i][1]) / count;
            }
        }
    }
};

std::string moved() {
    return "the board or a camera moved during the position; its last pair was not kept (the same "
           "command continues with a new position)";
}

}  // namespace

double capture_whites(const calib::board &board, const calibrate_image &image,
                      const calib::board_view &view) {
    std::map<int, const calib::corner *> at;
    for (const calib::corner &one : view.corners) {
        at[one.index] = &one;
    }
    // Between the square's corner and that of the marker in it, if it has one. Which squares are
    // white need not be known: the brighter ones.
    const double inset = 0.3 * (1 - board.marker_mm / board.square_mm);
    std::vector<int> levels[2];
    for (const auto &[index, near] : at) {
        const auto opposite = at.find(index + board.columns + 1);
        if (index % board.columns + 1 == board.columns || opposite == at.end()) {
            continue;
        }
        const double x = near->x_px + inset * (opposite->second->x_px - near->x_px);
        const double y = near->y_px + inset * (opposite->second->y_px - near->y_px);
        const long column = std::clamp(std::lround(x), 0L, image.width_px - 1L);
        const long row = std::clamp(std::lround(y), 0L, image.height_px - 1L);
        levels[(index / board.columns + index % board.columns) % 2].push_back(
            image.grey[size_t(row * image.width_px + column)]);
    }
    int level = 0;
    for (std::vector<int> &one : levels) {
        std::sort(one.begin(), one.end());
        level = std::max(level, one.empty() ? 0 : one[size_t(bright_share * double(one.size()))]);
    }
    return static_cast<double>(level) / image.full_scale;
}

capture_region capture_region_of(const capture_optics &optics, const capture_shot &shot,
                                 const capture_windows &window_px) {
    const int size_min = 64;
    const double frame_px[2] = {double(optics.width_px), double(optics.height_px)};
    int begin[2], size[2];
    for (size_t axis = 0; axis < 2; axis++) {
        double low = HUGE_VAL, high = 0;
        for (size_t side = 0; side < 2; side++) {
            for (const calib::corner &c : shot.view[side].corners) {
                const double at = window_px[side][axis] + (axis == 0 ? c.x_px : c.y_px);
                low = std::min(low, at);
                high = std::max(high, at);
            }
        }
        const double first = std::min(window_px[0][axis], window_px[1][axis]);
        const double last = std::max(window_px[0][axis], window_px[1][axis]) + frame_px[axis];
        // Rows and columns come in pairs of colours.
        begin[axis] = static_cast<int>(std::clamp(low, first, last - size_min)) / 2 * 2;
        size[axis] = std::clamp(static_cast<int>(high - begin[axis]) / 2 * 2, size_min,
                                static_cast<int>(last) - begin[axis]);
    }
    return {begin[0], begin[1], size[0], size[1]};
}

capture_point capture_middle_corner(const capture_optics &optics, const calib::board_view &view,
                                    double ratio) {
    const double x0 = 0.5 * optics.width_px, y0 = 0.5 * optics.height_px;
    const auto off_px = [&](const calib::corner &c) {
        return std::hypot(c.x_px - x0, c.y_px - y0);
    };
    const auto nearest = std::min_element(
        view.corners.begin(), view.corners.end(),
        [&](const calib::corner &a, const calib::corner &b) { return off_px(a) < off_px(b); });
    return {x0 + ratio * (nearest->x_px - x0), y0 + ratio * (nearest->y_px - y0)};
}

std::string capture_check_sides(const capture_look look[2]) {
    const double ratio = look[1].distance_mm / look[0].distance_mm;
    if (std::max(ratio, 1 / ratio) <= 1 + sides_tolerance) {
        return "";
    }
    return report_text_format(
        "the lenses are not at the same zoom: the left picture shows the board %.2f times as large "
        "as the right one (a zoom's read-back is wrong, or the lenses are of different types)",
        ratio);
}

std::string capture_check_zoomed(const capture_optics &optics, const capture_shot &before,
                                 const capture_shot &after, double ratio) {
    const double centre[2] = {0.5 * optics.width_px, 0.5 * optics.height_px};
    for (size_t side = 0; side < 2; side++) {
        const common_corners common(before.view[side], after.view[side]);
        if (common.count < 4) {
            return moved();
        }
        const double growth = common.spread[1] / common.spread[0];
        if (std::fabs(growth / ratio - 1) > growth_tolerance) {
            return report_text_format(
                "%s lens: its picture grew %.2f times, its zoom's reading %.2f times (read-back "
                "constant or reversed, or wrong focal lengths in the profile)",
                sides[side], growth, ratio);
        }
        const auto off = [&](int axis) {
            return centre[axis] + (common.middle[0][axis] - centre[axis]) * ratio -
                   common.middle[1][axis];
        };
        if (std::hypot(off(0), off(1)) > shift_allowed * ratio * optics.width_px) {
            return moved();
        }
    }
    return "";
}

double capture_minutes(const std::vector<capture_shot> &shots) {
    double us = 0;
    for (size_t i = 0; i < shots.size(); i++) {
        const bool begins = i == 0 || shots[i].position != shots[i - 1].position;
        // The clock begins again when the instrument does.
        const uint64_t from_us = begins ? shots[i].begin_us : shots[i - 1].end_us;
        us += shots[i].end_us > from_us ? static_cast<double>(shots[i].end_us - from_us) : 0;
    }
    return us / 60e6;
}

std::string capture_focus_region(const capture_optics &optics, const capture_point &corner,
                                 const std::array<double, 2> &window_px) {
    const auto begin = [](double at, int limit, double window) {
        const double first = std::clamp(at - focus_px / 2.0, 0.0, double(limit - focus_px));
        return static_cast<int>(first + window) / 2 * 2;
    };
    return report_text_format("%d,%d,%d,%d", begin(corner.x_px, optics.width_px, window_px[0]),
                              begin(corner.y_px, optics.height_px, window_px[1]), focus_px,
                              focus_px);
}

bool capture_is_seen(const capture_shot &shot) {
    return std::min(shot.view[0].corners.size(), shot.view[1].corners.size()) >=
           CAPTURE_CORNERS_MIN;
}

std::string capture_not_seen(const capture_shot &shot) {
    std::string text;
    for (size_t side = 0; side < 2; side++) {
        const calib::board_view &view = shot.view[side];
        if (view.corners.size() < CAPTURE_CORNERS_MIN) {
            text += std::string("  ") + (side == 0 ? "left" : "right") + " camera: " +
                    (!view.rejection.empty() ? view.rejection : "fewer than 12 corners visible") +
                    "\n";
        }
    }
    return text;
}
