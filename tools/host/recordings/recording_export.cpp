// SPDX-License-Identifier: Apache-2.0
#include "tools/host/recordings/recording_export.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>

#include "core/error.h"
#include "daemon/base/process.h"
#include "daemon/cli/options.h"
#include "daemon/cli/progress.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/file_io.h"
#include "daemon/files/input_file.h"
#include "stereo/geometry/geometry.h"
#include "tools/host/convert/export.hpp"
#include "tools/host/formats/whole_file.hpp"
#include "tools/host/recordings/frame_messages.hpp"
#include "tools/host/recordings/mcap_records.hpp"
#include "tools/host/recordings/mcap_writer.hpp"
#include "tools/host/recordings/recording_result.hpp"
#include "tools/host/recordings/session_calibration.hpp"

namespace {

constexpr uint64_t second_ns = 1000000000, microsecond_ns = 1000;
constexpr double degree_rad = 0.017453292519943295, metre = 1000;  // mm
constexpr int file_mode = 0666;

const char *const camera_frames[2] = {"left_camera", "right_camera"};
const char *const sides[2] = {"left", "right"};

using failure = frame_failure;

/// The session's date in ns since 1970; 0: none is stated.
uint64_t date_ns(const char *date) {
    std::tm at{};
    if (std::sscanf(date, "%4d-%2d-%2dT%2d:%2d:%2dZ", &at.tm_year, &at.tm_mon, &at.tm_mday,
                    &at.tm_hour, &at.tm_min, &at.tm_sec) != 6) {
        return 0;
    }
    at.tm_year -= 1900;
    at.tm_mon -= 1;
    const std::time_t seconds = timegm(&at);
    return seconds > 0 ? static_cast<uint64_t>(seconds) * second_ns : 0;
}

std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.10g", value);
    return text;
}

class exporter {
  public:
    explicit exporter(const export_recording &request)
        : request_(request), pairs_(std::make_unique<session_pairs>()) {}
    ~exporter() { session_reader_close(&reader_); }
    exporter(const exporter &) = delete;
    exporter &operator=(const exporter &) = delete;

    /// Writes all pairs to `mcap`.
    void run(mcap_writer *mcap);

  private:
    void check(int code) const;
    unsigned count();
    void read_result(unsigned last);
    void pair(mcap_writer *mcap);
    void frames(mcap_writer *mcap, const ros_header &header);
    void calibrated(mcap_writer *mcap, const ros_header &header);
    void axes(mcap_writer *mcap, const ros_header &header);
    void result(mcap_writer *mcap, const ros_header &header);

    const export_recording &request_;
    session_reader reader_{};
    std::unique_ptr<session_pairs> pairs_;
    std::unique_ptr<recording_result> result_;
    message message_{};
    uint64_t date_ns_ = 0, first_us_ = 0;
    bool noted_ = false;
};

void exporter::check(int code) const {
    if (code < 0) {
        throw failure{options_exit_code(code), message_.text};
    }
}

/// Opens the session and counts its pairs.
unsigned exporter::count() {
    const auto begin = std::make_unique<session_event>();
    check(session_reader_open(&reader_, AT_FDCWD, request_.session, begin.get(), &message_));
    date_ns_ = date_ns(begin->date);
    check(session_pairs_find(pairs_.get(), &reader_, request_.pair, &message_));
    const unsigned pairs = pairs_->count;
    if (reader_.cut && request_.pair == 0) {
        std::fprintf(stderr,
                     "vergence: note: %s was cut off or is still being written: there may be more "
                     "pairs\n",
                     request_.session);
    }
    session_reader_rewind(&reader_);
    std::memset(pairs_.get(), 0, sizeof *pairs_);
    return pairs;
}

/// Messages of both images.
void exporter::frames(mcap_writer *mcap, const ros_header &header) {
    develop_balance balance{};
    for (int side = 0; side < 2; side++) {
        raw_image image = pairs_->pair.pair.frame[side].image;
        check(session_reader_load(&reader_, &image, pairs_->pair.frame_crc[side], &message_));
        const std::unique_ptr<raw_image, void (*)(raw_image *)> owner(&image, raw_image_release);
        if (side == 0) {
            balance = develop_balance_of(&image);
        }
        ros_image out = request_.compressed ? frame_compressed_message(image, balance)
                                            : frame_raw_message(image);
        out.header = header;
        out.header.frame = camera_frames[side];
        const std::string topic = std::string("/") + sides[side] + "/image_raw";
        if (request_.compressed) {
            mcap->message(topic + "/compressed", ros_compressed_image_type, header.time_ns,
                          ros_print_compressed(out));
        } else {
            mcap->message(topic, ros_image_type, header.time_ns, ros_print(out));
        }
    }
}

