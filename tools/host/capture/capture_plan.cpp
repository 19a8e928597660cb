// SPDX-License-Identifier: Apache-2.0
#include "tools/host/capture/capture_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/math.h"
#include "tools/host/formats/report_text.hpp"

namespace {

const double edge_px = 8;               // a corner nearer to the edge is not found
const double blur_allowed_mm = 0.0128;  // the detector finds corners with twice as much
const int cell_columns = 4, cell_rows = 3, cells_wanted = 3;
const double alike_deg = 20;

using vector3 = std::array<double, 3>;

vector3 turned(const vector3 &point, const double turn_deg[3]) {
    vector3 p = point;
    for (size_t axis = 0; axis < 3; axis++) {
        const double sine = std::sin(turn_deg[axis] * MATH_RAD_PER_DEGREE);
        const double cosine = std::cos(turn_deg[axis] * MATH_RAD_PER_DEGREE);
        const size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
        const double first = cosine * p[a] - sine * p[b];
        p[b] = sine * p[a] + cosine * p[b];
        p[a] = first;
    }
    return p;
}

/// Corners of a board at a place, in the frame of the point between the cameras.
std::vector<vector3> corners_at(const calib::board &board, const capture_place &place) {
    std::vector<vector3> corners;
    for (int row = 0; row < board.rows; row++) {
        for (int column = 0; column < board.columns; column++) {
            const vector3 flat = {(column - 0.5 * (board.columns - 1)) * board.square_mm,
                                  (row - 0.5 * (board.rows - 1)) * board.square_mm, 0};
            const vector3 p = turned(flat, place.turn_deg);
            corners.push_back({p[0] + place.x_mm, p[1] + place.y_mm, p[2] + place.z_mm});
        }
    }
    return corners;
}

int cell_of(const capture_optics &optics, double x_px, double y_px) {
    const int column = static_cast<int>(x_px * cell_columns / optics.width_px);
    const int row = static_cast<int>(y_px * cell_rows / optics.height_px);
    return std::clamp(row, 0, cell_rows - 1) * cell_columns +
           std::clamp(column, 0, cell_columns - 1);
}

bool is_inside(const capture_optics &optics, double x_px, double y_px) {
    return x_px > edge_px && y_px > edge_px && x_px < optics.width_px - edge_px &&
           y_px < optics.height_px - edge_px;
}

/// What a camera sees of the corners: pixels of those that are in the frame and sharp.
std::vector<std::array<double, 2>> seen(const capture_optics &optics,
                                        const std::vector<vector3> &corners, int side,
                                        double pan_deg, double focal_mm, double focused_mm) {
    std::vector<std::array<double, 2>> pixels;
    const double x0 = (side == 0 ? -0.5 : 0.5) * optics.baseline_mm;
    const double sine = std::sin(pan_deg * MATH_RAD_PER_DEGREE),
                 cosine = std::cos(pan_deg * MATH_RAD_PER_DEGREE);
    const double depth_mm =
        blur_allowed_mm * optics.f_number * focused_mm * focused_mm / (focal_mm * focal_mm);
    for (const vector3 &corner : corners) {
        const double x = cosine * (corner[0] - x0) - sine * corner[2];
        const double z = sine * (corner[0] - x0) + cosine * corner[2];
        const double scale = focal_mm / optics.pixel_mm / z;
        const double x_px = 0.5 * optics.width_px + scale * x;
        const double y_px = 0.5 * optics.height_px + scale * corner[1];
        if (is_inside(optics, x_px, y_px) && std::fabs(z - focused_mm) < depth_mm) {
            pixels.push_back({x_px, y_px});
        }
    }
    return pixels;
}

/// How much pixels say about a focal length: the sum of their squared distances from the middle,
/// in those of a corner of the frame.
double reach_of(const capture_optics &optics, const std::vector<std::array<double, 2>> &pixels) {
    const double x0 = 0.5 * optics.width_px, y0 = 0.5 * optics.height_px;
    double reach = 0;
    for (const auto &pixel : pixels) {
        const double x = pixel[0] - x0, y = pixel[1] - y0;
        reach += (x * x + y * y) / (x0 * x0 + y0 * y0);
    }
    return reach;
}

/// What these pixels add to what a camera has seen at a zoom.
double camera_gain(const capture_optics &optics, const capture_coverage::camera &camera,
                   const std::vector<std::array<double, 2>> &pixels) {
    const double missing = camera.boards < CAPTURE_BOARDS_WANTED ? 1.0 / (1 + camera.boards) : 0;
    const double known = reach_of(optics, camera.points);
    double gain = missing + 2 * std::log1p(reach_of(optics, pixels) / (1 + known));
    std::array<bool, CAPTURE_CELLS> hit{};
    for (const auto &pixel : pixels) {
        hit[static_cast<size_t>(cell_of(optics, pixel[0], pixel[1]))] = true;
    }
    for (size_t cell = 0; cell < CAPTURE_CELLS; cell++) {
        const int times = camera.cells[cell];
        gain += hit[cell] && times < cells_wanted ? 1.0 / (1 + 2 * times) : 0;
    }
    return gain;
}

/// Below 1 for a place like one before: at the same distance, or tilted the same way.
double novelty_of(const capture_place &place, const std::vector<capture_place> &tried) {
    const vector3 normal = turned({0, 0, 1}, place.turn_deg);
    double novelty = 1;
    for (const capture_place &before : tried) {
        const vector3 other = turned({0, 0, 1}, before.turn_deg);
        const double cosine = normal[0] * other[0] + normal[1] * other[1] + normal[2] * other[2];
        const bool near = std::fabs(std::log(before.z_mm / place.z_mm)) < 0.1;
        const bool alike = cosine > std::cos(alike_deg * MATH_RAD_PER_DEGREE);
        novelty *= (near ? 0.85 : 1) * (alike ? 0.7 : 1);
    }
    return novelty;
}

double gain_of(const capture_optics &optics, const std::vector<int> &zooms,
               const calib::board &board, const capture_coverage &covered,
               const std::array<double, 2> &pan_deg, const capture_place &place) {
    const std::vector<vector3> corners = corners_at(board, place);
    double gain = 0;
    for (size_t i = 0; i < zooms.size(); i++) {
        std::vector<std::array<double, 2>> pixels[2];
        for (int side = 0; side < 2; side++) {
            const double x0 = (side == 0 ? -0.5 : 0.5) * optics.baseline_mm;
            const double pan = place.aim
                                   ? std::atan2(place.x_mm - x0, place.z_mm) / MATH_RAD_PER_DEGREE
                                   : pan_deg[static_cast<size_t>(side)];
            pixels[side] = seen(optics, corners, side, pan, optics.focal_mm(zooms[i]), place.z_mm);
        }
        if (std::min(pixels[0].size(), pixels[1].size()) >= CAPTURE_CORNERS_MIN) {
            gain += camera_gain(optics, covered.zoom[i][0], pixels[0]) +
                    camera_gain(optics, covered.zoom[i][1], pixels[1]);
        }
    }
    return gain * novelty_of(place, covered.tried);
}

std::vector<capture_place> candidates(const capture_optics &optics, double near_mm, double far_mm) {
    std::vector<capture_place> places;
    const double shares[] = {0.75, 0.45, 0.15, 0};
    const double tilts[][2] = {{12, 14},  {-12, 14},  {12, -14}, {-12, -14}, {25, 25}, {-25, 25},
                               {25, -25}, {-25, -25}, {35, 5},   {-35, -5},  {5, 38},  {-5, -38}};
    const double field_x = 0.5 * optics.width_px * optics.pixel_mm / optics.focal_wide_mm;
    const double field_y = 0.5 * optics.height_px * optics.pixel_mm / optics.focal_wide_mm;
    for (int step = 0; step < 6; step++) {
        const double z = near_mm * std::pow(far_mm / near_mm, step / 5.0);
        for (const auto &tilt : tilts) {
            for (const double share : shares) {
                for (int quarter = 0; quarter < (share > 0.2 ? 4 : 1); quarter++) {
                    capture_place place;
                    place.aim = share < 0.2;
                    place.x_mm = (quarter % 2 == 0 ? -1 : 1) * share * field_x * z * 0.8;
                    place.y_mm =
                        (quarter / 2 == 0 ? -1 : 1) * (place.aim ? 0 : share) * field_y * z;
                    place.z_mm = z;
                    place.turn_deg[0] = tilt[0];
                    place.turn_deg[1] = tilt[1];
                    place.turn_deg[2] = 5 * (quarter - 1.5);
                    places.push_back(place);
                }
            }
        }
    }
    return places;
}

}  // namespace

