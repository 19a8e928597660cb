// SPDX-License-Identifier: Apache-2.0
#include "tools/host/capture/capture_session.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

#include "calib/base/coded_layout.hpp"
#include "core/error.h"
#include "core/math.h"
#include "daemon/files/atomic_file.h"
#include "daemon/session/session_pairs.h"
#include "daemon/session/session_write.h"
#include "tools/host/formats/report_text.hpp"

namespace {

const char *const corners_name = "corners.vnl";
const char *const board_comment = "## captured with ";
const double q4 = 16;
const double moved_counts = 3, moved_sigmas = 5;  // more than noise
const char *const sides[2] = {"left ", "right "};

std::string base_name(const std::string &path) {
    return path.substr(path.rfind('/') + 1);
}

/// The lens that was not at the same position before and after the frames; "" if all were.
std::string moved_lens(const pair &taken) {
    for (size_t side = 0; side < 2; side++) {
        const pair_frame &frame = taken.frame[side];
        for (const int axis : {LENS_ZOOM, LENS_FOCUS}) {
            const lens_mean &before = frame.before.lens[axis], &after = frame.after.lens[axis];
            const double sigma = std::hypot(before.sigma_q4, after.sigma_q4) / q4;
            if (std::fabs(before.position_q4 - after.position_q4) / q4 >
                std::max(moved_counts, moved_sigmas * sigma)) {
                return std::string(sides[side]) + lens_axis_names[axis];
            }
        }
    }
    return "";
}

capture_shot shot_of(const session_pair_files &files) {
    capture_shot shot;
    shot.position = static_cast<int>(files.board_position);
    shot.focused = files.focused_on_board;
    shot.begin_us = std::min(files.pair->frame[0].begin_us, files.pair->frame[1].begin_us);
    shot.end_us = std::max(files.pair->frame[0].end_us, files.pair->frame[1].end_us);
    shot.moved = moved_lens(*files.pair);
    for (size_t side = 0; side < 2; side++) {
        const pair_axes &axes = files.pair->frame[side].before;
        shot.axes[side] = {
            axes.lens[LENS_ZOOM].position_q4 / q4, axes.lens[LENS_FOCUS].position_q4 / q4,
            files.state.origin.side[side].axis[CALIBRATION_PAN].mean * MATH_RAD_PER_DEGREE};
        shot.pan_q4[side] = axes.pan_q4;
        shot.name[side] = base_name(files.path[side]);
        const pair_frame &frame = files.pair->frame[side];
        shot.window_px[side] = {frame.window.column_px, frame.window.row_px,
                                static_cast<int>(frame.image.width_px),
                                static_cast<int>(frame.image.height_px)};
    }
    return shot;
}

/// What was found in a session.
struct found_pairs {
    std::vector<capture_shot> shots;
    session_corner_noise noise{};
};

void add_shot(void *found, const session_pair_files *files) {
    static_cast<found_pairs *>(found)->shots.push_back(shot_of(*files));
    static_cast<found_pairs *>(found)->noise = files->corner_noise;
}

bool is_same_instrument(const pair_instrument &one, const pair_instrument &other) {
    return std::strcmp(one.camera[0], other.camera[0]) == 0 &&
           std::strcmp(one.camera[1], other.camera[1]) == 0 &&
           std::memcmp(one.servo_centre_q4, other.servo_centre_q4, sizeof one.servo_centre_q4) == 0;
}

/// The options that describe a board: a capture continues with the same.
std::string board_options(const calib::board &board) {
    return report_text_format("--board %dx%d --square %.6g --charuco %s --marker %.6g",
                              board.columns, board.rows, board.square_mm,
                              board.coded() ? board.dictionary.c_str() : "none", board.marker_mm);
}

/// The options in a file of corners; "" if it states none.
std::string options_in(std::istream &in) {
    const std::string begin = board_comment;
    std::string line;
    std::getline(in, line);
    in.clear();
    in.seekg(0);
    return line.compare(0, begin.size(), begin) == 0 ? line.substr(begin.size()) : "";
}

/// The pairs of a session, opened.
struct opened {
    session_reader reader{};
    session_pairs pairs{};
    session_event begin{};
    bool is_open = false;

