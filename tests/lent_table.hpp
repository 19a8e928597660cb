// SPDX-License-Identifier: Apache-2.0
/// A rectification table with its memory, and rows of whole images.
#ifndef VERGENCE_TESTS_LENT_TABLE_HPP
#define VERGENCE_TESTS_LENT_TABLE_HPP

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "core/error.h"
#include "stereo/geometry/rectify.h"

struct lent_table {
    std::vector<unsigned char> memory;
    rectify_table table = {};

    lent_table(const rectify_plan &plan, const calibration &rig, rectify_side side)
        : memory(rectify_table_need_bytes(&plan)) {
        arena working;
        arena_init(&working, memory.data(), memory.size());
        REQUIRE(rectify_table_make(&plan, &rig, side, &working, &table) == ERROR_OK);
    }
};

/// Row y of a whole raw image; pixels outside the span, which is returned, are 0. `rgb` may be
/// null.
inline rectify_span rectified_row(const rectify_table &table, const image_u8 &grey,
                                  const image_rgb8 &colour, int y, uint8_t *row, uint8_t *rgb) {
    const auto width = static_cast<size_t>(table.width_px);
    std::vector<int32_t> work(2 * width);
    const rectify_strip strip = {0, table.raw_height_px, grey, colour};
    const rectify_extent extent = rectify_row_extent(&table, y, work.data());
    std::fill_n(row, width, uint8_t{0});
    if (rgb != nullptr) {
        std::fill_n(rgb, 3 * width, uint8_t{0});
    }
    rectify_row_strip(&table, &strip, &extent, y, row, rgb, work.data());
    return extent.span;
}

#endif
