// SPDX-License-Identifier: Apache-2.0
// A pair of topics of a recording of ROS, or of the files of one, one after the other.
#include <algorithm>
#include <cstring>
#include <deque>
#include <functional>
#include <numeric>

#include "core/error.h"
#include "daemon/base/raw_memory.h"
#include "tools/host/convert/calibration_file.hpp"
#include "tools/host/recordings/pair_source.hpp"
#include "tools/host/recordings/recording_open.hpp"
#include "tools/host/recordings/ros_messages.hpp"

namespace {

constexpr size_t waiting_max = 64;  // messages of one side that wait for their partner
const std::string compressed_suffix = "/compressed";

bool is_image(const recording_channel &channel) {
    return channel.type == ros_image_type.name || channel.type == ros_compressed_image_type.name;
}

/// The topic of the camera_info that belongs to an image's topic.
std::string info_topic(std::string topic) {
    const size_t suffix = topic.rfind(compressed_suffix);
    if (suffix != std::string::npos && suffix + compressed_suffix.size() == topic.size()) {
        topic.erase(suffix);
    }
    return topic.substr(0, topic.rfind('/')) + "/camera_info";
}

/// The right camera's topic that differs from the left one's by the name of the side; "": none.
std::string partner_of(const std::string &topic, const std::vector<std::string> &all) {
    static const char *const words[][2] = {{"left", "right"},
                                           {"infra1", "infra2"},
                                           {"cam0", "cam1"},
                                           {"camera0", "camera1"},
                                           {"cam_0", "cam_1"}};
    for (const auto &pair : words) {
        const size_t at = topic.rfind(pair[0]);
        if (at != std::string::npos) {
            const std::string name = std::string(topic).replace(at, std::strlen(pair[0]), pair[1]);
            if (std::find(all.begin(), all.end(), name) != all.end()) {
                return name;
            }
        }
    }
    return "";
}

/// How ROS names an image's values. Mosaics in another order than the sensors of our instruments
/// have cannot be held.
struct encoding {
    const char *name;
    raw_layout layout;
    int bytes, channels;  // of a value; values a pixel
    bool swapped;         // blue comes first
};

const encoding encodings[] = {
    {"mono8", RAW_GREY, 1, 1, false},
    {"8UC1", RAW_GREY, 1, 1, false},
    {"mono16", RAW_GREY, 2, 1, false},
    {"16UC1", RAW_GREY, 2, 1, false},
    {"rgb8", RAW_RGB, 1, 3, false},
    {"bgr8", RAW_RGB, 1, 3, true},
    {"8UC3", RAW_RGB, 1, 3, true},
    {"rgba8", RAW_RGB, 1, 4, false},
    {"bgra8", RAW_RGB, 1, 4, true},
    {"rgb16", RAW_RGB, 2, 3, false},
    {"bgr16", RAW_RGB, 2, 3, true},
    {"bayer_grbg8", RAW_BAYER_GRBG, 1, 1, false},
    {"bayer_grbg16", RAW_BAYER_GRBG, 2, 1, false},
};

const encoding &encoding_of(const ros_image &from, const std::string &name) {
    for (const encoding &known : encodings) {
        if (from.encoding == known.name) {
            return known;
        }
    }
    throw import_failure{ERROR_UNSUPPORTED,
                         name + ": images of the encoding " + from.encoding +
                             " are not supported (record mono8, mono16, rgb8, bgr8, bayer_grbg8 or "
                             "compressed ones)"};
}

uint16_t value_at(const unsigned char *bytes, int count, bool big_endian) {
    if (count == 1) {
        return bytes[0];
    }
    const unsigned first = bytes[0], second = bytes[1];
    return static_cast<uint16_t>(big_endian ? first << 8 | second : first | second << 8);
}

/// An image without pixels; its bytes are there.
raw_image described(const ros_image &from, const encoding &how, const std::string &name) {
    constexpr uint32_t side_max_px = 32768;
    const size_t row_bytes =
        static_cast<size_t>(from.width_px) * static_cast<size_t>(how.channels * how.bytes);
    if (from.height_px == 0 || from.width_px > side_max_px || from.height_px > side_max_px ||
        from.row_bytes < row_bytes ||
        from.data.size() < static_cast<size_t>(from.row_bytes) * from.height_px) {
        throw import_failure{ERROR_SYNTAX, name + ": an image has fewer bytes than its size needs"};
    }
    raw_image image{};
    image.width_px = static_cast<int>(from.width_px);
    image.height_px = static_cast<int>(from.height_px);
    image.bits = 8 * how.bytes;
    image.layout = how.layout;
    return image;
}

owned_image image_of(const ros_image &from, const std::string &name) {
    const encoding &how = encoding_of(from, name);
    owned_image made(described(from, how, name));
    uint16_t *to = raw_memory_allocate(&made.image);
    if (to == nullptr) {
        throw import_failure{ERROR_MEMORY, name + ": out of memory"};
    }
    const int kept = how.layout == RAW_RGB ? 3 : 1;
    for (size_t y = 0; y < from.height_px; y++) {
        const auto *at =
            reinterpret_cast<const unsigned char *>(from.data.data()) + y * from.row_bytes;
        for (size_t x = 0; x < from.width_px; x++, at += how.channels * how.bytes) {
            for (int c = 0; c < kept; c++) {
                const int channel = how.swapped ? kept - 1 - c : c;
                *to++ = value_at(at + channel * how.bytes, how.bytes, from.big_endian);
            }
        }
    }
    return made;
}

/// Sensors of 10 or 12 bits fill words of 16 from the top: the bits that are 0 in all values of a
/// pair are not the sensors'. With them, interpolated colours would be rounded otherwise than those
/// of the sensors' own values.
void drop_empty_bits(recorded_pair *pair) {
    constexpr int wide_bits = 16, narrow_bits = 8;
    unsigned used = 0;
    for (const owned_image &side : pair->side) {
        const size_t values = raw_image_row_values(&side.image);
        for (int y = 0; side.image.bits == wide_bits && y < side.image.height_px; y++) {
            const uint16_t *const row = raw_image_row(&side.image, y);
            used = std::accumulate(row, row + values, used, std::bit_or<>());
        }
    }
    int empty = 0;
    while (used != 0 && empty < narrow_bits && (used >> empty & 1) == 0) {
        empty++;
    }
    for (owned_image &side : pair->side) {
        raw_image &image = side.image;
        if (image.bits == wide_bits && empty > 0) {
            auto *const pixels = static_cast<uint16_t *>(image.owner);
            const size_t values =
                raw_image_row_values(&image) * static_cast<size_t>(image.height_px);
            std::for_each(pixels, pixels + values, [empty](uint16_t &value) {
                value = static_cast<uint16_t>(value >> empty);
            });
            image.bits -= empty;
        }
    }
}

std::string list_text(const double *values, size_t count) {
    std::string text;
    for (size_t i = 0; i < count; i++) {
        char number[32];
        std::snprintf(number, sizeof number, "%.17g", values[i]);
        text += (i == 0 ? "" : ", ") + std::string(number);
    }
    return "[" + text + "]\n";
}

/// The message as the file that the importer of ROS reads.
std::string info_text(const ros_camera_info &info) {
    return "image_width: " + std::to_string(info.width_px) +
           "\nimage_height: " + std::to_string(info.height_px) +
           "\ndistortion_model: " + info.model + "\nd: " + list_text(info.D.data(), info.D.size()) +
           "k: " + list_text(info.K, 9) + "r: " + list_text(info.R, 9) +
           "p: " + list_text(info.P, 12) + "binning_x: " + std::to_string(info.binning_x) +
           "\nbinning_y: " + std::to_string(info.binning_y) +
           "\nroi: {x_offset: " + std::to_string(info.roi_x_px) +
           ", y_offset: " + std::to_string(info.roi_y_px) + "}\n";
}

class ros_source : public pair_source {
  public:
    ros_source(const pair_source_request &request, const std::vector<std::string> &files)
        : tolerance_ns_(static_cast<uint64_t>(request.tolerance_s * 1e9)), path_(request.path) {
        for (const std::string &file : files) {
            readers_.push_back(recording_open(file));
        }
        choose(request.topics);
    }