double capture_optics::focal_mm(double counts) const {
    return focal_wide_mm +
           (focal_tele_mm - focal_wide_mm) * (counts - zoom_min) / (zoom_max - zoom_min);
}

std::vector<int> capture_zooms(const capture_optics &optics, double first, double last, int count) {
    std::vector<int> zooms;
    const double from = optics.focal_mm(first), to = optics.focal_mm(last);
    for (int i = 0; i < count; i++) {
        const double share = count > 1 ? static_cast<double>(i) / (count - 1) : 0;
        const double focal = from * std::pow(to / from, share);
        const double counts = optics.zoom_min + (focal - optics.focal_wide_mm) *
                                                    (optics.zoom_max - optics.zoom_min) /
                                                    (optics.focal_tele_mm - optics.focal_wide_mm);
        zooms.push_back(static_cast<int>(std::lround(counts)));
    }
    return zooms;
}

int capture_zoom_index(const std::vector<int> &zooms, double counts) {
    size_t best = 0;
    for (size_t i = 1; i < zooms.size(); i++) {
        best = std::fabs(zooms[i] - counts) < std::fabs(zooms[best] - counts) ? i : best;
    }
    return static_cast<int>(best);
}

bool capture_look_at(const calib::board &board, const calib::board_view &view, double focal_px,
                     capture_look *look) {
    // The best affine map from the board to the picture. The larger of its scales is that of
    // lengths across the tilt.
    double count = 0, mean[4] = {0, 0, 0, 0}, square[2][2] = {{0, 0}, {0, 0}}, cross[2][2] = {};
    const auto values = [&board](const calib::corner &c, double v[4]) {
        v[0] = c.index % board.columns * board.square_mm;
        v[1] = c.index / board.columns * board.square_mm;
        v[2] = c.x_px;
        v[3] = c.y_px;
    };
    for (const calib::corner &c : view.corners) {
        double v[4];
        values(c, v);
        count++;
        for (int i = 0; i < 4; i++) {
            mean[i] += (v[i] - mean[i]) / count;
        }
    }
    for (const calib::corner &c : view.corners) {
        double v[4];
        values(c, v);
        for (int i = 0; i < 2; i++) {
            for (int j = 0; j < 2; j++) {
                square[i][j] += (v[i] - mean[i]) * (v[j] - mean[j]);
                cross[i][j] += (v[2 + i] - mean[2 + i]) * (v[j] - mean[j]);
            }
        }
    }
    const double det = square[0][0] * square[1][1] - square[0][1] * square[1][0];
    if (count < 4 || det <= 1e-9 * square[0][0] * square[1][1]) {
        return false;
    }
    double a[2][2];
    for (int i = 0; i < 2; i++) {
        a[i][0] = (cross[i][0] * square[1][1] - cross[i][1] * square[0][1]) / det;
        a[i][1] = (cross[i][1] * square[0][0] - cross[i][0] * square[0][1]) / det;
    }
    const double sum =
        a[0][0] * a[0][0] + a[0][1] * a[0][1] + a[1][0] * a[1][0] + a[1][1] * a[1][1];
    const double area = std::fabs(a[0][0] * a[1][1] - a[0][1] * a[1][0]);
    const double root = std::sqrt(std::max(0.0, sum * sum / 4 - area * area));
    look->scale = std::sqrt(sum / 2 + root);
    look->distance_mm = focal_px / look->scale;
    look->tilt_deg =
        std::acos(std::min(1.0, area / (look->scale * look->scale))) / MATH_RAD_PER_DEGREE;
    look->x_px = mean[2];
    look->y_px = mean[3];
    return true;
}

