// SPDX-License-Identifier: Apache-2.0
// The pairs of a recorded session, one at a time: the command `pair N` chooses.
#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "daemon/images/picture.h"
#include "daemon/session/session_pairs.h"
#include "stereo/geometry/calibration.h"
#include "tools/host/recordings/session_calibration.hpp"
#include "tools/host/view/view_source.hpp"

namespace {

constexpr int side_max_px = 1024;  // of a picture in the browser

class session : public view_source {
  public:
    session(const char *path, const char *calibration) : path_(path) {
        if (calibration != nullptr) {
            calibration_ = calibration;
        }
    }
    ~session() override { release(); }

    bool open(std::string *error);
    bool next(view_picture *picture, bool calibrated) override;
    void run(const std::string &command,
             const std::function<bool(const std::string &)> &show) override;
    void cancel() override {}
    std::string fetch(const std::string &, const std::string &, std::string *) override {
        return path_;
    }
    bool send(const std::string &, const std::string &, std::string *error) override {
        *error = "a recorded session takes no files";
        return false;
    }
    std::string name() const override { return path_; }
    bool is_live() const override { return false; }
    void stop() override {
        const std::lock_guard<std::mutex> lock(mutex_);
        stopping_ = true;
        changed_.notify_all();
    }

  private:
    int load(unsigned number, view_picture *picture, message *last_error);
    void release() {
        for (raw_image &image : images_) {
            raw_image_release(&image);
        }
    }

    std::string path_, calibration_;
    session_pairs pairs_{};
    raw_image images_[2]{};
    unsigned count_ = 0;
    std::mutex mutex_;
    std::condition_variable changed_;
    unsigned wanted_ = 1, shown_ = 0;
    bool stopping_ = false;
};

bool session::open(std::string *error) {
    message last_error{};
    session_reader reader{};
    int code = session_reader_open(&reader, AT_FDCWD, path_.c_str(), nullptr, &last_error);
    if (code == ERROR_OK) {
        code = session_pairs_find(&pairs_, &reader, 0, &last_error);
        count_ = pairs_.count;
        calibration value{};
        if (code == ERROR_OK && !calibration_.empty()) {
            code =
                session_calibration(reader, pairs_, calibration_.c_str(), 1, &value, &last_error);
            // It may be for other pairs of the session: each picture says whether it fits.
            code = code == ERROR_SIZE_MISMATCH || code == ERROR_RANGE ? ERROR_OK : code;
        }
        session_reader_close(&reader);
    }
    *error = code == ERROR_OK ? "" : last_error.text;
    return code == ERROR_OK;
}

int session::load(unsigned number, view_picture *picture, message *last_error) {
    session_reader reader{};
    std::memset(&pairs_, 0, sizeof pairs_);
    int code = session_reader_open(&reader, AT_FDCWD, path_.c_str(), nullptr, last_error);
    if (code != ERROR_OK) {
        return code;
    }
    release();
    code = session_pairs_find(&pairs_, &reader, number, last_error);
    for (int side = 0; side < 2 && code == ERROR_OK; side++) {
        images_[side] = pairs_.pair.pair.frame[side].image;
        code =
            session_reader_load(&reader, &images_[side], pairs_.pair.frame_crc[side], last_error);
    }
    const raw_image &left = images_[0];
    if (code == ERROR_OK &&
        (left.width_px != images_[1].width_px || left.height_px != images_[1].height_px)) {
        code = message_set(last_error, ERROR_SIZE_MISMATCH, "pair %u: frames of two sizes", number);
    }
    if (code != ERROR_OK) {
        session_reader_close(&reader);
        return code;
    }
    const int side_px = std::max(left.width_px, left.height_px);
    const int shrink = (side_px + side_max_px - 1) / side_max_px;
    struct picture both {};
    code = picture_develop_pair(&images_[0], &images_[1], shrink, true, &both);
    if (code != ERROR_OK) {
        session_reader_close(&reader);
        return message_set(last_error, code, "pair %u: %s", number, error_text(code));
    }
    picture->width_px = both.width_px;
    picture->height_px = both.height_px;
    picture->channels = both.channels;
    picture->pixels.assign(both.pixels,
                           both.pixels + both.row_bytes * static_cast<std::size_t>(both.height_px));
    std::free(both.pixels);
    calibration value{};
    code = session_calibration(reader, pairs_, calibration_.c_str(), shrink, &value, last_error);
    session_reader_close(&reader);
    char text[CALIBRATION_TEXT_MAX_BYTES];
    if (code == ERROR_OK && calibration_print(&value, text, sizeof text) > 0) {
        picture->calibration = text;
    } else {
        picture->without = last_error->text;
    }
    return ERROR_OK;
}

bool session::next(view_picture *picture, bool) {
    unsigned number = 0;
    {
        constexpr std::chrono::milliseconds patience(200);
        std::unique_lock<std::mutex> lock(mutex_);
        if (!changed_.wait_for(lock, patience, [this] { return stopping_ || wanted_ != shown_; }) ||
            stopping_) {
            return false;
        }
        number = wanted_;
        shown_ = number;
    }
    message last_error{};
    if (load(number, picture, &last_error) != ERROR_OK) {
        picture->error = last_error.text;
        return false;
    }
    picture->facts = nlohmann::json{{"pair", number}, {"pairs", count_}}.dump();
    return true;
}

void session::run(const std::string &command,
                  const std::function<bool(const std::string &)> &show) {
    const unsigned long number =
        command.compare(0, 5, "pair ") == 0 ? std::strtoul(command.c_str() + 5, nullptr, 10) : 0;
    if (number < 1 || number > count_) {
        show(view_failed("ARGUMENT", "this is a recorded session: only \"pair 1\" to \"pair " +
                                         std::to_string(count_) + "\" can be chosen"));
        return;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    wanted_ = static_cast<unsigned>(number);
    changed_.notify_all();
    show(nlohmann::json{{"ok", true}, {"result", {{"pair", number}}}}.dump());
}

}  // namespace

std::unique_ptr<view_source> view_session_open(const char *path, const char *calibration,
                                               std::string *error) {
    auto made = std::make_unique<session>(path, calibration);
    return made->open(error) ? std::move(made) : nullptr;
}
