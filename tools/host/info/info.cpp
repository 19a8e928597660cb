// SPDX-License-Identifier: Apache-2.0
#include "tools/host/info/info.hpp"

#include <algorithm>

#include "tools/host/formats/report_text.hpp"
#include "tools/host/formats/whole_file.hpp"

void info_page::add_number(const std::string &key, const std::string &label, double number,
                           int digits, const std::string &unit) {
    add(key, label, number_text(number, digits) + (unit.empty() ? "" : " " + unit), number);
}

std::string info_head(const std::string &path) {
    return whole_file_head(path, 64);
}

void info_bounds::take(const double point[3]) {
    for (int axis = 0; axis < 3; axis++) {
        min[axis] = count == 0 ? point[axis] : std::min(min[axis], point[axis]);
        greatest[axis] = count == 0 ? point[axis] : std::max(greatest[axis], point[axis]);
    }
    count++;
}

void info_bounds::add_to(info_page *page, const std::string &unit) const {
    static const char *const axes[] = {"x", "y", "z"};
    for (int axis = 0; axis < 3 && count > 0; axis++) {
        page->add(std::string("bounds_") + axes[axis], axis == 0 ? "extent" : "",
                  std::string(axes[axis]) + " " + number_text(min[axis], 6) + ".." +
                      number_text(greatest[axis], 6) + (unit.empty() ? "" : " " + unit),
                  nlohmann::ordered_json::array({min[axis], greatest[axis]}));
    }
}