int capture_corners_after_zoom(const capture_optics &optics, const calib::board_view &view,
                               double ratio) {
    const double x0 = 0.5 * optics.width_px, y0 = 0.5 * optics.height_px;
    return static_cast<int>(
        std::count_if(view.corners.begin(), view.corners.end(), [&](const calib::corner &c) {
            return is_inside(optics, x0 + (c.x_px - x0) * ratio, y0 + (c.y_px - y0) * ratio);
        }));
}

capture_coverage capture_coverage_of(const capture_optics &optics, const std::vector<int> &zooms,
                                     const std::vector<capture_shot> &shots) {
    capture_coverage coverage;
    coverage.zoom.resize(zooms.size());
    for (const capture_shot &shot : shots) {
        for (size_t side = 0; side < 2; side++) {
            const int index = capture_zoom_index(zooms, shot.axes[side].zoom_counts);
            capture_coverage::camera &camera = coverage.zoom[static_cast<size_t>(index)][side];
            std::array<bool, CAPTURE_CELLS> hit{};
            for (const calib::corner &c : shot.view[side].corners) {
                hit[static_cast<size_t>(cell_of(optics, c.x_px, c.y_px))] = true;
                camera.points.push_back({c.x_px, c.y_px});
            }
            camera.boards += shot.view[side].corners.size() >= CAPTURE_CORNERS_MIN;
            for (size_t cell = 0; cell < CAPTURE_CELLS; cell++) {
                camera.cells[cell] += hit[cell];
            }
        }
    }
    return coverage;
}

