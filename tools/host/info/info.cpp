// SPDX-License-Identifier: Apache-2.0
#include "tools/host/info/info.hpp"

#include <algorithm>
#include <cstdio>
#include <memory>

#include "daemon/files/input_file.h"
#include "tools/host/formats/report_text.hpp"

void info_page::add_number(const std::string &key, const std::string &label, double number,
                           int digits, const std::string &unit) {
    add(key, label, number_text(number, digits) + (unit.empty() ? "" : " " + unit), number);
}

std::string info_head(const std::string &path) {
    struct message last_error;  // reported when the whole file is read
    const std::unique_ptr<FILE, int (*)(FILE *)> stream(input_file_open(path.c_str(), &last_error),
                                                        std::fclose);
    char head[64];
    return stream == nullptr ? std::string()
                             : std::string(head, std::fread(head, 1, sizeof head, stream.get()));
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
