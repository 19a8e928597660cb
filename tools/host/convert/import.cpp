// SPDX-License-Identifier: Apache-2.0
#include "tools/host/convert/import.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/error.h"
#include "stereo/geometry/geometry.h"
#include "tools/host/formats/json_limited.hpp"
#include "tools/host/formats/report_text.hpp"

void import_fail(int code, const import_file &file, const std::string &what) {
    throw import_failure{code, file.path + ": " + what};
}

nlohmann::ordered_json import_json(const import_file &file) {
    bool too_deep;
    nlohmann::ordered_json root = json_limited(file.text, 32, &too_deep);
    if (too_deep || !root.is_object()) {
        import_fail(ERROR_SYNTAX, file,
                    too_deep ? "is nested too deeply" : "is not a complete JSON object");
    }
    return root;
}

std::vector<double> import_numbers(const import_file &file, const std::string &place,
                                   const std::string &text, size_t count) {
    std::vector<double> numbers;
    const char *at = text.data();
    const char *const end = at + text.size();
    const auto is_separator = [](char c) { return c == ' ' || c == '\t' || c == ',' || c == ';'; };
    while (true) {
        at = std::find_if_not(at, end, is_separator);
        if (at == end) {
            break;
        }
        if (*at == '+') {  // from_chars rejects a plus
            at++;
        }
        double value = 0;
        const auto read = std::from_chars(at, end, value);
        if (read.ec != std::errc() || !std::isfinite(value) ||
            (read.ptr != end && !is_separator(*read.ptr))) {
            import_fail(ERROR_SYNTAX, file,
                        place + ": value " + std::to_string(numbers.size() + 1) +
                            " is not a finite number");
        }
        numbers.push_back(value);
        at = read.ptr;
    }
    if (numbers.size() != count) {
        import_fail(ERROR_SYNTAX, file,
                    place + ": has " + std::to_string(numbers.size()) + " numbers instead of " +
                        std::to_string(count));
    }
    return numbers;
}

std::vector<import_line> import_lines(const std::string &text) {
    std::vector<import_line> lines;
    for (size_t begin = 0; begin < text.size();) {
        const size_t end = std::min(text.find('\n', begin), text.size());
        std::string line = text.substr(begin, end - begin);
        if (!line.empty() && line.back() == '\r') {
            line.pop_back();
        }
        lines.push_back({static_cast<int>(lines.size()) + 1, line});
        begin = end + 1;
    }
    return lines;
}

import_entries import_read_entries(const import_file &file, char separator,
                                   const std::string &form) {
    import_entries entries;
    for (const import_line &line : import_lines(file.text)) {
        if (line.text.find_first_not_of(" \t") == std::string::npos) {
            continue;
        }
        const size_t end = line.text.find(separator);
        const std::string where = "line " + std::to_string(line.number);
        if (end == std::string::npos) {
            import_fail(ERROR_SYNTAX, file, where + ": must be " + form);
        }
        const std::string name = line.text.substr(0, end);
        if (!entries.insert({name, {line.number, line.text.substr(end + 1)}}).second) {
            import_fail(ERROR_DUPLICATE, file, where + ": " + name + " is a duplicate");
        }
    }
    return entries;
}

const import_entry &import_require(const import_file &file, const import_entries &entries,
                                   const std::string &name) {
    const auto found = entries.find(name);
    if (found == entries.end()) {
        import_fail(ERROR_MISSING, file, name + " is missing");
    }
    return found->second;
}

std::string import_place(const import_entries &entries, const std::string &name) {
    return "line " + std::to_string(entries.at(name).line) + ", " + name;
}

double import_stated_unit_mm(const import_options &options) {
    if (options.unit == "mm") {
        return 1;
    }
    if (options.unit == "cm") {
        return 10;
    }
    return options.unit == "m" ? 1000 : 0;
}

double import_unit_mm(const import_options &options, double format_mm, import_pair *pair) {
    const double stated_mm = import_stated_unit_mm(options);
    pair->format_unit_mm = format_mm;
    if (stated_mm > 0) {
        return stated_mm;
    }
    return format_mm > 0 ? format_mm : 1;
}

void import_stated_size(const import_file &file, const std::string &format,
                        const import_options &options, import_pair *pair) {
    if (options.width_px <= 0 || options.height_px <= 0) {
        import_fail(ERROR_MISSING, file,
                    format + " does not state the image size: give it, --size WIDTHxHEIGHT");
    }
    for (lens *camera : {&pair->value.left, &pair->value.right}) {
        camera->width_px = options.width_px;
        camera->height_px = options.height_px;
    }
    pair->assumed.push_back("image size not stated: that of the images");
}

