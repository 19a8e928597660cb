// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>

#include <cstddef>

#include "core/error.h"
#include "daemon/files/input_file.h"
#include "tools/host/info/info.hpp"

namespace {

/// Larger files are results.
const off_t calibration_max_bytes = 1 << 20;

bool exists(const std::string &path) {
    struct stat status;
    return stat(path.c_str(), &status) == 0;
}

/// Whether two names mean the same file.
bool is_same_file(const std::string &a, const std::string &b) {
    struct stat first, second;
    return stat(a.c_str(), &first) == 0 && stat(b.c_str(), &second) == 0 &&
           first.st_dev == second.st_dev && first.st_ino == second.st_ino;
}

/// What `path` and `next` are together, if they are the two files of one calibration, or "": the
/// name to load it by.
std::string joined(const std::string &path, const std::string &next,
                   const import_options &options) {
    for (const std::string &name : {path, next}) {
        struct stat status;
        if (stat(name.c_str(), &status) != 0 || !S_ISREG(status.st_mode) ||
            status.st_size > calibration_max_bytes) {
            return "";
        }
    }
    calibration value;
    calibration_file_report report;
    std::string message;
    if (calibration_file_load(path, options, &value, &report, &message) == ERROR_OK) {
        for (const std::string &file : report.files) {
            if (is_same_file(file, next) && !is_same_file(path, next)) {
                return path;
            }
        }
        return "";
    }
    const std::string both = path + "," + next;
    std::string next_message, both_message;
    if (calibration_file_load(next, options, &value, &report, &next_message) != ERROR_OK &&
        next_message == message) {
        return path;  // both names mean the same two files, whose error is reported once
    }
    return calibration_file_load(both, options, &value, &report, &both_message) == ERROR_OK ? both
                                                                                            : "";
}

}  // namespace

void info_join_pairs(const import_options &options, std::vector<std::string> *operands) {
    for (size_t i = 0; i + 1 < operands->size(); i++) {
        const std::string both = joined((*operands)[i], (*operands)[i + 1], options);
        if (!both.empty()) {
            (*operands)[i] = both;
            operands->erase(operands->begin() + static_cast<std::ptrdiff_t>(i) + 1);
        }
    }
}

std::vector<std::string> info_expand(const std::string &path) {
    if (!input_file_is_directory(path.c_str()) || !exists(path + "/result.json")) {
        return {path};
    }
    const std::string folder = path.back() == '/' ? path : path + "/";
    std::vector<std::string> files;
    for (const char *name : {"result.json", "disparity.pfm", "disparity.png", "depth.png",
                             "reasons.png", "reasons.pgm", "mesh.ply", "mesh.glb", "points.pcd"}) {
        if (exists(folder + name)) {
            files.push_back(folder + name);
        }
    }
    return files;
}
