// SPDX-License-Identifier: Apache-2.0
#include "tools/host/recordings/ros_messages.hpp"

#include <algorithm>
#include <cmath>

namespace {

constexpr uint64_t second_ns = 1000000000;

const ros_type time_type = {"builtin_interfaces/msg/Time", "int32 sec\nuint32 nanosec\n", {}};
const ros_type header_type = {
    "std_msgs/msg/Header", "builtin_interfaces/Time stamp\nstring frame_id\n", {&time_type}};
const ros_type region_type = {"sensor_msgs/msg/RegionOfInterest",
                              "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\n"
                              "bool do_rectify\n",
                              {}};
const ros_type field_type = {
    "sensor_msgs/msg/PointField",
    "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\n"
    "uint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n",
    {}};
const ros_type vector_type = {"geometry_msgs/msg/Vector3", "float64 x\nfloat64 y\nfloat64 z\n", {}};
const ros_type quaternion_type = {
    "geometry_msgs/msg/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n", {}};
const ros_type turn_type = {"geometry_msgs/msg/Transform",
                            "Vector3 translation\nQuaternion rotation\n",
                            {&vector_type, &quaternion_type}};
const ros_type stamped_type = {
    "geometry_msgs/msg/TransformStamped",
    "std_msgs/Header header\nstring child_frame_id\nTransform transform\n",
    {&header_type, &turn_type}};
const ros_type value_type = {"diagnostic_msgs/msg/KeyValue", "string key\nstring value\n", {}};
const ros_type status_type = {
    "diagnostic_msgs/msg/DiagnosticStatus",
    "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\n"
    "string message\nstring hardware_id\nKeyValue[] values\n",
    {&value_type}};

constexpr unsigned float_field = 7;  // PointField.FLOAT32

/// "sensor_msgs/msg/Image" as definitions write it: "sensor_msgs/Image".
std::string short_name(const char *name) {
    std::string text = name;
    return text.erase(text.find("/msg"), 4);
}

void add_parts(const ros_type &type, std::vector<const ros_type *> *all) {
    for (const ros_type *part : type.parts) {
        if (std::find(all->begin(), all->end(), part) == all->end()) {
            all->push_back(part);
            add_parts(*part, all);
        }
    }
}

void put(const ros_header &header, cdr_writer *out) {
    out->u32(header.time_ns / second_ns);
    out->u32(header.time_ns % second_ns);
    out->text(header.frame);
}

void put(const ros_image &image, cdr_writer *out) {
    put(image.header, out);
    out->u32(image.height_px);
    out->u32(image.width_px);
    out->text(image.encoding);
    out->u8(image.big_endian);
    out->u32(image.row_bytes);
    out->sized(image.data);
}

void put_region(uint32_t x_px, uint32_t y_px, uint32_t height_px, uint32_t width_px,
                cdr_writer *out) {
    out->u32(x_px);
    out->u32(y_px);
    out->u32(height_px);
    out->u32(width_px);
    out->u8(false);  // do_rectify
}

ros_header take_header(byte_reader *in) {
    ros_header header;
    if (!in->cdr()) {
        in->u32();  // seq
    }
    header.time_ns = in->u32() * second_ns;
    header.time_ns += in->u32();
    header.frame = in->text();
    return header;
}

void take(byte_reader *in, double *values, size_t count) {
    for (size_t i = 0; i < count; i++) {
        values[i] = in->f64();
    }
}

}  // namespace

const ros_type ros_image_type = {
    "sensor_msgs/msg/Image",
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n"
    "uint32 step\nuint8[] data\n",
    {&header_type}};
const ros_type ros_compressed_image_type = {"sensor_msgs/msg/CompressedImage",
                                            "std_msgs/Header header\nstring format\nuint8[] data\n",
                                            {&header_type}};
const ros_type ros_camera_info_type = {
    "sensor_msgs/msg/CameraInfo",
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n"
    "float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n"
    "RegionOfInterest roi\n",
    {&header_type, &region_type}};
const ros_type ros_disparity_type = {
    "stereo_msgs/msg/DisparityImage",
    "std_msgs/Header header\nsensor_msgs/Image image\nfloat32 f\nfloat32 t\n"
    "sensor_msgs/RegionOfInterest valid_window\nfloat32 min_disparity\nfloat32 max_disparity\n"
    "float32 delta_d\n",
    {&header_type, &ros_image_type, &region_type}};
const ros_type ros_points_type = {
    "sensor_msgs/msg/PointCloud2",
    "std_msgs/Header header\nuint32 height\nuint32 width\nPointField[] fields\n"
    "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
    {&header_type, &field_type}};
const ros_type ros_transforms_type = {
    "tf2_msgs/msg/TFMessage", "geometry_msgs/TransformStamped[] transforms\n", {&stamped_type}};
const ros_type ros_diagnostics_type = {"diagnostic_msgs/msg/DiagnosticArray",
                                       "std_msgs/Header header\nDiagnosticStatus[] status\n",
                                       {&header_type, &status_type}};

