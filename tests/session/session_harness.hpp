// SPDX-License-Identifier: Apache-2.0
/// Random frames, pairs and events, and comparison with sessions read back.
#ifndef VERGENCE_TESTS_SESSION_HARNESS_HPP
#define VERGENCE_TESTS_SESSION_HARNESS_HPP

#include <doctest/doctest.h>
#include <fcntl.h>

#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "daemon/session/session_read.h"
#include "daemon/session/session_write.h"

namespace session_harness {

using Random = std::mt19937_64;

inline std::uint64_t upto(Random &random, std::uint64_t max) {
    return std::uniform_int_distribution<std::uint64_t>(0, max)(random);
}

/// A pair that owns its pixels.
struct owned_pair {
    pair value{};
    std::vector<std::uint16_t> pixels[RIG_SIDES];
};

inline pair_axes random_axes(Random &random) {
    pair_axes axes{};
    axes.pan_q4 = static_cast<std::uint16_t>(upto(random, UINT16_MAX));
    for (auto &position : axes.position) {
        position =
            upto(random, 3) == 0 ? INT32_MIN : static_cast<std::int32_t>(upto(random, 2000)) - 1000;
    }
    return axes;
}

inline void random_frame(Random &random, pair_frame &frame, std::vector<std::uint16_t> &pixels) {
    frame.layout = static_cast<hal_camera_layout>(upto(random, 2));
    frame.bits = static_cast<std::uint8_t>(8 + upto(random, 8));
    frame.width_px = static_cast<std::uint16_t>(1 + upto(random, 40));
    frame.height_px = static_cast<std::uint16_t>(1 + upto(random, 30));
    frame.stride = session_frame_row_values(&frame) + static_cast<std::uint32_t>(upto(random, 5));
    pixels.resize(std::size_t{frame.stride} * frame.height_px);
    for (auto &pixel : pixels) {
        pixel = static_cast<std::uint16_t>(upto(random, (1u << frame.bits) - 1));
    }
    frame.data = pixels.data();
    frame.sequence = static_cast<std::uint32_t>(random());
    frame.begin_us = random();
    frame.end_us = random();
    frame.exposure_us = static_cast<std::uint32_t>(random());
    frame.gain_q3 = static_cast<std::uint16_t>(random());
    if (upto(random, 1) == 1) {
        frame.window = {static_cast<std::uint16_t>(upto(random, UINT16_MAX)),
                        static_cast<std::uint16_t>(upto(random, UINT16_MAX)),
                        static_cast<std::uint8_t>(1 + upto(random, 7))};
    }
    frame.has_picture = upto(random, 1) == 1;
    if (frame.has_picture) {
        for (std::uint16_t *share :
             {&frame.picture.brightness_permille, &frame.picture.saturated_permille,
              &frame.picture.black_permille, &frame.picture.sharpness_permille}) {
            *share = static_cast<std::uint16_t>(upto(random, PICTURE_STATS_MAX_PERMILLE));
        }
    }
    frame.before = random_axes(random);
    frame.after = random_axes(random);
}

inline void random_pair(Random &random, owned_pair &made) {
    made.value = {};
    made.value.number = static_cast<std::uint32_t>(random());
    made.value.skew_us = static_cast<std::int64_t>(upto(random, 2000000)) - 1000000;
    made.value.checked = upto(random, 1) == 1;
    made.value.change_permille = static_cast<std::uint32_t>(upto(random, 1000));
    for (int side = 0; side < RIG_SIDES; side++) {
        random_frame(random, made.value.frame[side], made.pixels[side]);
    }
}

inline bool same_axes(const pair_axes &a, const pair_axes &b) {
    return a.pan_q4 == b.pan_q4 && std::memcmp(a.position, b.position, sizeof a.position) == 0;
}

/// Whether two frames are equal except for their pixels.
inline bool same_frame(const pair_frame &a, const pair_frame &b) {
    return a.width_px == b.width_px && a.height_px == b.height_px && a.bits == b.bits &&
           a.layout == b.layout && a.sequence == b.sequence && a.begin_us == b.begin_us &&
           a.end_us == b.end_us && a.exposure_us == b.exposure_us && a.gain_q3 == b.gain_q3 &&
           same_axes(a.before, b.before) && same_axes(a.after, b.after) &&
           a.window.column_px == b.window.column_px && a.window.row_px == b.window.row_px &&
           a.window.skip == b.window.skip && a.has_picture == b.has_picture &&
           std::memcmp(&a.picture, &b.picture, sizeof a.picture) == 0;
}

/// Whether an event's pair equals `made`, to the last pixel; its number is assigned by the session.
inline bool same_pair(const session_reader &reader, const session_event &event,
                      const owned_pair &made) {
    const pair &a = event.pair, &b = made.value;
    bool same =
        a.skew_us == b.skew_us && a.checked == b.checked && a.change_permille == b.change_permille;
    for (int side = 0; side < RIG_SIDES && same; side++) {
        const pair_frame &frame = a.frame[side], &expected = b.frame[side];
        const std::size_t row = session_frame_row_values(&frame);
        std::vector<std::uint16_t> pixels(row * frame.height_px);
        message last_error{};
        same = same_frame(frame, expected) &&
               session_reader_frame(&reader, &frame, event.frame_crc[side], pixels.data(),
                                    pixels.size(), &last_error) == 0;
        for (std::size_t y = 0; y < frame.height_px && same; y++) {
            same = std::memcmp(&pixels[y * row], expected.data + y * expected.stride,
                               row * sizeof pixels[0]) == 0;
        }
    }
    return same;
}

inline std::unique_ptr<session_writer> new_writer() {
    auto writer = std::make_unique<session_writer>();
    writer->directory = writer->index = -1;
    return writer;
}

}  // namespace session_harness

#endif