ros_transform pose(const ros_header &header, const char *parent, const char *child) {
    ros_transform made{header, child, {}, {}};
    made.header.frame = parent;
    return made;
}

/// What the calibration states: both cameras, and where the right one is.
void exporter::calibrated(mcap_writer *mcap, const ros_header &header) {
    calibration value{};
    const int code = session_calibration(
        reader_, *pairs_, request_.calibration != nullptr ? request_.calibration : "", 1, &value,
        &message_);
    if (code == ERROR_MISSING && request_.calibration == nullptr) {
        if (!noted_) {
            std::fprintf(stderr, "vergence: note: %s: no camera_info: %s\n", request_.session,
                         message_.text);
        }
        noted_ = true;
        return;
    }
    check(code);
    export_rectified rectified;
    const int rectify = export_rectify(value, &rectified);
    if (rectify != ERROR_OK) {
        check(message_set(&message_, rectify, "%s: the pair cannot be rectified: %s",
                          request_.session, error_text(rectify)));
    }
    double P_left[12], P_right[12];
    export_projections(rectified, metre, P_left, P_right);
    for (int side = 0; side < 2; side++) {
        ros_camera_info info =
            side == 0 ? frame_camera_info(value.left, rectified.R_rect_left, P_left)
                      : frame_camera_info(value.right, rectified.R_rect_right, P_right);
        info.header = header;
        info.header.frame = camera_frames[side];
        mcap->message(std::string("/") + sides[side] + "/camera_info", ros_camera_info_type,
                      header.time_ns, ros_print(info));
    }
    // p_left = R^T (p_right - t).
    ros_transform right = pose(header, camera_frames[0], camera_frames[1]);
    double R[9], moved_mm[3];
    for (int i = 0; i < 3; i++) {
        right.rotation_rad[i] = -value.rotation_right_left_rad[i];
    }
    geometry_rotation_from_vector(right.rotation_rad, R);
    geometry_rotate(R, value.translation_right_left_mm, moved_mm);
    for (int i = 0; i < 3; i++) {
        right.translation_m[i] = -moved_mm[i] / metre;
    }
    mcap->message("/tf", ros_transforms_type, header.time_ns,
                  ros_print(std::vector<ros_transform>{right}));
}

/// Pan, and the positions of all axes.
void exporter::axes(mcap_writer *mcap, const ros_header &header) {
    calibration_match_state state;
    calibration_match_pair(pairs_->pair.profile,
                           pairs_->has_instrument ? &pairs_->instrument : nullptr,
                           &pairs_->pair.pair, &state);
    std::vector<ros_status> statuses;
    for (int side = 0; side < 2; side++) {
        const pair_frame &frame = pairs_->pair.pair.frame[side];
        const std::string name = sides[side];
        statuses.push_back({name + " camera",
                            "",
                            pairs_->has_instrument ? pairs_->instrument.camera[side] : "",
                            {{"begin_us", std::to_string(frame.begin_us)},
                             {"exposure_us", std::to_string(frame.exposure_us)},
                             {"gain", number(frame.gain_q3 / 8.0)}}});
        for (int axis = 0; axis < CALIBRATION_AXES; axis++) {
            const calibration_axis &at = state.origin.side[side].axis[axis];
            if (at.kind == CALIBRATION_AXIS_KNOWN) {
                statuses.push_back({name + " " + calibration_reply_axis_name(axis),
                                    "",
                                    "",
                                    {{"position", number(at.mean)},
                                     {"moved", number(at.spread)},
                                     {"unit", calibration_reply_axis_unit(axis)}}});
            }
        }
    }
    mcap->message("/diagnostics", ros_diagnostics_type, header.time_ns,
                  ros_print(header, statuses));
    const calibration_axis &pan = state.origin.side[0].axis[CALIBRATION_PAN];
    if (pan.kind == CALIBRATION_AXIS_KNOWN) {
        ros_transform left = pose(header, "rig", camera_frames[0]);
        left.rotation_rad[1] = pan.mean * degree_rad;  // y is down: positive is to the right
        mcap->message("/tf", ros_transforms_type, header.time_ns,
                      ros_print(std::vector<ros_transform>{left}));
    }
}

void exporter::result(mcap_writer *mcap, const ros_header &header) {
    ros_transform rectified = pose(header, camera_frames[0], "left_rectified");
    const double *const R = result_->rotation_rect_left;
    const double R_left_rect[9] = {R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8]};
    if (geometry_vector_from_rotation(R_left_rect, rectified.rotation_rad) != ERROR_OK) {
        throw failure{CLIENT_BAD_INPUT, std::string(request_.result) + "/result.json: damaged"};
    }
    mcap->message("/tf", ros_transforms_type, header.time_ns,
                  ros_print(std::vector<ros_transform>{rectified}));
    result_->disparity.image.header = {header.time_ns, rectified.frame};
    mcap->message("/disparity", ros_disparity_type, header.time_ns, ros_print(result_->disparity));
    if (!result_->points.fields.empty()) {
        result_->points.header = {header.time_ns, camera_frames[0]};
        mcap->message("/points", ros_points_type, header.time_ns, ros_print(result_->points));
    }
}