std::string ros_definition(const ros_type &type) {
    std::vector<const ros_type *> parts;
    add_parts(type, &parts);
    std::string text = type.fields;
    for (const ros_type *part : parts) {
        text += std::string(80, '=') + "\nMSG: " + short_name(part->name) + "\n" + part->fields;
    }
    return text;
}

std::string ros_print(const ros_image &image) {
    cdr_writer out;
    put(image, &out);
    return std::move(out.bytes);
}

std::string ros_print_compressed(const ros_image &image) {
    cdr_writer out;
    put(image.header, &out);
    out.text(image.encoding);
    out.sized(image.data);
    return std::move(out.bytes);
}

std::string ros_print(const ros_camera_info &info) {
    cdr_writer out;
    put(info.header, &out);
    out.u32(info.height_px);
    out.u32(info.width_px);
    out.text(info.model);
    out.u32(info.D.size());
    out.numbers(info.D.data(), info.D.size());
    out.numbers(info.K, 9);
    out.numbers(info.R, 9);
    out.numbers(info.P, 12);
    out.u32(info.binning_x);
    out.u32(info.binning_y);
    put_region(info.roi_x_px, info.roi_y_px, 0, 0, &out);
    return std::move(out.bytes);
}

std::string ros_print(const ros_disparity &disparity) {
    cdr_writer out;
    put(disparity.image.header, &out);
    put(disparity.image, &out);
    out.f32(static_cast<float>(disparity.f_px));
    out.f32(static_cast<float>(disparity.baseline_m));
    put_region(0, 0, disparity.image.height_px, disparity.image.width_px, &out);
    out.f32(disparity.min_px);
    out.f32(disparity.max_px);
    out.f32(disparity.step_px);
    return std::move(out.bytes);
}

std::string ros_print(const ros_points &points) {
    cdr_writer out;
    put(points.header, &out);
    out.u32(1);
    out.u32(points.count);
    out.u32(points.fields.size());
    const size_t value_bytes = 4;
    for (size_t i = 0; i < points.fields.size(); i++) {
        out.text(points.fields[i]);
        out.u32(value_bytes * i);
        out.u8(float_field);
        out.u32(1);
    }
    const size_t step_bytes = value_bytes * points.fields.size();
    out.u8(false);  // big-endian
    out.u32(step_bytes);
    out.u32(step_bytes * points.count);
    out.sized(points.data);
    out.u8(true);  // all are finite
    return std::move(out.bytes);
}

std::string ros_print(const std::vector<ros_transform> &transforms) {
    cdr_writer out;
    out.u32(transforms.size());
    for (const ros_transform &one : transforms) {
        put(one.header, &out);
        out.text(one.frame);
        out.numbers(one.translation_m, 3);
        const double *const r_rad = one.rotation_rad;
        const double angle_rad = std::hypot(r_rad[0], r_rad[1], r_rad[2]);
        const double scale = angle_rad > 0 ? std::sin(angle_rad / 2) / angle_rad : 0.5;
        for (int i = 0; i < 3; i++) {
            out.f64(scale * r_rad[i]);
        }
        out.f64(std::cos(angle_rad / 2));
    }
    return std::move(out.bytes);
}

std::string ros_print(const ros_header &header, const std::vector<ros_status> &statuses) {
    cdr_writer out;
    put(header, &out);
    out.u32(statuses.size());
    for (const ros_status &one : statuses) {
        out.u8(0);  // OK
        out.text(one.name);
        out.text(one.message);
        out.text(one.hardware);
        out.u32(one.values.size());
        for (const auto &value : one.values) {
            out.text(value.first);
            out.text(value.second);
        }
    }
    return std::move(out.bytes);
}

ros_image ros_parse_image(byte_reader in) {
    ros_image image;
    image.header = take_header(&in);
    image.height_px = in.u32();
    image.width_px = in.u32();
    image.encoding = in.text();
    image.big_endian = in.u8() != 0;
    image.row_bytes = in.u32();
    const size_t bytes = in.u32();
    image.data.assign(in.take(bytes), bytes);
    return image;
}

ros_image ros_parse_compressed(byte_reader in) {
    ros_image image;
    image.header = take_header(&in);
    image.encoding = in.text();
    const size_t bytes = in.u32();
    image.data.assign(in.take(bytes), bytes);
    return image;
}

ros_camera_info ros_parse_camera_info(byte_reader in) {
    ros_camera_info info;
    info.header = take_header(&in);
    info.height_px = in.u32();
    info.width_px = in.u32();
    info.model = in.text();
    const size_t coefficients = in.u32();
    for (size_t i = 0; i < coefficients; i++) {
        info.D.push_back(in.f64());
    }
    take(&in, info.K, 9);
    take(&in, info.R, 9);
    take(&in, info.P, 12);
    info.binning_x = in.u32();
    info.binning_y = in.u32();
    info.roi_x_px = in.u32();
    info.roi_y_px = in.u32();
    return info;
}