    ~opened() {
        if (is_open) {
            session_reader_close(&reader);
        }
    }

    /// Finds a pair, see session_pairs_find.
    bool find(const std::string &path, uint32_t number, std::string *error) {
        message last_error{};
        int code = session_reader_open(&reader, AT_FDCWD, path.c_str(), &begin, &last_error);
        is_open = code == ERROR_OK;
        code = is_open ? session_pairs_find(&pairs, &reader, number, &last_error) : code;
        *error = code == ERROR_OK ? "" : last_error.text;
        return code == ERROR_OK;
    }
};

}  // namespace

capture_session::capture_session(std::string path, const calib::board &board)
    : path_(std::move(path)), board_(board), writer_(new session_writer{}) {
    writer_->index = writer_->directory = -1;
}

capture_session::~capture_session() {
    session_writer_leave(writer_.get());
}

/// Reads the corners, if there are any, of the same board.
bool capture_session::read_corners(std::vector<calib::cached_view> *views,
                                   std::string *error) const {
    std::ifstream in(path_ + "/" + corners_name);
    if (!in) {
        return true;
    }
    const std::string options = options_in(in);
    if (!options.empty() && options != board_options(board_)) {
        *error = path_ + ": begun with " + options + " (give the same, or another directory)";
        return false;
    }
    if (!calib::corner_cache_read(in, board_, views, error)) {
        *error = path_ + "/" + corners_name + ": " + *error +
                 " (give the same --board as for the first part of this capture)";
        return false;
    }
    return true;
}

bool capture_session::load(std::string *error) {
    message last_error{};
    if (!session_pairs_here(path_.c_str())) {
        return true;
    }
    found_pairs found_here;
    std::vector<capture_shot> &shots = found_here.shots;
    const int code = session_pairs_read(path_.c_str(), true, add_shot, &found_here, &last_error);
    if (code < 0 && code != ERROR_MISSING) {
        *error = last_error.text;
        return false;
    }
    std::vector<calib::cached_view> views;
    if (!read_corners(&views, error)) {
        return false;
    }
    std::map<std::string, const calib::board_view *> by_name;
    for (const calib::cached_view &one : views) {
        by_name[one.filename] = &one.view;
    }
    for (capture_shot &shot : shots) {
        if (shot.position == 0) {
            *error = path_ +
                     ": not a session of \"vergence calibrate capture\" (give another "
                     "directory)";
            return false;
        }
        for (size_t side = 0; side < 2; side++) {
            const auto found = by_name.find(shot.name[side]);
            shot.view[side] = found != by_name.end() ? *found->second : calib::board_view();
        }
    }
    shots_ = std::move(shots);
    noise_ = found_here.noise;
    return true;
}

bool capture_session::check_window(const std::array<capture_window, 2> &window_px,
                                   std::string *error) const {
    for (size_t side = 0; side < 2 && !shots_.empty(); side++) {
        const capture_window &before = shots_[0].window_px[side], &now = window_px[side];
        if (before != now) {
            *error = report_text_format(
                "%s: begun with a %swindow of %d x %d px at %d, %d, and it is %d x %d at %d, %d "
                "(set the same, or give another directory)",
                path_.c_str(), sides[side], before[2], before[3], before[0], before[1], now[2],
                now[3], now[0], now[1]);
            return false;
        }
    }
    return true;
}

bool capture_session::look(const std::string &incoming, capture_shot *shot,
                           std::string *error) const {
    message last_error{};
    found_pairs found;
    if (session_pairs_read(incoming.c_str(), false, add_shot, &found, &last_error) != 1) {
        *error = last_error.text;
        return false;
    }
    *shot = found.shots[0];
    return check_window(shot->window_px, error);
}