void import_camera_matrix(const import_file &file, const std::string &field,
                          const std::vector<double> &K, lens *camera) {
    if (K[3] != 0 || K[6] != 0 || K[7] != 0 || K[8] != 1) {
        import_fail(ERROR_RANGE, file,
                    field + " is not a camera matrix: it must be fx 0 cx, 0 fy cy, 0 0 1");
    }
    if (K[1] != 0) {
        import_fail(ERROR_RANGE, file,
                    field + ": skewed pixels (" + number_text(K[1], 6) +
                        ") are not supported: calibrate without skew");
    }
    if (!(K[0] > 0) || !(K[4] > 0)) {
        import_fail(ERROR_RANGE, file, field + ": the focal lengths must be above 0");
    }
    camera->fx_px = K[0];
    camera->fy_px = K[4];
    camera->cx_px = K[2];
    camera->cy_px = K[5];
}

namespace {

/// Whether any of D[begin, end) is not 0.
bool any_of(const std::vector<double> &D, int begin, int end) {
    return std::any_of(D.begin() + begin, D.begin() + end, [](double v) { return v != 0; });
}

/// The fourteen coefficients of OpenCV's order; rejects another number, and unsupported terms.
std::vector<double> checked_coefficients(const import_file &file, const std::string &field,
                                         const std::vector<double> &D) {
    static const size_t counts[] = {0, 4, 5, 8, 12, 14};
    if (std::find(std::begin(counts), std::end(counts), D.size()) == std::end(counts)) {
        import_fail(ERROR_SYNTAX, file,
                    field + ": has " + std::to_string(D.size()) +
                        " distortion coefficients (expected 4, 5 or 8: k1 k2 p1 p2 k3 k4 k5 k6)");
    }
    std::vector<double> all(14, 0.0);
    std::copy(D.begin(), D.end(), all.begin());
    if (any_of(all, 8, 12)) {
        import_fail(ERROR_DISTORTION, file,
                    field +
                        ": the thin prism model (s1..s4) is not supported: calibrate without "
                        "CALIB_THIN_PRISM_MODEL");
    }
    if (any_of(all, 12, 14)) {
        import_fail(ERROR_DISTORTION, file,
                    field +
                        ": the tilted sensor model (tau) is not supported: calibrate without "
                        "CALIB_TILTED_MODEL");
    }
    return all;
}

}  // namespace

void import_distortion(const import_file &file, const std::string &field,
                       const std::vector<double> &D, lens *camera) {
    const std::vector<double> all = checked_coefficients(file, field, D);
    camera->k1 = all[0];
    camera->k2 = all[1];
    camera->p1 = all[2];
    camera->p2 = all[3];
    camera->k3 = all[4];
    camera->k4 = all[5];
    camera->k5 = all[6];
    camera->k6 = all[7];
    camera->kind = any_of(all, 5, 8) ? LENS_RATIONAL : LENS_BROWN_CONRADY;
}

void import_equidistant(const import_file &file, const std::string &field,
                        const std::vector<double> &D, lens *camera) {
    if (D.size() != 4) {
        import_fail(ERROR_SYNTAX, file,
                    field + ": has " + std::to_string(D.size()) +
                        " distortion coefficients (the equidistant model has 4: k1 k2 k3 k4)");
    }
    camera->k1 = D[0];
    camera->k2 = D[1];
    camera->k3 = D[2];
    camera->k4 = D[3];
    camera->p1 = camera->p2 = camera->k5 = camera->k6 = 0;
    camera->kind = LENS_EQUIDISTANT;
}

void import_pose(const import_file &file, const std::string &field, const std::vector<double> &R,
                 const double translation_mm[3], calibration *value) {
    if (geometry_vector_from_rotation(R.data(), value->rotation_right_left_rad) != ERROR_OK) {
        import_fail(ERROR_ROTATION, file,
                    field +
                        " is not a rotation: its rows must be orthogonal, of length 1 and "
                        "right-handed");
    }
    std::copy(translation_mm, translation_mm + 3, value->translation_right_left_mm);
}

void import_common_pose(const import_file &file, const std::string &field,
                        const import_matrix4 &left, const import_matrix4 &right, bool from_common,
                        double unit_mm, calibration *value) {
    std::vector<double> R_side[2], t_side[2];
    for (const import_matrix4 *side : {&left, &right}) {
        const import_matrix4 &T = *side;
        const std::vector<double> R = {T[0], T[1], T[2], T[4], T[5], T[6], T[8], T[9], T[10]};
        const double t[3] = {T[3], T[7], T[11]};
        double checked[3];
        if (geometry_vector_from_rotation(R.data(), checked) != ERROR_OK) {
            import_fail(ERROR_ROTATION, file,
                        field +
                            " is not a rotation: its rows must be orthogonal, of length 1 and "
                            "right-handed");
        }
        // Both as R p_common + t.
        std::vector<double> turn = R, shift(t, t + 3);
        if (!from_common) {
            turn = {R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8]};
            geometry_rotate(turn.data(), t, shift.data());
            for (double &value_of_axis : shift) {
                value_of_axis = -value_of_axis;
            }
        }
        R_side[side == &right] = turn;
        t_side[side == &right] = shift;
    }
    // p_right = R_right R_left^T (p_left - t_left) + t_right.
    const std::vector<double> &L = R_side[0];
    const double R_common_left[9] = {L[0], L[3], L[6], L[1], L[4], L[7], L[2], L[5], L[8]};
    std::vector<double> R_right_left(9);
    double turned[3], t_mm[3];
    geometry_multiply(R_side[1].data(), R_common_left, R_right_left.data());
    geometry_rotate(R_right_left.data(), t_side[0].data(), turned);
    for (size_t i = 0; i < 3; i++) {
        t_mm[i] = (t_side[1][i] - turned[i]) * unit_mm;
    }
    import_pose(file, field, R_right_left, t_mm, value);
}

