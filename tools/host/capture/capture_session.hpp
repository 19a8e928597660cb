// SPDX-License-Identifier: Apache-2.0
/// The session that a capture writes: pairs from the instrument, one after the other, and a cache
/// of their corners. It is complete after every pair, so that a capture can be ended at any time
/// and resumed.
#ifndef VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_SESSION_HPP
#define VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_SESSION_HPP

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "calib/base/corner_cache.hpp"
#include "calib/base/solution.hpp"
#include "daemon/session/session_pairs.h"

struct session_writer;

/// The part of a sensor that a frame shows: column, row, width and height.
using capture_window = std::array<int, 4>;

/// A pair of the session, named by its files; positions are counted from 1.
struct capture_shot : calib::capture {
    std::array<uint16_t, 2> pan_q4{};
    std::array<capture_window, 2> window_px{};
    uint64_t begin_us = 0, end_us = 0;  // time of the exposures, by the instrument's clock
    std::string moved;  // a lens that moved while the pair was taken, as "left zoom"; "": none
};

class capture_session {
  public:
    capture_session(std::string path, const calib::board &board);
    ~capture_session();
    capture_session(const capture_session &) = delete;
    capture_session &operator=(const capture_session &) = delete;

    /// Reads the shots of a session that exists. False with one sentence in `*error`.
    bool load(std::string *error);

    /// Whether the pairs so far were taken of these parts of the sensors. False with one sentence.
    bool check_window(const std::array<capture_window, 2> &window_px, std::string *error) const;

    /// Reads a session of one pair, as the instrument has written it, without adding it: its frames
    /// lie in `incoming`. False with one sentence.
    bool look(const std::string &incoming, capture_shot *shot, std::string *error) const;
    /// Numbers the corners of that pair and of all before by one layout of a coded board.
    void settle_layouts(capture_shot *next);
    /// Adds that pair, whose corners are now known, with the frames.
    bool add(const std::string &incoming, const capture_shot &shot, std::string *error);
    /// Notes the noise of a corner, once a pair was added.
    bool add_noise(const session_corner_noise &noise, std::string *error);
    /// Ends the session, until the next `add`.
    bool close(std::string *error);

    const std::vector<capture_shot> &shots() const { return shots_; }
    const std::string &path() const { return path_; }
    /// The noise of a corner; no frames: it was not measured.
    const session_corner_noise &noise() const { return noise_; }

  private:
    bool open(const std::string &incoming, std::string *error);
    bool read_corners(std::vector<calib::cached_view> *views, std::string *error) const;
    bool write_corners(std::string *error) const;

    std::string path_;
    calib::board board_;
    std::unique_ptr<session_writer> writer_;
    std::vector<capture_shot> shots_;
    session_corner_noise noise_{};
    int noted_position_ = 0;
};

#endif
