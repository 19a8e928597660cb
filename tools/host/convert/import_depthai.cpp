// SPDX-License-Identifier: Apache-2.0
/// The EEPROM of a camera of Luxonis (OAK-D), as eepromToJsonFile of DepthAI writes it: cameraData
/// is a list of [socket, camera]; extrinsics map points of the camera into the one at
/// toCameraSocket, with the translation in cm (from version 7 on: in lengthUnit). Source:
/// depthai-core, EepromData.hpp, CameraInfo.hpp, Extrinsics.hpp and CalibrationHandler.cpp.
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "stereo/geometry/geometry.h"
#include "tools/host/convert/import.hpp"

namespace {

using json = nlohmann::ordered_json;

/// CameraBoardSocket of the pair where the file does not state it.
const int left_socket = 1, right_socket = 2;

std::string socket_name(int socket) {
    return "camera of socket " + std::to_string(socket);
}

/// The numbers of a list, or of a list of lists, exactly `count` (0: any).
std::vector<double> numbers(const import_file &file, const std::string &field, const json &list,
                            size_t count) {
    std::vector<double> all;
    const json flat = list.is_array() ? list.flatten() : json::object();
    for (const auto &item : flat.items()) {
        if (!item.value().is_number()) {
            import_fail(ERROR_SYNTAX, file, field + ": must be numbers");
        }
        all.push_back(item.value().get<double>());
    }
    if (count != 0 && all.size() != count) {
        import_fail(ERROR_SYNTAX, file,
                    field + ": has " + std::to_string(all.size()) + " numbers instead of " +
                        std::to_string(count));
    }
    return all;
}

double number(const import_file &file, const std::string &field, const json &object,
              const char *name) {
    const auto found = object.is_object() ? object.find(name) : object.end();
    if (found == object.end() || !found->is_number()) {
        import_fail(ERROR_MISSING, file, field + ": " + name + " is missing");
    }
    return found->get<double>();
}

const json &child(const import_file &file, const std::string &field, const json &object,
                  const char *name) {
    if (!object.is_object() || !object.contains(name)) {
        import_fail(ERROR_MISSING, file, field + ": " + name + " is missing");
    }
    return object.at(name);
}

int integer(const import_file &file, const std::string &field, const json &object, const char *name,
            double low, double high) {
    const double value = number(file, field, object, name);
    if (!(value >= low && value <= high) || value != static_cast<int>(value)) {
        import_fail(ERROR_RANGE, file, field + ": " + name + " is out of range");
    }
    return static_cast<int>(value);
}

/// The cameras by their sockets.
struct eeprom {
    const import_file &file;
    std::map<int, json> cameras;

