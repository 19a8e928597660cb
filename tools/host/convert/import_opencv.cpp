// SPDX-License-Identifier: Apache-2.0
/// OpenCV's FileStorage (YAML, XML, JSON) with the matrices of a stereo pair. OpenCV fixes neither
/// names nor unit: stereo_calib writes M1 D1 M2 D2 to one file and R T R1 R2 P1 P2 Q to another
/// one, other programs write variations of cameraMatrix1 or left_camera_matrix. R and T are those
/// of stereoCalibrate: point_right = R point_left + T. A file says that its lenses are those of
/// cv::fisheye by an entry with that word in its name that is not 0 ("fisheye_model: 1").
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <map>

#include "core/error.h"
#include "stereo/geometry/geometry.h"
#include "tools/host/convert/import.hpp"
#include "tools/host/convert/import_storage.hpp"
#include "tools/host/formats/numpy_archive.hpp"

namespace {

enum role { MATRIX, DISTORTION, PROJECTION, ROTATION, TRANSLATION };

/// Where the values of a role were found; `side` 0 left, 1 right, 2 not stated.
struct finding {
    const import_file *file;
    std::string name;
    std::vector<double> values;
    int rows, columns;
};

struct findings {
    std::map<std::pair<role, int>, finding> all;
    std::map<std::pair<role, int>, std::string> unread;  // entries that hold no numbers, and why
    int width_px = 0, height_px = 0;
    double rms_px = 0;
    bool fisheye = false;  // the lenses are those of cv::fisheye

    const finding *find(role what, int side) const {
        const auto found = all.find({what, side});
        return found == all.end() ? nullptr : &found->second;
    }
};

/// Lower case, letters and digits only: cameraMatrix1, camera_matrix_1 and Camera-Matrix-1 are
/// equal.
std::string plain_name(const std::string &name) {
    std::string plain;
    for (const char c : name) {
        if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
            plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        }
    }
    return plain;
}

bool is_one_of(const std::string &name, std::initializer_list<const char *> names) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

/// Removes a word for the side from either end of a plain name. `base`: the left camera's number.
int cut_side(std::string *name, int base) {
    static const struct {
        const char *word;
        int side;
        bool in_front;  // may also be a prefix
    } words[] = {{"left", 0, true}, {"right", 1, true}, {"0", 0, false}, {"1", 0, false},
                 {"2", 1, false},   {"l", 0, false},    {"r", 1, false}};
    for (const auto &word : words) {
        const size_t length = std::strlen(word.word);
        if (name->size() <= length) {
            continue;
        }
        const bool digit = std::isdigit(static_cast<unsigned char>(*word.word)) != 0;
        const int side = digit ? *word.word - '0' - base : word.side;
        if ((side == 0 || side == 1) &&
            name->compare(name->size() - length, length, word.word) == 0) {
            name->resize(name->size() - length);
            return side;
        }
        if (word.in_front && name->compare(0, length, word.word) == 0) {
            name->erase(0, length);
            return word.side;
        }
    }
    return 2;
}

bool role_of(const std::string &name, int base, role *what, int *side) {
    std::string plain = plain_name(name);
    *side = 2;
    if (is_one_of(plain, {"r", "rotation", "rotationmatrix", "rmat", "stereor", "rot"})) {
        *what = ROTATION;
        return true;
    }
    if (is_one_of(plain,
                  {"t", "translation", "translationvector", "tvec", "stereot", "trans", "trns"})) {
        *what = TRANSLATION;
        return true;
    }
    static const std::initializer_list<const char *> matrix = {
        "m",         "k",          "cameramatrix",    "cammatrix", "mtx",
        "intrinsic", "intrinsics", "intrinsicmatrix", "newmtx"};
    static const std::initializer_list<const char *> distortion = {"d",
                                                                   "dist",
                                                                   "distortion",
                                                                   "distcoeffs",
                                                                   "distcoeff",
                                                                   "distcoefs",
                                                                   "distortioncoefficients",
                                                                   "distortioncoeffs"};
    // "dist" and "mtx..." end in letters that could be a side, so the whole name is tried first.
    if (is_one_of(plain, matrix) || is_one_of(plain, distortion)) {
        *what = is_one_of(plain, matrix) ? MATRIX : DISTORTION;
        return true;
    }
    *side = cut_side(&plain, base);
    if (*side == 2) {
        return false;
    }
    if (is_one_of(plain, matrix)) {
        *what = MATRIX;
    } else if (is_one_of(plain, distortion)) {
        *what = DISTORTION;
    } else if (is_one_of(plain, {"p", "projection", "projectionmatrix"})) {
        *what = PROJECTION;
    } else {
        return false;
    }
    return true;
}