    bool next(recorded_pair *pair) override;
    bool calibrate(const import_options &options, calibration *value, std::string *where) override;

  private:
    void choose(const std::string &wanted);
    std::vector<std::string> image_topics() const;
    bool read(recording_message *message);
    int info_side(const recording_channel &channel) const;
    std::vector<import_file> read_infos();
    bool match(recorded_pair *pair);
    void keep(const recording_message &message);

    template <class Message>
    Message parsed(Message (*parse)(byte_reader), const recording_message &message) const {
        try {
            return parse(
                byte_reader(message.data, message.bytes, message.channel->encoding == "cdr"));
        } catch (const std::runtime_error &error) {
            throw import_failure{ERROR_SYNTAX, path_ + ", " + message.channel->topic +
                                                   ": a message " + error.what()};
        }
    }

    uint64_t tolerance_ns_;
    std::string path_, topics_[2];
    std::vector<std::unique_ptr<recording_reader>> readers_;
    size_t reading_ = 0;
    std::deque<ros_image> waiting_[2];
};

std::vector<std::string> ros_source::image_topics() const {
    std::vector<std::string> all;
    for (const auto &reader : readers_) {
        for (const auto &channel : reader->channels()) {
            const std::string &topic = channel.second.topic;
            if (is_image(channel.second) && std::find(all.begin(), all.end(), topic) == all.end()) {
                all.push_back(topic);
            }
        }
    }
    std::sort(all.begin(), all.end());
    return all;
}

/// The topics that the user names, or the only pair of them.
void ros_source::choose(const std::string &wanted) {
    const std::vector<std::string> all = image_topics();
    std::string list;
    for (const std::string &topic : all) {
        list += (list.empty() ? "" : " ") + topic;
    }
    const std::string have = all.empty() ? "it has no images" : "it has " + list;
    std::vector<std::pair<std::string, std::string>> found;
    if (!wanted.empty()) {
        const size_t comma = wanted.find(',');
        found.emplace_back(wanted.substr(0, comma),
                           comma == std::string::npos ? "" : wanted.substr(comma + 1));
    } else {
        for (const std::string &topic : all) {
            const std::string partner = partner_of(topic, all);
            if (!partner.empty()) {
                found.emplace_back(topic, partner);
            }
        }
    }
    if (found.size() != 1) {
        throw import_failure{ERROR_ARGUMENT,
                             path_ + ": " + (found.empty() ? "no pair" : "several pairs") +
                                 " of image topics (name one, --topics LEFT,RIGHT): " + have};
    }
    topics_[0] = found[0].first;
    topics_[1] = found[0].second;
    for (const std::string &topic : topics_) {
        if (std::find(all.begin(), all.end(), topic) == all.end()) {
            throw import_failure{ERROR_MISSING,
                                 path_ + ": no images of the topic \"" + topic + "\": " + have};
        }
    }
}

/// The next message of any topic.
bool ros_source::read(recording_message *message) {
    while (reading_ < readers_.size()) {
        if (readers_[reading_]->next(message)) {
            const std::string &encoding = message->channel->encoding;
            if (encoding != "cdr" && encoding != "ros1") {
                continue;
            }
            return true;
        }
        reading_++;
    }
    return false;
}

/// The side of a camera_info's topic; -1: of none.
int ros_source::info_side(const recording_channel &channel) const {
    for (int side = 0; side < 2; side++) {
        if (channel.topic == info_topic(topics_[side]) &&
            channel.type == ros_camera_info_type.name) {
            return side;
        }
    }
    return -1;
}

/// The first camera_info of each side as files; one without text: there is none.
std::vector<import_file> ros_source::read_infos() {
    std::vector<import_file> files(2);
    recording_message message{};
    while ((files[0].text.empty() || files[1].text.empty()) && read(&message)) {
        const int side = info_side(*message.channel);
        if (side < 0) {
            continue;
        }
        import_file &file = files[static_cast<size_t>(side)];
        file.path = path_ + ", " + message.channel->topic;
        file.text = info_text(parsed(ros_parse_camera_info, message));
    }
    for (const auto &reader : readers_) {
        reader->rewind();
    }
    reading_ = 0;
    return files;
}

bool ros_source::calibrate(const import_options &options, calibration *value, std::string *where) {
    const std::vector<import_file> files = read_infos();
    *where = path_ + " has no " + info_topic(topics_[files[0].text.empty() ? 0 : 1]);
    if (files[0].text.empty() || files[1].text.empty()) {
        return false;
    }
    import_options how = options;
    how.rectified = how.rectified || topics_[0].find("rect") != std::string::npos;
    std::string why;
    const int code = calibration_file_convert(files, how, value, &why);
    if (code != ERROR_OK) {
        throw import_failure{code, why};
    }
    return true;
}

/// Takes a pair from the waiting images; false: more must be read.
bool ros_source::match(recorded_pair *pair) {
    while (!waiting_[0].empty() && !waiting_[1].empty()) {
        const uint64_t time_ns[2] = {waiting_[0].front().header.time_ns,
                                     waiting_[1].front().header.time_ns};
        const size_t older = time_ns[0] < time_ns[1] ? 0 : 1;
        if (time_ns[1 - older] - time_ns[older] > tolerance_ns_) {
            waiting_[older].pop_front();
            continue;
        }
        for (size_t side = 0; side < 2; side++) {
            const ros_image &image = waiting_[side].front();
            const std::string name = path_ + ", " + topics_[side];
            pair->side[side] =
                image.width_px == 0 ? pair_source_decode(image.data, name) : image_of(image, name);
            pair->time_ns[side] = time_ns[side];
            waiting_[side].pop_front();
        }
        drop_empty_bits(pair);
        return true;
    }
    return false;
}

/// Puts an image to those that wait for their partner.
void ros_source::keep(const recording_message &message) {
    for (size_t side = 0; side < 2; side++) {
        if (message.channel->topic == topics_[side] && is_image(*message.channel)) {
            waiting_[side].push_back(parsed(message.channel->type == ros_image_type.name
                                                ? ros_parse_image
                                                : ros_parse_compressed,
                                            message));
        }
        if (waiting_[side].size() > waiting_max) {
            waiting_[side].pop_front();
        }
    }
}

bool ros_source::next(recorded_pair *pair) {
    recording_message message{};
    while (!match(pair)) {
        if (!read(&message)) {
            return false;
        }
        keep(message);
    }
    return true;
}

}  // namespace

std::unique_ptr<pair_source> pair_source_ros(const pair_source_request &request,
                                             const std::vector<std::string> &files) {
    return std::make_unique<ros_source>(request, files);
}
