// SPDX-License-Identifier: Apache-2.0
// Lens moves in steps, with frames in between, on the simulated rig.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdio>

#include "bench/rig_bench.hpp"
#include "rig/lens_move.h"
#include "rig/rig_camera.h"
#include "rig/safe.h"
#include "rig/trigger.h"

using rig_bench::RigBench;

namespace {

struct Axis {
    unsigned side;
    lens_axis axis;
    int32_t target;
};

constexpr Axis kLeftZoom = {RIG_LEFT, LENS_ZOOM, 450}, kRightFocus = {RIG_RIGHT, LENS_FOCUS, 460};

struct Run {
    double seconds;
    unsigned frames;
};

// Moves these axes at once, and takes a frame of the left camera after each step.
Run move_with_frames(RigBench &bench, const std::vector<Axis> &axes) {
    std::vector<rig_lens_move> moves(axes.size());
    const uint64_t begin_us = bench.now_us();
    Run run{};
    for (size_t i = 0; i < axes.size(); i++) {
        REQUIRE(rig_lens_move_begin(&bench.rig, &moves[i], 1u << axes[i].side, axes[i].axis,
                                    axes[i].target, LENS_MOVE_IF_NEEDED) == ERROR_OK);
    }
    for (bool done = false; !done;) {
        done = true;
        for (rig_lens_move &move : moves) {
            REQUIRE(rig_lens_move_step(&bench.rig, &move, 0) == ERROR_OK);
            done = done && rig_lens_move_done(&move);
        }
        hal_camera_frame frame{};
        REQUIRE(rig_camera_take(&bench.rig, RIG_LEFT, bench.now_us(), &frame) == ERROR_OK);
        raw_image_release(&frame.image);
        run.frames++;
    }
    run.seconds = double(bench.now_us() - begin_us) * 1e-6;
    for (const Axis &axis : axes) {
        int32_t positions[LENS_AXES];
        REQUIRE(rig_lens_read(&bench.rig, axis.side, positions) == ERROR_OK);
        CHECK(std::abs(positions[axis.axis] - axis.target) <= 6);
    }
    return run;
}

}  // namespace

TEST_CASE("both lenses move at once while frames are taken, sooner than one after the other") {
    RigBench bench;
    REQUIRE_MESSAGE(rig_bringup(&bench.rig) == ERROR_OK, bench.rig.last_error.text);
    const Run at_once = move_with_frames(bench, {kLeftZoom, kRightFocus});
    CHECK(at_once.frames >= 10);
    // Back, then one after the other over the same ways.
    int32_t begin[] = {300, 560};
    REQUIRE(rig_lens_move_to(&bench.rig, 1, LENS_ZOOM, begin[0]) == ERROR_OK);
    REQUIRE(rig_lens_move_to(&bench.rig, 2, LENS_FOCUS, begin[1]) == ERROR_OK);
    const Run left = move_with_frames(bench, {kLeftZoom});
    const Run right = move_with_frames(bench, {kRightFocus});
    MESSAGE("at once " << at_once.seconds << " s with " << at_once.frames
                       << " frames; one after the other " << left.seconds << " + " << right.seconds
                       << " s");
    CHECK(at_once.seconds < 0.85 * (left.seconds + right.seconds));
}

TEST_CASE("a camera that is gone stays the reason while moves end") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    rig_lens_move moves[RIG_SIDES];
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        REQUIRE(rig_lens_move_begin(&bench.rig, &moves[side], 1u << side, LENS_FOCUS, 700,
                                    LENS_MOVE_IF_NEEDED) == ERROR_OK);
    }
    bench.control("fault camera right silent");
    hal_camera_frame frame{};
    REQUIRE(rig_camera_take(&bench.rig, RIG_RIGHT, bench.now_us(), &frame) == ERROR_TIMEOUT);
    const std::string reason = bench.rig.last_error.text;
    CHECK(reason.rfind("right camera: ", 0) == 0);
    rig_fail_safe(&bench.rig, ERROR_TIMEOUT);
    for (rig_lens_move &move : moves) {
        int error = ERROR_OK;
        while (!rig_lens_move_done(&move)) {
            error = rig_lens_move_step(&bench.rig, &move, bench.now_us() + 1000);
        }
        CHECK(error == ERROR_NOT_READY);
        CHECK(bench.rig.last_error.text == reason);
    }
}