/// A matrix, or a list of numbers in its place. Returns false for anything else.
bool read_values(const import_file &file, const import_storage_entry &entry, finding *found) {
    if (entry.kind == import_storage_kind::matrix) {
        if (entry.channels != 1) {
            import_fail(ERROR_SYNTAX, file, entry.name + ": must be a plain matrix");
        }
        found->rows = entry.rows;
        found->columns = entry.columns;
    } else if (entry.kind == import_storage_kind::list) {
        found->rows = static_cast<int>(entry.numbers.size());
        found->columns = 1;
    } else {
        return false;
    }
    found->values = entry.numbers;
    for (const double value : found->values) {
        if (!std::isfinite(value)) {
            import_fail(ERROR_RANGE, file,
                        found->name + ": contains a value that is not a finite number");
        }
    }
    return true;
}

bool is_side_px(double value) {
    return value >= 1 && value <= 100000;
}

/// Image size as a list of two numbers.
void read_size(const std::vector<double> &numbers, const std::string &plain, findings *result) {
    if (numbers.size() == 2 && is_side_px(numbers[0]) && is_side_px(numbers[1]) &&
        is_one_of(plain, {"imagesize", "imgsize", "size"})) {
        result->width_px = static_cast<int>(numbers[0]);
        result->height_px = static_cast<int>(numbers[1]);
    }
}

/// Image size and rms under their known names.
void read_extras(const import_storage_entry &entry, const std::string &plain, findings *result) {
    const std::vector<double> &numbers = entry.numbers;
    if (entry.kind == import_storage_kind::list) {
        read_size(numbers, plain, result);
    }
    if (entry.kind != import_storage_kind::number) {
        return;
    }
    const double value = numbers[0];
    if (is_side_px(value) && is_one_of(plain, {"imagewidth", "width"})) {
        result->width_px = static_cast<int>(value);
    } else if (is_side_px(value) && is_one_of(plain, {"imageheight", "height"})) {
        result->height_px = static_cast<int>(value);
    } else if (value > 0 && value < 1000 &&
               is_one_of(plain, {"rms", "stereorms", "rmserror", "reprojectionerror"})) {
        result->rms_px = value;
    }
}

/// The number of the left camera: 0 where a matrix or a distortion has this number.
int number_of_left(const std::vector<import_storage_entry> &entries) {
    return std::any_of(entries.begin(), entries.end(),
                       [](const import_storage_entry &entry) {
                           role what;
                           int side;
                           return !entry.name.empty() && entry.name.back() == '0' &&
                                  role_of(entry.name, 0, &what, &side);
                       })
               ? 0
               : 1;
}

/// As `role_of`; a camera's value without a side has that of its file.
bool side_of_role(const std::string &name, int base, int file_side, role *what, int *side) {
    if (!role_of(name, base, what, side)) {
        return false;
    }
    if (*side == 2 && (*what == MATRIX || *what == DISTORTION)) {
        *side = file_side;
    }
    return true;
}

void read_file(const import_file &file, int file_side, findings *result) {
    const std::vector<import_storage_entry> entries = import_storage_read(file);
    const int base = number_of_left(entries);
    for (const import_storage_entry &entry : entries) {
        const std::string plain = plain_name(entry.name);
        const bool zero = entry.kind == import_storage_kind::number && entry.numbers[0] == 0;
        result->fisheye = result->fisheye || (plain.find("fisheye") != std::string::npos && !zero);
        role what;
        int side;
        finding found{&file, entry.name, {}, 0, 0};
        if (!side_of_role(entry.name, base, file_side, &what, &side) ||
            !read_values(file, entry, &found)) {
            if (!entry.unread.empty() && side_of_role(entry.name, base, file_side, &what, &side)) {
                result->unread.insert({{what, side}, entry.name + ": " + entry.unread});
            }
            read_extras(entry, plain, result);
            continue;
        }
        const auto added = result->all.insert({{what, side}, found});
        if (!added.second) {
            import_fail(ERROR_DUPLICATE, file,
                        entry.name + ": is the same as " + added.first->second.name + " in " +
                            added.first->second.file->path);
        }
    }
}

const finding &required(const import_file &file, const findings &from, role what, int side,
                        const std::string &default_name) {
    const finding *found = from.find(what, side);
    const auto unread = from.unread.find({what, side});
    if (found == nullptr && unread != from.unread.end()) {
        import_fail(ERROR_SYNTAX, file, unread->second);
    }
    if (found == nullptr && from.find(MATRIX, 2) != nullptr) {
        import_fail(ERROR_MISSING, file,
                    "contains one camera only (" + from.find(MATRIX, 2)->name +
                        "): a stereo pair needs both cameras, R and T: LEFT,RIGHT,EXTRINSICS");
    }
    if (found == nullptr) {
        import_fail(ERROR_MISSING, file,
                    default_name +
                        " is missing: name both files, INTRINSICS,EXTRINSICS, or put them "
                        "side by side as intrinsics.yml and extrinsics.yml");
    }
    return *found;
}