capture_place capture_next_place(const capture_optics &optics, const std::vector<int> &zooms,
                                 const calib::board &board, const capture_coverage &covered,
                                 const std::array<double, 2> &pan_deg, double near_mm,
                                 double far_mm) {
    capture_place best;
    double most = -1;
    for (const capture_place &place : candidates(optics, near_mm, far_mm)) {
        const double gain = gain_of(optics, zooms, board, covered, pan_deg, place);
        if (gain > most) {
            most = gain;
            best = place;
        }
    }
    return best;
}

std::vector<capture_place> capture_places_before(const capture_optics &optics,
                                                 const std::vector<int> &zooms,
                                                 const calib::board &board,
                                                 const std::vector<capture_shot> &shots,
                                                 double near_mm, double far_mm) {
    std::vector<capture_place> places;
    for (size_t i = 0; i < shots.size(); i++) {
        if (i > 0 && shots[i].position == shots[i - 1].position) {
            continue;
        }
        const auto end = shots.begin() + static_cast<std::ptrdiff_t>(i);
        capture_coverage covered = capture_coverage_of(optics, zooms, {shots.begin(), end});
        covered.tried = places;
        const auto &axes = shots[i].axes;
        places.push_back(capture_next_place(
            optics, zooms, board, covered,
            {axes[0].pan_rad * MATH_DEGREE_PER_RAD, axes[1].pan_rad * MATH_DEGREE_PER_RAD}, near_mm,
            far_mm));
    }
    return places;
}

std::string capture_place_text(const capture_place &place) {
    const auto sideways = [](double mm, const char *less, const char *more) {
        return report_text_format("%.0f mm %s", std::fabs(mm), mm < 0 ? less : more);
    };
    return report_text_format("%.0f mm away, ", place.z_mm) +
           sideways(place.x_mm, "left", "right") + ", " + sideways(place.y_mm, "up", "down") +
           report_text_format(", turned %.0f %.0f %.0f deg about right, down, forward",
                              place.turn_deg[0], place.turn_deg[1], place.turn_deg[2]);
}
