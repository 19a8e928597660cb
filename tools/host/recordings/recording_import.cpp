// SPDX-License-Identifier: Apache-2.0
#include "tools/host/recordings/recording_import.hpp"

#include <dirent.h>
#include <fcntl.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <ctime>

#include "core/error.h"
#include "daemon/base/process.h"
#include "daemon/files/input_file.h"
#include "daemon/files/standard_paths.h"
#include "daemon/session/session_write.h"
#include "tools/host/convert/calibration_file.hpp"
#include "tools/host/recordings/pair_source.hpp"

namespace {

constexpr uint64_t second_ns = 1000000000, microsecond_ns = 1000;

/// The profile that plays sessions without calls.
const char *const profile = "two-cameras";

bool has_ending(const std::string &text, const std::string &ending) {
    return text.size() >= ending.size() &&
           text.compare(text.size() - ending.size(), ending.size(), ending) == 0;
}

/// ROS's recordings in a directory, the tenth behind the ninth.
std::vector<std::string> recording_files(const std::string &directory) {
    std::vector<std::string> files;
    DIR *const stream = opendir(directory.c_str());
    while (const dirent *const entry = stream != nullptr ? readdir(stream) : nullptr) {
        for (const char *const ending : {".mcap", ".bag", ".bag.active", ".db3"}) {
            if (has_ending(entry->d_name, ending)) {
                files.push_back(directory + "/" + entry->d_name);
            }
        }
    }
    if (stream != nullptr) {
        closedir(stream);
    }
    std::sort(files.begin(), files.end(), [](const std::string &a, const std::string &b) {
        return strverscmp(a.c_str(), b.c_str()) < 0;
    });
    return files;
}

std::unique_ptr<pair_source> open_source(const pair_source_request &from) {
    if (from.side_by_side) {
        message why;
        if (!input_file_is_directory(from.path.c_str())) {
            FILE *const file = input_file_open(from.path.c_str(), &why);
            if (file == nullptr) {
                throw import_failure{ERROR_ARGUMENT, why.text};
            }
            std::fclose(file);
        }
        return pair_source_halves(from);
    }
    if (!input_file_is_directory(from.path.c_str())) {
        message why;
        FILE *const file = input_file_open(from.path.c_str(), &why);
        if (file == nullptr) {
            throw import_failure{ERROR_ARGUMENT, why.text};
        }
        std::fclose(file);
        return pair_source_ros(from, {from.path});
    }
    const std::vector<std::string> files = recording_files(from.path);
    return files.empty() ? pair_source_folder(from) : pair_source_ros(from, files);
}

/// A session being written; removed unless it was ended.
class session_file {
  public:
    session_file(const char *path, uint64_t time_ns) : writer_(std::make_unique<session_writer>()) {
        const auto seconds = static_cast<std::time_t>(time_ns / second_ns);
        std::tm at{};
        char date[32];
        gmtime_r(&seconds, &at);
        std::strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%SZ", &at);
        check(session_writer_begin(writer_.get(), AT_FDCWD, path, version_build_id(), profile, date,
                                   &message_));
        begun_ = true;
        begin_ns_ = time_ns / second_ns * second_ns;
    }
    ~session_file() {
        if (begun_) {
            session_writer_discard(writer_.get(), AT_FDCWD);
        }
    }
    session_file(const session_file &) = delete;
    session_file &operator=(const session_file &) = delete;

    void calibrate(const calibration &value) {
        char text[CALIBRATION_TEXT_MAX_BYTES];
        const int length = calibration_print(&value, text, sizeof text);
        check(length < 0 ? message_set(&message_, length, "the calibration: %s", error_text(length))
                         : session_writer_calibration(writer_.get(), text,
                                                      static_cast<size_t>(length), &message_));
    }

    void add(const recorded_pair &from) {
        auto made = std::make_unique<pair>();
        for (size_t side = 0; side < 2; side++) {
            pair_frame &frame = made->frame[side];
            frame.image = from.side[side].image;
            frame.sequence = ++sequence_[side];
            frame.begin_us = frame.end_us =
                (from.time_ns[side] - std::min(begin_ns_, from.time_ns[side])) / microsecond_ns;
            for (pair_axes *axes : {&frame.before, &frame.after}) {
                for (lens_mean &mean : axes->lens) {
                    mean.position_q4 = INT32_MIN;  // no such axis
                }
            }
            pair_frame_assess(&frame);
        }
        made->skew_us = static_cast<int64_t>(made->frame[1].begin_us) -
                        static_cast<int64_t>(made->frame[0].begin_us);
        check(session_writer_pair(writer_.get(), made.get(), &message_));
    }

