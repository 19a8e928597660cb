// SPDX-License-Identifier: Apache-2.0
/// The format is described on the page of the 2014 data sets ("calib.txt"): Z = baseline f / (d +
/// doffs), doffs = cx1 - cx0, lengths in mm, disparities 0..ndisp-1, vmin..vmax the range that
/// occurs.
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "tools/host/convert/import.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

double number(const import_file &file, const import_entries &all, const std::string &name) {
    const import_entry &found = import_require(file, all, name);
    return import_numbers(file, import_place(all, name), found.text, 1)[0];
}

int size_px(const import_file &file, const import_entries &all, const std::string &name) {
    const double value = number(file, all, name);
    if (!(value >= 1 && value <= 100000 && value == std::floor(value))) {
        import_fail(ERROR_RANGE, file,
                    import_place(all, name) + ": must be an integer number of pixels");
    }
    return static_cast<int>(value);
}

void read_camera(const import_file &file, const import_entries &all, const std::string &name,
                 lens *camera) {
    std::string text = import_require(file, all, name).text;
    std::replace(text.begin(), text.end(), '[', ' ');
    std::replace(text.begin(), text.end(), ']', ' ');
    const std::string where = import_place(all, name);
    import_camera_matrix(file, where, import_numbers(file, where, text, 9), camera);
}

/// The disparities stated in the file, as a range of depths. A depth beyond the grammar's limit
/// (1000 km) is treated as infinity.
void read_depth_range(const import_file &file, const import_entries &all, double doffs_px,
                      calibration *value) {
    double low_px, high_px;
    if (all.count("vmin") != 0 && all.count("vmax") != 0) {
        low_px = number(file, all, "vmin");
        high_px = number(file, all, "vmax");
    } else if (all.count("ndisp") != 0) {
        low_px = 0;
        high_px = number(file, all, "ndisp") - 1;
    } else {
        return;
    }
    if (!(low_px <= high_px) || !(high_px + doffs_px > 0)) {
        import_fail(ERROR_DISPARITY_RANGE, file,
                    "the disparities " + number_text(low_px, 6) + ".." + number_text(high_px, 6) +
                        " (vmin..vmax or 0..ndisp-1) are not a range in "
                        "front of the cameras");
    }
    static const double infinity_mm = 1e9;
    const double product = value->left.fx_px * -value->translation_right_left_mm[0];
    // One more pixel at either end: a range with equal ends is legal in the file.
    value->depth_near_mm = product / (high_px + 1 + doffs_px);
    value->depth_far_mm = low_px - 1 + doffs_px > product / infinity_mm
                              ? product / (low_px - 1 + doffs_px)
                              : infinity_mm;
}

}  // namespace

bool import_middlebury_matches(const std::string &text) {
    for (const import_line &line : import_lines(text)) {
        if (line.text.compare(0, 5, "cam0=") == 0) {
            return true;
        }
    }
    return false;
}

import_pair import_middlebury(const import_file &file, const import_options &) {
    const import_entries all = import_read_entries(file, '=', "NAME=VALUE, as in calib.txt");
    import_pair pair;
    pair.format = "Middlebury";
    pair.tag = "middlebury";
    calibration &value = pair.value;
    read_camera(file, all, "cam0", &value.left);
    read_camera(file, all, "cam1", &value.right);
    if (value.left.fx_px != value.right.fx_px || value.left.fy_px != value.right.fy_px ||
        value.left.cy_px != value.right.cy_px) {
        import_fail(ERROR_RANGE, file, "cam0 and cam1 must agree in fx, fy and cy");
    }
    const double doffs_px = number(file, all, "doffs");
    // Both are printed with three decimals, rounded independently.
    if (std::abs(value.right.cx_px - value.left.cx_px - doffs_px) > 0.0021) {
        import_fail(ERROR_RANGE, file,
                    import_place(all, "doffs") + ": is " + number_text(doffs_px, 9) +
                        ", but the principal points of cam0 and cam1 differ by " +
                        number_text(value.right.cx_px - value.left.cx_px, 9));
    }
    const double baseline_mm = number(file, all, "baseline");
    if (!(baseline_mm > 0)) {
        import_fail(ERROR_BASELINE, file, import_place(all, "baseline") + ": must be above 0 mm");
    }
    value.right.cx_px = value.left.cx_px + doffs_px;
    value.left.width_px = value.right.width_px = size_px(file, all, "width");
    value.left.height_px = value.right.height_px = size_px(file, all, "height");
    value.rectified = true;
    value.translation_right_left_mm[0] = -baseline_mm;
    read_depth_range(file, all, doffs_px, &value);
    return pair;
}
