// SPDX-License-Identifier: Apache-2.0
#include "tools/host/convert/export.hpp"

#include <cstdio>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/atomic_dir.h"
#include "daemon/files/output_file.h"

namespace {

struct format {
    const char *name;
    std::vector<export_file> (*make)(const calibration &);
};

const format formats[] = {
    {"opencv", export_opencv},
    {"ros", export_ros},
    {"kalibr", export_kalibr},
    {"mrcal", export_mrcal},
};

int write_files(const atomic_dir &directory, const std::vector<export_file> &files, message *why) {
    for (const export_file &file : files) {
        char path[ATOMIC_DIR_PATH_BYTES];
        atomic_dir_file_path(&directory, file.name.c_str(), path);
        output_file out;
        output_file_open(&out, path);
        output_file_write(&out, file.text.data(), file.text.size());
        const int code = output_file_close(&out, why);
        if (code != ERROR_OK) {
            atomic_dir_name_final(&directory, why);
            return code;
        }
    }
    return ERROR_OK;
}

}  // namespace

const char *const export_formats = "opencv ros kalibr mrcal";

int export_files(const calibration &value, const std::string &format,
                 std::vector<export_file> *files, std::string *message) {
    for (const auto &known : formats) {
        if (format == known.name) {
            try {
                *files = known.make(value);
                return ERROR_OK;
            } catch (const export_failure &failure) {
                *message = failure.message;
                return failure.code;
            }
        }
    }
    *message = "unknown export format \"" + format + "\" (expected one of: " + export_formats + ")";
    return ERROR_ARGUMENT;
}

int export_write(const calibration &value, const std::string &format, const std::string &directory,
                 std::vector<std::string> *paths, std::string *loss, std::string *message) {
    std::vector<export_file> files;
    const int code = export_files(value, format, &files, message);
    return code != ERROR_OK ? code : export_write_files(files, directory, paths, loss, message);
}

int export_write_files(const std::vector<export_file> &files, const std::string &directory,
                       std::vector<std::string> *paths, std::string *loss, std::string *message) {
    atomic_dir work;
    struct message why;
    std::vector<const char *> names;
    for (const export_file &file : files) {
        names.push_back(file.name.c_str());
    }
    int code = atomic_dir_begin(&work, directory.c_str(), names.data(),
                                static_cast<int>(names.size()), &why);
    if (code == ERROR_OK) {
        code = write_files(work, files, &why);
        if (code == ERROR_OK) {
            code = atomic_dir_commit(&work, names.data(), static_cast<int>(names.size()),
                                     names.back(), &why);
        }
        atomic_dir_abort(&work);
    }
    if (code != ERROR_OK) {
        *message = why.text;
        return code;
    }
    for (const export_file &file : files) {
        paths->push_back(directory + (directory.back() == '/' ? "" : "/") + file.name);
        *loss += (loss->empty() || file.loss.empty() ? "" : "; ") + file.loss;
    }
    return ERROR_OK;
}

std::vector<double> export_coefficients(const lens &one) {
    switch (one.kind) {
        case LENS_EQUIDISTANT:
            return {one.k1, one.k2, one.k3, one.k4};
        case LENS_RATIONAL:
            return {one.k1, one.k2, one.p1, one.p2, one.k3, one.k4, one.k5, one.k6};
        default:
            return {one.k1, one.k2, one.p1, one.p2, one.k3};
    }
}

std::string export_numbers(const std::vector<double> &values) {
    std::string text;
    for (const double value : values) {
        char number[32];
        const int length = std::snprintf(number, sizeof number, "%.17g", value);
        INVARIANT(length > 0 && length < static_cast<int>(sizeof number));
        // PyYAML, which ROS and Kalibr use, reads 1e+20 as a string and 1.0e+20 as a number.
        std::string word = number;
        const size_t exponent = word.find('e');
        if (exponent != std::string::npos && word.find('.') == std::string::npos) {
            word.insert(exponent, ".0");
        }
        text += (text.empty() ? "" : ", ") + word;
    }
    return text;
}
