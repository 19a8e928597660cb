// SPDX-License-Identifier: Apache-2.0
/// Two forms: calib_cam_to_cam.txt of the raw recordings and the 2015 benchmark (per camera S K D R
/// T of the raw and S_rect R_rect P_rect of the rectified images), and calib.txt of odometry and
/// the 2012 benchmark (P0..P3 only). Cameras 0 and 1 are grey, 2 and 3 colour; even ones are on the
/// left; lengths in m. Source: Geiger et al., "Vision meets robotics: the KITTI dataset", IJRR
/// 2013.
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "stereo/geometry/geometry.h"
#include "tools/host/convert/import.hpp"

namespace {

/// The file's lines NAME: VALUES.
struct kitti {
    const import_file &file;
    import_entries all;

    bool has(const std::string &name) const { return all.count(name) != 0; }

    std::string place(const std::string &name) const { return import_place(all, name); }

    std::vector<double> numbers(const std::string &name, size_t count) const {
        const import_entry &entry = import_require(file, all, name);
        return import_numbers(file, place(name), entry.text, count);
    }
};

void set_size(const kitti &from, const std::string &name, lens *camera) {
    const std::vector<double> size_px = from.numbers(name, 2);
    for (const double side_px : size_px) {
        if (!(side_px >= 1 && side_px <= 100000 && side_px == std::floor(side_px))) {
            import_fail(ERROR_RANGE, from.file,
                        from.place(name) + ": must be integer numbers of pixels");
        }
    }
    camera->width_px = static_cast<int>(size_px[0]);
    camera->height_px = static_cast<int>(size_px[1]);
}

bool size_is(const kitti &from, const std::string &name, const import_options &options) {
    if (!from.has(name)) {
        return false;
    }
    const std::vector<double> size_px = from.numbers(name, 2);
    return size_px[0] == options.width_px && size_px[1] == options.height_px;
}

/// Raw images of the recordings: both cameras are given relative to camera 0.
void read_raw(const kitti &from, const std::string &left, const std::string &right, double unit_mm,
              import_pair *pair) {
    import_matrix4 T_side[2];
    lens *const lenses[2] = {&pair->value.left, &pair->value.right};
    for (int side = 0; side < 2; side++) {
        const std::string &camera = side == 0 ? left : right;
        set_size(from, "S_" + camera, lenses[side]);
        import_camera_matrix(from.file, "K_" + camera, from.numbers("K_" + camera, 9),
                             lenses[side]);
        import_distortion(from.file, "D_" + camera, from.numbers("D_" + camera, 5), lenses[side]);
        const std::vector<double> R = from.numbers("R_" + camera, 9);
        const std::vector<double> t = from.numbers("T_" + camera, 3);
        T_side[side] = {R[0], R[1], R[2], t[0], R[3], R[4], R[5], t[1],
                        R[6], R[7], R[8], t[2], 0,    0,    0,    1};
    }
    import_common_pose(from.file, "R_" + left + " and R_" + right, T_side[0], T_side[1], true,
                       unit_mm, &pair->value);
}

void read_rectified(const kitti &from, const std::string &left, const std::string &right,
                    const std::string &size_prefix, double unit_mm, const import_options &options,
                    import_pair *pair) {
    const std::vector<double> P_left = from.numbers(left, 12);
    const std::vector<double> P_right = from.numbers(right, 12);
    import_projections(from.file, left + " and " + right, P_left, P_right, unit_mm, pair);
    if (!size_prefix.empty()) {
        set_size(from, size_prefix + left.substr(left.size() - 2), &pair->value.left);
        set_size(from, size_prefix + right.substr(right.size() - 2), &pair->value.right);
        return;
    }
    import_stated_size(from.file, "this KITTI file", options, pair);
}

/// calib_time: 09-Jan-2012 13:57:47
void read_date(const kitti &from, calibration *value) {
    static const char months[] = "JanFebMarAprMayJunJulAugSepOctNovDec";
    if (!from.has("calib_time")) {
        return;
    }
    const std::string &text = from.all.at("calib_time").text;
    const size_t begin = text.find_first_not_of(' ');
    if (begin == std::string::npos || text.size() < begin + 11 || text[begin + 2] != '-' ||
        text[begin + 6] != '-') {
        return;
    }
    const std::string name = text.substr(begin + 3, 3);
    const char *const month = std::strstr(months, name.c_str());
    if (month == nullptr || (month - months) % 3 != 0) {
        return;
    }
    const std::string number = std::to_string(100 + (month - months) / 3 + 1).substr(1);
    const std::string date = text.substr(begin + 7, 4) + "-" + number + "-" + text.substr(begin, 2);
    for (const char c : date) {
        if (c != '-' && (c < '0' || c > '9')) {
            return;
        }
    }
    std::memcpy(value->date, date.c_str(), sizeof value->date);
}

}  // namespace

bool import_kitti_matches(const std::string &text) {
    for (const import_line &line : import_lines(text)) {
        for (const char *name : {"P0:", "P2:", "P_rect_00:", "P_rect_02:", "K_00:", "K_02:"}) {
            if (line.text.compare(0, std::strlen(name), name) == 0) {
                return true;
            }
        }
    }
    return false;
}

import_pair import_kitti(const import_file &file, const import_options &options) {
    const kitti from = {file, import_read_entries(file, ':', "NAME: VALUES")};
    import_pair pair;
    pair.format = "KITTI";
    pair.tag = "kitti";
    const bool bare = from.has("P0") || from.has("P2");
    const bool colour = from.has("P2") || from.has("P_rect_02") || from.has("K_02");
    const int usual = colour ? 2 : 0;
    const int first = options.first_camera >= 0 ? options.first_camera : usual;
    const std::string left = std::to_string(first), right = std::to_string(first + 1);
    pair.assumed.push_back("left image of camera " + left + ", right of camera " + right);
    const std::string left2 = "0" + left, right2 = "0" + right;
    const double unit_mm = import_unit_mm(options, metre_mm, &pair);
    read_date(from, &pair.value);
    if (bare) {
        read_rectified(from, "P" + left, "P" + right, "", unit_mm, options, &pair);
        return pair;
    }
    const bool raw = !options.rectified && size_is(from, "S_" + left2, options) &&
                     !size_is(from, "S_rect_" + left2, options);
    if (raw) {
        read_raw(from, left2, right2, unit_mm, &pair);
        pair.assumed.push_back("images of the raw size are not rectified");
    } else {
        read_rectified(from, "P_rect_" + left2, "P_rect_" + right2, "S_rect_", unit_mm, options,
                       &pair);
        pair.assumed.push_back("images are the rectified ones");
    }
    return pair;
}
