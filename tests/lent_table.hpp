// SPDX-License-Identifier: Apache-2.0
/// A rectification table with its memory.
#ifndef VERGENCE_TESTS_LENT_TABLE_HPP
#define VERGENCE_TESTS_LENT_TABLE_HPP

#include <doctest/doctest.h>

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

#endif