    void end() {
        check(session_writer_end(writer_.get(), &message_));
        begun_ = false;
    }

  private:
    void check(int code) const {
        if (code < 0) {
            throw import_failure{ERROR_IO, message_.text};
        }
    }

    std::unique_ptr<session_writer> writer_;
    message message_{};
    uint64_t begin_ns_ = 0;
    uint32_t sequence_[2] = {0, 0};
    bool begun_ = false;
};

std::string size_text(const raw_image &image) {
    return std::to_string(image.width_px) + "x" + std::to_string(image.height_px);
}

void check_sizes(const std::string &path, const recorded_pair &pair, const raw_image &first) {
    for (const owned_image &side : pair.side) {
        if (side.image.width_px != first.width_px || side.image.height_px != first.height_px) {
            throw import_failure{ERROR_SIZE_MISMATCH,
                                 path + ": images of different sizes: " + size_text(first) +
                                     " and " + size_text(side.image)};
        }
    }
}

/// The calibration for images of this size; false: the user wants none.
bool read_calibration(const recording_import_request &asked, pair_source *source,
                      const raw_image &image, calibration *value) {
    import_options how;
    how.width_px = image.width_px;
    how.height_px = image.height_px;
    how.rectified = asked.rectified;
    const std::string &named = asked.calibration, &path = asked.source.path;
    std::string why;
    if (named == "none") {
        return false;
    }
    if (!named.empty()) {
        const int code = calibration_file_load(named, how, value, nullptr, &why);
        if (code != ERROR_OK) {
            throw import_failure{code, why};
        }
    } else if (!source->calibrate(how, value, &why)) {
        throw import_failure{ERROR_MISSING, path + ": no calibration: " + why +
                                                " (name one, --calibration FILE, or none)"};
    }
    for (const lens *one : {&value->left, &value->right}) {
        if (one->width_px != image.width_px || one->height_px != image.height_px) {
            throw import_failure{
                ERROR_SIZE_MISMATCH,
                path + ": the calibration is for " + std::to_string(one->width_px) + "x" +
                    std::to_string(one->height_px) + " px, the images have " + size_text(image)};
        }
    }
    return true;
}

}  // namespace

int recording_import(const recording_import_request &asked) {
    const pair_source_request &from = asked.source;
    const std::string &path = from.path;
    message why{};
    if (session_writer_check(AT_FDCWD, asked.out.c_str(), &why) != ERROR_OK) {
        throw import_failure{ERROR_IO, why.text};
    }
    // A source is opened twice: once for the first pair and the calibration, which the session
    // states before its pairs.
    recorded_pair pair;
    calibration value{};
    bool calibrated;
    {
        const std::unique_ptr<pair_source> source = open_source(from);
        if (!source->next(&pair)) {
            throw import_failure{ERROR_MISSING, path +
                                                    ": has no pair of images (are their times "
                                                    "further apart than --tolerance?)"};
        }
        check_sizes(path, pair, pair.side[0].image);
        calibrated = read_calibration(asked, open_source(from).get(), pair.side[0].image, &value);
    }
    const owned_image first = std::move(pair.side[0]);
    standard_paths_make_parent(asked.out.c_str(), 0777);  // the session reports a failure
    session_file session(asked.out.c_str(), pair.time_ns[0]);
    if (calibrated) {
        session.calibrate(value);
    }
    const std::unique_ptr<pair_source> source = open_source(from);
    int taken = 0;
    for (int seen = 0; (asked.pairs == 0 || taken < asked.pairs) && source->next(&pair); seen++) {
        if (interrupt_requested()) {
            throw import_failure{ERROR_CANCELLED, path + ": interrupted"};
        }
        if (seen % asked.every == 0) {
            check_sizes(path, pair, first.image);
            session.add(pair);
            taken++;
        }
    }
    session.end();
    return taken;
}
