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
    for (auto &mean : axes.lens) {
        mean = {INT32_MIN, 0};
        if (upto(random, 3) > 0) {
            const auto number = static_cast<std::int32_t>(upto(random, 2000)) - 1000;
            const bool whole = upto(random, 3) == 0;
            mean = {whole ? number * 16 : number,
                    static_cast<std::uint16_t>(whole ? 0 : 1 + upto(random, UINT16_MAX - 1))};
        }
    }
    return axes;
}

inline void random_frame(Random &random, pair_frame &frame, std::vector<std::uint16_t> &pixels) {
    frame.image.layout = static_cast<raw_layout>(upto(random, 2));
    frame.image.bits = static_cast<int>(8 + upto(random, 8));
    frame.image.width_px = static_cast<int>(1 + upto(random, 40));
    frame.image.height_px = static_cast<int>(1 + upto(random, 30));
    frame.image.stride =
        static_cast<std::ptrdiff_t>(raw_image_row_values(&frame.image) + upto(random, 5));
    pixels.resize(static_cast<std::size_t>(frame.image.stride * frame.image.height_px));
    for (auto &pixel : pixels) {
        pixel = static_cast<std::uint16_t>(upto(random, (1u << frame.image.bits) - 1));
    }
    frame.image.data = pixels.data();
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
    frame.parts = static_cast<std::uint8_t>(upto(random, PAIR_PARTS_MAX));
    for (int i = 0; i < frame.parts; i++) {
        frame.part[i] = {static_cast<std::uint32_t>(random()), static_cast<std::uint16_t>(random()),
                         static_cast<std::uint16_t>(1 + upto(random, UINT16_MAX - 1))};
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
    bool same = a.pan_q4 == b.pan_q4;
    for (int axis = 0; axis < LENS_AXES; axis++) {
        same = same && a.lens[axis].position_q4 == b.lens[axis].position_q4 &&
               a.lens[axis].sigma_q4 == b.lens[axis].sigma_q4;
    }
    return same;
}

inline bool same_parts(const pair_frame &a, const pair_frame &b) {
    bool same = a.parts == b.parts;
    for (int i = 0; same && i < a.parts; i++) {
        same = a.part[i].exposure_us == b.part[i].exposure_us &&
               a.part[i].gain_q3 == b.part[i].gain_q3 && a.part[i].frames == b.part[i].frames;
    }
    return same;
}

/// Whether two frames are equal except for their pixels.
inline bool same_frame(const pair_frame &a, const pair_frame &b) {
    return a.image.width_px == b.image.width_px && a.image.height_px == b.image.height_px &&
           a.image.bits == b.image.bits && a.image.layout == b.image.layout &&
           a.sequence == b.sequence && a.begin_us == b.begin_us && a.end_us == b.end_us &&
           a.exposure_us == b.exposure_us && a.gain_q3 == b.gain_q3 &&
           same_axes(a.before, b.before) && same_axes(a.after, b.after) &&
           a.window.column_px == b.window.column_px && a.window.row_px == b.window.row_px &&
           a.window.skip == b.window.skip && a.has_picture == b.has_picture &&
           std::memcmp(&a.picture, &b.picture, sizeof a.picture) == 0 && same_parts(a, b);
}

/// Whether two images of one size and layout have the same pixels.
inline bool same_pixels(const raw_image &a, const raw_image &b) {
    bool same = true;
    for (int y = 0; same && y < a.height_px; y++) {
        same = std::memcmp(raw_image_row(&a, y), raw_image_row(&b, y),
                           raw_image_row_values(&a) * sizeof *a.data) == 0;
    }
    return same;
}

/// Whether an event's pair equals `made`, to the last pixel; its number is assigned by the session.
inline bool same_pair(const session_reader &reader, const session_event &event,
                      const struct pair &made) {
    const struct pair &a = event.pair, &b = made;
    bool same =
        a.skew_us == b.skew_us && a.checked == b.checked && a.change_permille == b.change_permille;
    for (int side = 0; side < RIG_SIDES && same; side++) {
        const pair_frame &frame = a.frame[side], &expected = b.frame[side];
        raw_image read = frame.image;
        message last_error{};
        same = same_frame(frame, expected) &&
               session_reader_load(&reader, &read, event.frame_crc[side], &last_error) == 0;
        same = same && same_pixels(read, expected.image);
        raw_image_release(&read);
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