bool capture_session::open(const std::string &incoming, std::string *error) {
    message last_error{};
    const auto from = std::make_unique<opened>();
    if (!from->find(incoming, 1, error)) {
        return false;
    }
    int code = 0;
    if (session_pairs_here(path_.c_str())) {
        const auto before = std::make_unique<opened>();
        if (!shots_.empty() && !before->find(path_, 1, error)) {
            return false;
        }
        if (!shots_.empty() &&
            !is_same_instrument(before->pairs.instrument, from->pairs.instrument)) {
            *error = path_ + ": begun with another instrument (give another directory)";
            return false;
        }
        code = session_writer_resume(writer_.get(), AT_FDCWD, path_.c_str(), &last_error);
    } else {
        const session_event &begin = from->begin;
        code = session_writer_begin(writer_.get(), AT_FDCWD, path_.c_str(), begin.build,
                                    begin.profile, begin.date, &last_error);
        code = code != 0
                   ? code
                   : session_writer_instrument(writer_.get(), &from->pairs.instrument, &last_error);
    }
    *error = code == 0 ? "" : last_error.text;
    noted_position_ = 0;
    return code == 0;
}

bool capture_session::add(const std::string &incoming, const capture_shot &shot,
                          std::string *error) {
    message last_error{};
    if (writer_->index < 0 && !open(incoming, error)) {
        return false;
    }
    const auto from = std::make_unique<opened>();
    if (!from->find(incoming, 1, error)) {
        return false;
    }
    session_event &event = from->pairs.pair;
    int code = 0;
    if (noted_position_ != shot.position) {
        const std::string text = SESSION_BOARD_POSITION + std::to_string(shot.position);
        code = session_writer_command(writer_.get(), text.c_str(), &last_error);
    }
    if (shot.focused && code == 0) {
        code = session_writer_command(writer_.get(), SESSION_FOCUSED_ON_BOARD, &last_error);
    }
    for (int side = 0; side < 2 && code == 0; side++) {
        code = session_reader_load(&from->reader, &event.pair.frame[side].image,
                                   event.frame_crc[side], &last_error);
    }
    code = code == 0 ? session_writer_pair(writer_.get(), &event.pair, &last_error) : code;
    for (pair_frame &frame : event.pair.frame) {
        raw_image_release(&frame.image);
    }
    if (code != 0) {
        *error = last_error.text;
        return false;
    }
    noted_position_ = shot.position;
    shots_.push_back(shot);
    return write_corners(error);
}

void capture_session::settle_layouts(capture_shot *next) {
    std::vector<calib::board_view *> views = {&next->view[0], &next->view[1]};
    for (capture_shot &shot : shots_) {
        views.push_back(&shot.view[0]);
        views.push_back(&shot.view[1]);
    }
    calib::settle_layouts(board_, views);
}

bool capture_session::add_noise(const session_corner_noise &noise, std::string *error) {
    message last_error{};
    const std::string text = report_text_format(SESSION_CORNER_NOISE "%.4f %.4f %u", noise.px[0],
                                                noise.px[1], static_cast<unsigned>(noise.frames));
    const int code = session_writer_command(writer_.get(), text.c_str(), &last_error);
    *error = code == 0 ? "" : last_error.text;
    noise_ = code == 0 ? noise : noise_;
    return code == 0;
}

bool capture_session::write_corners(std::string *error) const {
    std::vector<calib::cached_view> views;
    for (const capture_shot &shot : shots_) {
        for (size_t side = 0; side < 2; side++) {
            views.push_back({shot.name[side], shot.view[side]});
        }
    }
    std::ostringstream out;
    out << board_comment << board_options(board_) << '\n';
    if (!calib::corner_cache_write(out, board_, views, error)) {
        return false;
    }
    const std::string text = out.str();
    const int directory = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const bool written =
        directory >= 0 &&
        atomic_file_write(directory, corners_name, SESSION_FILE_MODE, text.data(), text.size());
    if (!written) {
        *error = path_ + "/" + corners_name + ": cannot be written: " + std::strerror(errno);
    }
    if (directory >= 0) {
        ::close(directory);
    }
    return written;
}

bool capture_session::close(std::string *error) {
    message last_error{};
    const int code = session_writer_end(writer_.get(), &last_error);
    *error = code == 0 ? "" : last_error.text;
    return code == 0;
}