    const json &at(int socket) const {
        const auto found = cameras.find(socket);
        if (found == cameras.end()) {
            import_fail(ERROR_MISSING, file,
                        "the " + socket_name(socket) + " is missing: cameraData has no pair");
        }
        return found->second;
    }
};

lens read_lens(const eeprom &from, int socket) {
    const import_file &file = from.file;
    const std::string field = socket_name(socket);
    const json &camera = from.at(socket);
    lens result{};
    result.width_px = integer(file, field, camera, "width", 1, LENS_SIDE_MAX_PX);
    result.height_px = integer(file, field, camera, "height", 1, LENS_SIDE_MAX_PX);
    const std::string matrix = field + ", intrinsicMatrix", bent = field + ", distortionCoeff";
    import_camera_matrix(file, matrix,
                         numbers(file, matrix, child(file, field, camera, "intrinsicMatrix"), 9),
                         &result);
    const int perspective = 0, fisheye = 1;
    const int type = camera.contains("cameraType")
                         ? integer(file, field, camera, "cameraType", 0, 100)
                         : perspective;
    std::vector<double> D = numbers(file, bent, child(file, field, camera, "distortionCoeff"), 0);
    if (type == fisheye) {  // the list has the length of the other model's, too
        D.resize(std::min<size_t>(D.size(), 4));
        import_equidistant(file, bent, D, &result);
    } else if (type == perspective) {
        import_distortion(file, bent, D, &result);
    } else {
        import_fail(ERROR_DISTORTION, file,
                    field + ": its cameraType is neither 0 (perspective) nor 1 (fisheye)");
    }
    return result;
}

/// Millimetres per unit of a translation.
double unit_of(const import_file &file, const std::string &field, const json &extrinsics) {
    static const double units_mm[] = {1000, 10, 1, 25.4, 304.8};  // DepthUnit
    const int centimetre = 1;
    return units_mm[extrinsics.contains("lengthUnit")
                        ? integer(file, field, extrinsics, "lengthUnit", 0, 4)
                        : centimetre];
}

/// p_root = R p_socket + t (mm), where the root is the camera without a further one.
struct chain {
    std::vector<double> R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    double t_mm[3] = {0, 0, 0};
    int root;
};

/// Follows the cameras' references from `socket`, up to `end` or the last one.
chain follow(const eeprom &from, int socket, int end) {
    chain result;
    result.root = socket;
    for (size_t links = 0; result.root != end; links++) {
        const std::string field = socket_name(result.root) + ", extrinsics";
        const json &extrinsics =
            child(from.file, socket_name(result.root), from.at(result.root), "extrinsics");
        const int next = integer(from.file, field, extrinsics, "toCameraSocket", -1, 1000);
        if (next < 0 || links > from.cameras.size()) {
            break;
        }
        const std::vector<double> R =
            numbers(from.file, field, child(from.file, field, extrinsics, "rotationMatrix"), 9);
        const json &t = child(from.file, field, extrinsics, "translation");
        const double unit_mm = unit_of(from.file, field, extrinsics);
        std::vector<double> turned(9);
        double moved_mm[3];
        geometry_multiply(R.data(), result.R.data(), turned.data());
        geometry_rotate(R.data(), result.t_mm, moved_mm);
        const char *axis = "x";
        for (double *shift_mm = result.t_mm; shift_mm != result.t_mm + 3; shift_mm++) {
            const std::string name(1, static_cast<char>(*axis + (shift_mm - result.t_mm)));
            *shift_mm = moved_mm[shift_mm - result.t_mm] +
                        unit_mm * number(from.file, field + ", translation", t, name.c_str());
        }
        result.R = turned;
        result.root = next;
    }
    return result;
}

import_matrix4 matrix_of(const chain &link) {
    const std::vector<double> &R = link.R;
    const double *t = link.t_mm;
    return {R[0], R[1], R[2], t[0], R[3], R[4], R[5], t[1], R[6], R[7], R[8], t[2], 0, 0, 0, 1};
}

void read_pose(const eeprom &from, int left, int right, calibration *value) {
    chain links[2] = {follow(from, left, right), follow(from, right, left)};
    const import_matrix4 identity = matrix_of(chain{});
    const std::string field = "extrinsics";
    if (links[0].root == right) {
        import_common_pose(from.file, field, matrix_of(links[0]), identity, false, 1, value);
    } else if (links[1].root == left) {
        import_common_pose(from.file, field, identity, matrix_of(links[1]), false, 1, value);
    } else if (links[0].root == links[1].root) {
        import_common_pose(from.file, field, matrix_of(links[0]), matrix_of(links[1]), false, 1,
                           value);
    } else {
        import_fail(ERROR_MISSING, from.file,
                    "extrinsics do not connect the left camera with the right one");
    }
}

/// A socket of the pair, or `otherwise` where the file leaves it open.
int socket_of(const import_file &file, const json &root, const char *name, int otherwise) {
    const auto pair = root.find("stereoRectificationData");
    if (pair == root.end() || !pair->is_object() || !pair->contains(name)) {
        return otherwise;
    }
    const int socket = integer(file, "stereoRectificationData", *pair, name, -1, 1000);
    return socket < 0 ? otherwise : socket;
}

}  // namespace

bool import_depthai_matches(const std::string &text) {
    return text.find("\"cameraData\"") != std::string::npos;
}

import_pair import_depthai(const import_file &file, const import_options &) {
    import_pair pair;
    pair.format = "DepthAI";
    pair.tag = "depthai";
    pair.format_unit_mm = 10;
    const json root = import_json(file);
    if (!child(file, "this file", root, "cameraData").is_array()) {
        import_fail(ERROR_SYNTAX, file, "is not a complete JSON file of DepthAI");
    }
    eeprom from = {file, {}};
    for (const json &item : root.at("cameraData")) {
        if (!item.is_array() || item.size() != 2 || !item[0].is_number_integer()) {
            import_fail(ERROR_SYNTAX, file, "cameraData: must be a list of [socket, camera]");
        }
        from.cameras[item[0].get<int>()] = item[1];
    }
    const int left = socket_of(file, root, "leftCameraSocket", left_socket);
    const int right = socket_of(file, root, "rightCameraSocket", right_socket);
    pair.value.left = read_lens(from, left);
    pair.value.right = read_lens(from, right);
    read_pose(from, left, right, &pair.value);
    pair.assumed.push_back("left image of socket " + std::to_string(left) + ", right of socket " +
                           std::to_string(right) + ", both of the full size");
    return pair;
}