void exporter::pair(mcap_writer *mcap) {
    const ::pair &taken = pairs_->pair.pair;
    const uint64_t left_us = taken.frame[0].begin_us;
    ros_header header{date_ns_ + microsecond_ns * (left_us - std::min(first_us_, left_us)), "rig"};
    axes(mcap, header);
    calibrated(mcap, header);
    frames(mcap, header);
    if (result_ != nullptr && result_->pair == pairs_->count) {
        result(mcap, header);
    }
}

/// Reads the result, which must be of one of the pairs up to `last`.
void exporter::read_result(unsigned last) {
    std::string why;
    result_ = std::make_unique<recording_result>();
    if (recording_result_read(request_.result, result_.get(), &why) != ERROR_OK) {
        throw failure{CLIENT_BAD_INPUT, why};
    }
    result_->pair = std::max(result_->pair, 1u);
    if (result_->pair > last || (request_.pair != 0 && result_->pair != request_.pair)) {
        throw failure{CLIENT_BAD_INPUT, std::string(request_.result) + ": is of pair " +
                                            std::to_string(result_->pair) +
                                            ", which is not exported"};
    }
}

void exporter::run(mcap_writer *mcap) {
    const unsigned last = count();
    if (request_.result != nullptr) {
        read_result(last);
    }
    progress bar;
    const double work = 1;
    progress_begin(&bar, request_.quiet);
    progress_expect(&bar, &work, 1);
    const std::unique_ptr<progress, void (*)(progress *)> shown(&bar, progress_end);
    while (pairs_->count < last) {
        const int got = session_pairs_next(pairs_.get(), &reader_, &message_);
        check(got);
        if (got == 0) {
            throw failure{CLIENT_BAD_INPUT,
                          std::string(request_.session) + ": changed during the export"};
        }
        first_us_ = pairs_->count == 1 ? pairs_->pair.pair.frame[0].begin_us : first_us_;
        if (request_.pair == 0 || pairs_->count == request_.pair) {
            pair(mcap);
            if (!mcap->end_chunk()) {
                return;  // the caller knows why
            }
        }
        progress_show(&bar, 0, "exporting", static_cast<int>(pairs_->count),
                      static_cast<int>(last));
    }
}

/// Refuses to replace what is not an MCAP file.
void check_target(const char *path) {
    const bool exists = access(path, F_OK) == 0;
    if (exists &&
        (input_file_is_directory(path) || whole_file_head(path, mcap_magic.size()) != mcap_magic)) {
        throw failure{CLIENT_FAILED, std::string(path) +
                                         ": exists and is not an MCAP file (move "
                                         "it, or give another --mcap)"};
    }
}

[[noreturn]] void fail_write(const char *path) {
    const std::string name = path;
    if (errno == EINTR) {
        throw failure{interrupt_exit_code(), name + ": interrupted"};
    }
    throw failure{CLIENT_FAILED, name + ": cannot write: " + std::strerror(errno)};
}

void write_recording(const export_recording &request) {
    check_target(request.file);
    exporter work(request);
    atomic_file file;
    if (!atomic_file_begin(&file, AT_FDCWD, request.file, file_mode)) {
        fail_write(request.file);
    }
    int error = 0;  // of the first failed write
    const auto write = [&](const std::string &bytes) {
        errno = EINTR;
        if (!interrupt_requested() && write_all(file.fd, bytes.data(), bytes.size())) {
            return true;
        }
        error = error == 0 ? errno : error;
        return false;
    };
    mcap_writer mcap(write);
    try {
        work.run(&mcap);
    } catch (...) {
        errno = EINTR;
        atomic_file_end(&file, false);
        throw;
    }
    const bool written = mcap.end();
    errno = error;
    if (!atomic_file_end(&file, written)) {
        fail_write(request.file);
    }
}

}  // namespace

int recording_export(const export_recording *request, message *why) {
    try {
        write_recording(*request);
        return CLIENT_OK;
    } catch (const failure &failed) {
        message_set(why, ERROR_OK, "%s", failed.text.c_str());
        return failed.exit_code;
    } catch (const std::bad_alloc &) {
        message_set(why, ERROR_OK, "%s: out of memory", request->session);
        return CLIENT_FAILED;
    }
}