void check_shape(const finding &found, int rows, int columns) {
    const bool flat = found.rows * found.columns == rows * columns &&
                      (found.rows == 1 || found.columns == 1) && (rows == 1 || columns == 1);
    // A list of numbers has no shape.
    const bool list = found.columns == 1 && found.rows == rows * columns;
    if (!(found.rows == rows && found.columns == columns) && !flat && !list) {
        import_fail(ERROR_SYNTAX, *found.file,
                    found.name + ": is " + std::to_string(found.rows) + "x" +
                        std::to_string(found.columns) + " instead of " + std::to_string(rows) +
                        "x" + std::to_string(columns));
    }
}

/// Rotation matrix of a role that may also be a rotation vector.
std::vector<double> rotation(const finding &found) {
    if (found.values.size() != 3) {
        check_shape(found, 3, 3);
        return found.values;
    }
    std::vector<double> R(9);
    geometry_rotation_from_vector(found.values.data(), R.data());
    return R;
}

void set_size(const import_file &file, const findings &from, const import_options &options,
              import_pair *pair) {
    if (from.width_px <= 0 || from.height_px <= 0) {
        import_stated_size(file, "this OpenCV file", options, pair);
        return;
    }
    for (lens *camera : {&pair->value.left, &pair->value.right}) {
        camera->width_px = from.width_px;
        camera->height_px = from.height_px;
    }
}

double unit_mm(const import_options &options, import_pair *pair) {
    if (options.unit.empty()) {
        pair->assumed.push_back("unit of length assumed: mm");
    }
    return import_unit_mm(options, 0, pair);
}

void read_raw(const import_file &file, const findings &from, const import_options &options,
              import_pair *pair) {
    lens *const lenses[2] = {&pair->value.left, &pair->value.right};
    for (int side = 0; side < 2; side++) {
        const std::string digit = side == 0 ? "1" : "2";
        const finding &K = required(file, from, MATRIX, side, "M" + digit);
        const finding &D = required(file, from, DISTORTION, side, "D" + digit);
        check_shape(K, 3, 3);
        check_shape(D, 1, static_cast<int>(D.values.size()));
        import_camera_matrix(*K.file, K.name, K.values, lenses[side]);
        if (from.fisheye) {
            import_equidistant(*D.file, D.name, D.values, lenses[side]);
        } else {
            import_distortion(*D.file, D.name, D.values, lenses[side]);
        }
        // cv::fisheye has four coefficients in a column; the standard model's usually are a row.
        if (!from.fisheye && D.rows == 4 && D.columns == 1) {
            pair->assumed.push_back(D.name +
                                    ": four coefficients read as k1 k2 p1 p2 (if they are those of "
                                    "cv::fisheye, add a line \"fisheye_model: 1\")");
        }
    }
    const finding &R = required(file, from, ROTATION, 2, "R");
    const finding &T = required(file, from, TRANSLATION, 2, "T");
    check_shape(T, 3, 1);
    const double unit = unit_mm(options, pair);
    const double t_mm[3] = {T.values[0] * unit, T.values[1] * unit, T.values[2] * unit};
    import_pose(*R.file, R.name, rotation(R), t_mm, &pair->value);
}

void read_rectified(const import_file &file, const findings &from, const import_options &options,
                    import_pair *pair) {
    const finding &P1 = required(file, from, PROJECTION, 0, "P1");
    const finding &P2 = required(file, from, PROJECTION, 1, "P2");
    check_shape(P1, 3, 4);
    check_shape(P2, 3, 4);
    const double unit = unit_mm(options, pair);
    import_projections(*P2.file, "P1 and P2", P1.values, P2.values, unit, pair);
    pair->assumed.push_back("images are the rectified ones");
}

}  // namespace

bool import_opencv_matches(const std::string &text) {
    return text.find("opencv-matrix") != std::string::npos ||
           text.find("<opencv_storage") != std::string::npos || text.compare(0, 5, "%YAML") == 0 ||
           numpy_archive_matches(text);
}

import_pair import_opencv(const std::vector<import_file> &files, const import_options &options) {
    import_pair pair;
    pair.format = "OpenCV";
    pair.tag = "opencv";
    findings from;
    // Single-camera files are distinguished by their order only.
    for (size_t i = 0; i < files.size(); i++) {
        read_file(files[i], files.size() > 1 && i < 2 ? static_cast<int>(i) : 2, &from);
    }
    const import_file &named = files[0];
    set_size(named, from, options, &pair);
    if (options.rectified) {
        read_rectified(named, from, options, &pair);
    } else {
        read_raw(named, from, options, &pair);
    }
    pair.value.rms_px = from.rms_px;
    return pair;
}
