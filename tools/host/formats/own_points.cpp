// SPDX-License-Identifier: Apache-2.0
#include "tools/host/formats/own_points.hpp"

#include <cstdlib>
#include <map>
#include <string>

bool own_points_header(std::istream &stream, std::size_t *count, double *unit_mm) {
    static const std::map<std::string, double> units = {{"# lengths in millimetres", 1},
                                                        {"# lengths in centimetres", 10},
                                                        {"# lengths in metres", 1000}};
    bool fields = false;
    *count = 0;
    *unit_mm = 0;
    for (std::string line; std::getline(stream, line) && line.size() < 4096;) {
        const auto unit = units.find(line);
        *unit_mm = unit != units.end() ? unit->second : *unit_mm;
        fields = fields || line == "FIELDS x y z rgb sigma";
        if (line.compare(0, 7, "POINTS ") == 0) {
            *count = std::strtoul(line.c_str() + 7, nullptr, 10);
        }
        if (line == "DATA binary") {
            return fields && *unit_mm > 0;
        }
    }
    return false;
}
