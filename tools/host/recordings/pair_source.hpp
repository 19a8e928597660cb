// SPDX-License-Identifier: Apache-2.0
/// Where `vergence import` takes pairs from. All functions throw import_failure.
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_PAIR_SOURCE_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_PAIR_SOURCE_HPP

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/raw_image.h"
#include "tools/host/convert/import.hpp"

/// An image that releases its pixels.
struct owned_image {
    owned_image() = default;
    explicit owned_image(const raw_image &value) : image(value) {}
    owned_image(owned_image &&other) noexcept : image(std::exchange(other.image, raw_image{})) {}
    owned_image &operator=(owned_image &&other) noexcept {
        std::swap(image, other.image);
        return *this;
    }
    ~owned_image() { raw_image_release(&image); }

    raw_image image{};
};

struct recorded_pair {
    owned_image side[2];
    uint64_t time_ns[2];  // since 1970, or of another clock
};

class pair_source {
  public:
    virtual ~pair_source() = default;
    /// The next pair; false at the end.
    virtual bool next(recorded_pair *pair) = 0;
    /// The calibration that comes with the images, of this size. False: there is none, and `*where`
    /// says where it was sought.
    virtual bool calibrate(const import_options &options, calibration *value,
                           std::string *where) = 0;
};

/// What the user states about a recording.
struct pair_source_request {
    std::string path;
    std::string topics;  // LEFT,RIGHT; "": found by their names
    bool side_by_side = false;
    double tolerance_s = 0.005;  // between the times of a pair's images
};

/// Files of MCAP or bags of ROS 1.
std::unique_ptr<pair_source> pair_source_ros(const pair_source_request &request,
                                             const std::vector<std::string> &files);
/// A directory of EuRoC, of KITTI, or with two folders of images.
std::unique_ptr<pair_source> pair_source_folder(const pair_source_request &request);
/// An image, a directory of images, or a video, whose halves are the pair.
std::unique_ptr<pair_source> pair_source_halves(const pair_source_request &request);

// Shared by the sources.

/// Reads an image file of any format; `name` is its name in messages.
owned_image pair_source_read(const std::string &path, const std::string &name);

/// A whole PNG, JPEG, ... in memory.
owned_image pair_source_decode(const std::string &data, const std::string &name);

/// Images in a directory by name, without their extension in `stems`.
struct image_names {
    std::vector<std::string> paths, stems;
};
image_names pair_source_list(const std::string &directory);

/// The time that a file's name states: nanoseconds (EuRoC), or seconds with decimals (TUM).
bool pair_source_time(const std::string &stem, uint64_t *time_ns);

#endif
