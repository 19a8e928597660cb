// SPDX-License-Identifier: Apache-2.0
/// ROS 2's messages of cameras and stereo: their definitions, printed as CDR; parsed, as of ROS 1,
/// whose fields are the same but for a number that each header begins with. Source:
/// https://github.com/ros2/common_interfaces (humble); REP 2008 for the layout of definitions.
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_ROS_MESSAGES_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_ROS_MESSAGES_HPP

#include <string>
#include <utility>
#include <vector>

#include "tools/host/recordings/little_endian.hpp"

/// A type, its fields one a line, and the types in it, which follow their users.
struct ros_type {
    const char *name;  // "sensor_msgs/msg/Image"
    const char *fields;
    std::vector<const ros_type *> parts;
};

extern const ros_type ros_image_type, ros_compressed_image_type, ros_camera_info_type,
    ros_disparity_type, ros_points_type, ros_transforms_type, ros_diagnostics_type;

/// The text of a type with those of all types in it.
std::string ros_definition(const ros_type &type);

/// Time and frame of a message.
struct ros_header {
    uint64_t time_ns = 0;
    std::string frame;
};

struct ros_image {
    ros_header header;
    uint32_t height_px = 0, width_px = 0;
    std::string encoding;  // "mono8"; of a compressed image its format
    bool big_endian = false;
    uint32_t row_bytes = 0;
    std::string data;
};

struct ros_camera_info {
    ros_header header;
    uint32_t height_px = 0, width_px = 0;
    std::string model;  // "plumb_bob"
    std::vector<double> D;
    double K[9]{}, R[9]{}, P[12]{};
    uint32_t binning_x = 0, binning_y = 0, roi_x_px = 0, roi_y_px = 0;
};

struct ros_disparity {
    ros_image image;  // 32FC1
    double f_px, baseline_m;
    float min_px, max_px, step_px;
};

/// Points whose fields are floats, the colour's too, as the Point Cloud Library packs it.
struct ros_points {
    ros_header header;
    std::vector<std::string> fields;
    uint32_t count;
    std::string data;
};

/// Where a frame is in its parent: p_parent = R p_frame + t, with R as a rotation vector.
struct ros_transform {
    ros_header header;  // the parent's frame
    std::string frame;
    double translation_m[3], rotation_rad[3];
};

struct ros_status {
    std::string name, message, hardware;
    std::vector<std::pair<std::string, std::string>> values;
};

std::string ros_print(const ros_image &image);
std::string ros_print_compressed(const ros_image &image);
std::string ros_print(const ros_camera_info &info);
std::string ros_print(const ros_disparity &disparity);
std::string ros_print(const ros_points &points);
std::string ros_print(const std::vector<ros_transform> &transforms);
std::string ros_print(const ros_header &header, const std::vector<ros_status> &statuses);

// Each throws std::runtime_error if the message is not of its type.
ros_image ros_parse_image(byte_reader in);
ros_image ros_parse_compressed(byte_reader in);
ros_camera_info ros_parse_camera_info(byte_reader in);

#endif