void import_projections(const import_file &file, const std::string &field,
                        const std::vector<double> &P_left, const std::vector<double> &P_right,
                        double unit_mm, import_pair *pair) {
    double t_mm[2][3];
    lens *const lenses[2] = {&pair->value.left, &pair->value.right};
    for (int side = 0; side < 2; side++) {
        const std::vector<double> &P = side == 0 ? P_left : P_right;
        import_camera_matrix(file, field, {P[0], P[1], P[2], P[4], P[5], P[6], P[8], P[9], P[10]},
                             lenses[side]);
        const lens &camera = *lenses[side];
        t_mm[side][2] = P[11] * unit_mm;
        t_mm[side][0] = (P[3] * unit_mm - camera.cx_px * t_mm[side][2]) / camera.fx_px;
        t_mm[side][1] = (P[7] * unit_mm - camera.cy_px * t_mm[side][2]) / camera.fy_px;
    }
    const lens &left = pair->value.left, &right = pair->value.right;
    const double tolerance = 1e-9 * left.fx_px;
    if (std::abs(left.fx_px - right.fx_px) > tolerance ||
        std::abs(left.fy_px - right.fy_px) > tolerance ||
        std::abs(left.cy_px - right.cy_px) > tolerance) {
        import_fail(ERROR_RANGE, file,
                    field + ": the projections of a rectified pair must agree in fx, fy and cy");
    }
    const double across_mm = t_mm[0][0] - t_mm[1][0];
    const double off_mm = std::hypot(t_mm[0][1] - t_mm[1][1], t_mm[0][2] - t_mm[1][2]);
    if (!(across_mm > 0) || off_mm > 0.05 * across_mm) {
        import_fail(
            ERROR_BASELINE, file,
            field +
                ": the right camera must be to the right of the left one, but "
                "is at x " +
                number_text(across_mm, 6) + " mm, " + number_text(off_mm, 6) +
                " mm off that line: are they swapped (then name two files RIGHT,LEFT), or one "
                "above the other?");
    }
    if (off_mm > 1e-6 * across_mm) {
        pair->assumed.push_back("rows correspond, although the projections put the right camera " +
                                number_text(off_mm, 3) + " mm off the baseline");
    }
    pair->value.right.fx_px = left.fx_px;
    pair->value.right.fy_px = left.fy_px;
    pair->value.right.cy_px = left.cy_px;
    pair->value.rectified = true;
    pair->value.translation_right_left_mm[0] = -across_mm;
}

// With T the right P's translation over its focal lengths, R_right p_right = R_left p_left + T.
void import_rectification(const import_file &file, const std::array<const char *, 2> &fields,
                          const import_rectified_camera &left, const import_rectified_camera &right,
                          double unit_mm, calibration *value) {
    const std::string rotation = fields[0], projection = fields[1];
    const std::vector<double> &P = right.P, &P0 = left.P;
    if (!(P[0] > 0) || !(P[5] > 0) || !(P0[0] > 0) || !(P0[5] > 0)) {
        import_fail(ERROR_RANGE, file, projection + ": focal lengths must be above 0");
    }
    const double T_mm[3] = {(P[3] / P[0] - P0[3] / P0[0]) * unit_mm,
                            (P[7] / P[5] - P0[7] / P0[5]) * unit_mm, 0};
    if (T_mm[0] == 0 && T_mm[1] == 0) {
        import_fail(ERROR_BASELINE, file,
                    projection +
                        ": no baseline: its fourth column must be "
                        "-fx * baseline in metres, as a stereo calibration writes it");
    }
    if (T_mm[0] > 0 && std::abs(T_mm[0]) > std::abs(T_mm[1])) {
        import_fail(ERROR_BASELINE, file,
                    projection +
                        ": the right camera is to the left of the left one: are they "
                        "swapped? Then name two files RIGHT,LEFT");
    }
    double checked[3];
    for (const import_rectified_camera *side : {&left, &right}) {
        if (geometry_vector_from_rotation(side->R.data(), checked) != ERROR_OK) {
            import_fail(ERROR_ROTATION, file,
                        rotation + " (of it or its partner) is not a rotation");
        }
    }
    const std::vector<double> &R = right.R;
    const double R_right_rect[9] = {R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8]};
    std::vector<double> R_right_left(9);
    double t_mm[3];
    geometry_multiply(R_right_rect, left.R.data(), R_right_left.data());
    geometry_rotate(R_right_rect, T_mm, t_mm);
    import_pose(file, rotation, R_right_left, t_mm, value);
}
