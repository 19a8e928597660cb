// SPDX-License-Identifier: Apache-2.0
// A measurement's decisions when steps fail, nothing is seen, or values make no sense.
#include <doctest/doctest.h>

#include <cmath>
#include <iterator>
#include <random>

#include "console/measure_text.h"
#include "core/error.h"
#include "measure/measure.h"
#include "synthetic/seed.hpp"
#include "unit/measure/measure_world.hpp"

using namespace measure_world;

TEST_CASE("a subject that the wide view does not show is measured by its focus, or not at all") {
    World world(6);
    world.surface_shows = false;
    const measure_result result = run(world, wish(MEASURE_WISH_FIT, 600), whole_rig());
    CHECK(result.error == ERROR_OK);
    CHECK(lost(result, MEASURE_LOSS_COARSE));
    CHECK((world.sees(270) && world.sees(-270)));
    World blank(7);
    blank.surface_shows = false;
    blank.meddle = [](const measure_step &step, measure_event &event) {
        event.error = step.kind == MEASURE_STEP_AUTOFOCUS ? ERROR_NO_FOCUS : event.error;
    };
    const measure_result nothing = run(blank, wish(MEASURE_WISH_FIT, 300), whole_rig());
    CHECK(nothing.error == ERROR_NO_SURFACE);
    CHECK(nothing.advice == MEASURE_ADVICE_TEXTURE);
    // Texture does not show in the dark.
    World dark(7);
    dark.surface_shows = false;
    dark.light = 0.01;
    dark.meddle = [&](const measure_step &step, measure_event &event) {
        event.error = step.kind == MEASURE_STEP_LIGHT ? ERROR_RANGE : event.error;
        blank.meddle(step, event);
    };
    const measure_result unlit = run(dark, wish(MEASURE_WISH_FIT, 300), whole_rig());
    CHECK(unlit.advice == MEASURE_ADVICE_LIGHT);
    CHECK(!lost(unlit, MEASURE_LOSS_COARSE));
    World away(7);
    away.meddle = [](const measure_step &, measure_event &event) {
        event.surface.sigma_mm = 0.5 * event.surface.depth_mm;
    };
    CHECK(run(away, wish(MEASURE_WISH_FIT, 300), whole_rig()).advice == MEASURE_ADVICE_NEARER);
}

TEST_CASE("texture is asked for only where the scene showed no surface") {
    for (const int error : {ERROR_FULL, ERROR_MEMORY, ERROR_NO_SURFACE}) {
        World world(14);
        world.meddle = [error](const measure_step &step, measure_event &event) {
            event.error = step.kind == MEASURE_STEP_SURFACE ? error : event.error;
        };
        const measure_result result = run(world, wish(MEASURE_WISH_FIT, 360), whole_rig());
        CHECK(result.error == error);
        CHECK(result.advice ==
              (error == ERROR_NO_SURFACE ? MEASURE_ADVICE_TEXTURE : MEASURE_ADVICE_NOTHING));
    }
}

TEST_CASE("a wide pair that failed after the aim is taken once more before the pair") {
    World world(5);
    world.subject_mm[0] = 245;
    world.meddle = [](const measure_step &step, measure_event &event) {
        event.error = step.phase == MEASURE_AIMED_PAIR ? ERROR_FRAME : event.error;
    };
    const measure_result result = run(world, wish(MEASURE_WISH_FIT, 360), whole_rig());
    CHECK(result.error == ERROR_OK);
    REQUIRE(world.has(MEASURE_AIM));
    CHECK(world.last(MEASURE_OTHER_ZOOM).axes.side[0].zoom_counts == 300);
    CHECK(result.with_pair != 0);
    CHECK(result.with_pair < result.pair);
}

TEST_CASE("cameras that the calibration does not fit ask for a new one") {
    World world(13);
    world.meddle = [](const measure_step &step, measure_event &event) {
        event.misfit = step.kind == MEASURE_STEP_SURFACE;
    };
    const measure_result result = run(world, wish(MEASURE_WISH_FIT, 360), whole_rig());
    CHECK(result.error == ERROR_OK);
    CHECK(lost(result, MEASURE_LOSS_MISFIT));
    CHECK(result.advice == MEASURE_ADVICE_CALIBRATE);
}

TEST_CASE("pictures that do not match are a loss, however sure the few points are") {
    World world(13);
    world.meddle = [](const measure_step &step, measure_event &event) {
        event.unlike = step.kind == MEASURE_STEP_SURFACE;
    };
    const measure_result result = run(world, wish(MEASURE_WISH_FIT, 360), whole_rig());
    CHECK(result.error == ERROR_OK);
    CHECK(lost(result, MEASURE_LOSS_UNLIKE));
    CHECK(result.advice == MEASURE_ADVICE_AIM);
}

TEST_CASE("a light that could not be set is not called dark") {
    World world(17);
    world.meddle = [](const measure_step &step, measure_event &event) {
        event.error = step.phase == MEASURE_LIGHT ? ERROR_MOVED : event.error;
    };
    const measure_result result = run(world, wish(MEASURE_WISH_FIT, 360), whole_rig());
    CHECK(result.error == ERROR_OK);
    CHECK(lost(result, MEASURE_LOSS_NOT_EXPOSED));
    CHECK(!lost(result, MEASURE_LOSS_DARK));
    CHECK(result.advice != MEASURE_ADVICE_LIGHT);
}

TEST_CASE("a lens that jams is to be freed, whatever the surface says of the calibration") {
    for (const measure_phase phase : {MEASURE_ZOOM, MEASURE_IRIS, MEASURE_MIDDLE}) {
        World world(18);
        world.meddle = [phase](const measure_step &step, measure_event &event) {
            event.error = step.phase == phase ? ERROR_JAMMED : event.error;
            event.misfit = step.kind == MEASURE_STEP_SURFACE;
        };
        const measure_result result = run(world, wish(MEASURE_WISH_FIT, 360), whole_rig());
        CHECK(result.error == ERROR_OK);
        CHECK(
            lost(result, phase == MEASURE_ZOOM ? MEASURE_LOSS_NOT_ZOOMED : MEASURE_LOSS_NOT_SHARP));
        CHECK(result.advice == MEASURE_ADVICE_FREE);
    }
}

TEST_CASE("what moves is taken once more, then given up") {
    for (const int often : {1, 100}) {
        World world(8);
        int left = often;
        world.meddle = [&](const measure_step &step, measure_event &event) {
            if (step.phase == MEASURE_PAIR && left-- > 0) {
                event.error = ERROR_MOVED;
            }
        };
        const measure_result result = run(world, wish(MEASURE_WISH_FIT, 300), whole_rig());
        CHECK(result.error == (often == 1 ? ERROR_OK : ERROR_MOVED));
        CHECK(result.advice == (often == 1 ? MEASURE_ADVICE_NOTHING : MEASURE_ADVICE_STILL));
    }
}

TEST_CASE("every step may fail, be cancelled or lose the instrument") {
    World whole(9);
    whole.dark_part = 0.2;
    REQUIRE(run(whole, wish(MEASURE_WISH_ZOOM, 1), whole_rig()).error == ERROR_OK);
    const std::size_t count = whole.steps.size();
    for (std::size_t failing = 0; failing < count; failing++) {
        for (const int error : {ERROR_CANCELLED, ERROR_RANGE, ERROR_MOVED, ERROR_JAMMED}) {
            for (const bool always : {false, true}) {
                World world(9);
                world.dark_part = 0.2;
                measure_phase phase = whole.steps[failing].phase;
                world.meddle = [&](const measure_step &step, measure_event &event) {
                    if (step.phase == phase && (always || world.steps.size() == failing + 1)) {
                        event.error = error;
                        event.lost = error == ERROR_JAMMED;
                    }
                };
                const measure_result result = run(world, wish(MEASURE_WISH_ZOOM, 1), whole_rig());
                INFO(measure_phase_text(phase), ", error ", error, always ? ", always" : ", once");
                if (error == ERROR_CANCELLED) {
                    CHECK(result.error == ERROR_CANCELLED);
                    CHECK(result.phase == phase);
                } else if (result.error == ERROR_OK) {
                    CHECK(result.pair != 0);
                    // What failed each time is said, but for what the result does not depend on.
                    const bool harmless = phase <= MEASURE_WIDE_FOCUS || phase == MEASURE_MIDDLE ||
                                          phase == MEASURE_OTHER_FOCUS ||
                                          phase == MEASURE_OTHER_LIGHT || !always;
                    CHECK((harmless || result.losses != 0));
                } else {
                    CHECK(result.error == error);
                }
                if (error == ERROR_JAMMED && failing > 0 && phase > MEASURE_PAIR &&
                    phase < MEASURE_SURFACE) {
                    CHECK(lost(result, MEASURE_LOSS_STOPPED));
                    CHECK(result.error == ERROR_OK);
                }
            }
        }
    }
}

TEST_CASE("a pair that was taken before the instrument stopped is measured") {
    for (const measure_phase phase : {MEASURE_PAIR, MEASURE_MERGED}) {
        World world(9);
        world.dark_part = 0.2;
        bool stopped = false;  // and stays so, while the surface is computed too
        world.meddle = [&](const measure_step &step, measure_event &event) {
            event.lost = stopped = stopped || step.phase == phase;
        };
        const measure_result result = run(world, wish(MEASURE_WISH_ZOOM, 1), whole_rig());
        INFO(measure_phase_text(phase));
        CHECK(result.error == ERROR_OK);
        CHECK(lost(result, MEASURE_LOSS_STOPPED));
        CHECK(result.pair == uint32_t(world.pairs));
    }
}

TEST_CASE("values that no instrument gives end a measurement without harm") {
    const uint64_t seed = synthetic::test_seed();
    INFO("VERGENCE_SEED=", seed);
    static const double values[] = {NAN, INFINITY, -INFINITY, 0, -1, 1e300, -1e300, 1e-300};
    Random random(seed);
    for (int i = 0; i < 2000; i++) {
        World world(seed + static_cast<uint64_t>(i));
        world.meddle = [&](const measure_step &, measure_event &event) {
            double *const fields[] = {&event.axes.side[0].zoom_counts,
                                      &event.axes.side[1].focus_counts,
                                      &event.axes.side[1].pan_rad,
                                      &event.f_number,
                                      &event.light.exposure_us,
                                      &event.light.gain,
                                      &event.light.reached,
                                      &event.focus_mm,
                                      &event.pair.dark_part,
                                      &event.subject.left_mm[0],
                                      &event.subject.left_mm[2],
                                      &event.subject.right_px[0],
                                      &event.subject.near_mm,
                                      &event.subject.far_mm,
                                      &event.subject.width_mm,
                                      &event.surface.sigma_mm};
            if (random() % 3 == 0) {
                *fields[random() % std::size(fields)] = values[random() % std::size(values)];
            }
        };
        measure_request request = wish(static_cast<measure_wish>(random() % 4), 5);
        run(world, request, whole_rig());
    }
    for (const double value : values) {
        World world(1);
        const bool valid = value > 0 && value < 1e100;
        const int error = run(world, wish(MEASURE_WISH_FIT, value), whole_rig()).error;
        CHECK((valid || error == ERROR_ARGUMENT));
        measure_request range = wish(MEASURE_WISH_ZOOM, 2);
        range.near_mm = value;
        range.far_mm = 1;
        World other(1);
        CHECK((value == 0 || value == 1e-300 ||
               run(other, range, whole_rig()).error == ERROR_ARGUMENT));
    }
}

TEST_CASE("stated depths that no view of both cameras has are refused before anything moves") {
    const double near_mm[] = {100, 1700, 300}, far_mm[] = {200, 2000, 30000};
    for (const bool known : {false, true}) {
        measure_instrument rig = whole_rig();
        rig.ready = known;
        for (int i = 0; i < 3; i++) {
            measure_request request = wish(MEASURE_WISH_FIT, 300);
            request.near_mm = near_mm[i];
            request.far_mm = far_mm[i];
            World world(10);
            const measure_result result = run(world, request, rig);
            CHECK((result.error == ERROR_OVERLAP) == (i == 0));
            CHECK(world.steps.empty() == (i == 0));
        }
        // Turned away from each other, they see nothing far off either.
        rig.axes.side[0].pan_rad = -0.9;
        rig.axes.side[1].pan_rad = 0.9;
        measure_request request = wish(MEASURE_WISH_FIT, 300);
        request.near_mm = 1700;
        request.far_mm = 2000;
        World world(10);
        CHECK((run(world, request, rig).error == ERROR_OVERLAP) == known);
        // A small window has neither end of the depths in both views, and the middle.
        for (int side = 0; side < 2; side++) {
            rig.frames.edge_px[side][0] = {943.5, 1103.5};
            rig.frames.edge_px[side][1] = {707.5, 827.5};
            rig.axes.side[side].pan_rad = side == 0 ? 0.0694 : -0.0694;  // at 1800 mm
        }
        rig.frames.skip = 1;
        request.near_mm = 1000;
        request.far_mm = 4000;
        World small(10);
        CHECK(run(small, request, rig).error != ERROR_OVERLAP);
    }
}

TEST_CASE("a wish out of reach is met as nearly as possible, and says so") {
    World world(10);
    const measure_result result = run(world, wish(MEASURE_WISH_DENSITY, 5000), whole_rig());
    CHECK(result.error == ERROR_OK);
    CHECK(lost(result, MEASURE_LOSS_OUT_OF_REACH));
    CHECK(world.last(MEASURE_ZOOM).reason.why == MEASURE_WHY_ZOOM_NEAREST);
    const double f_px = zoom_rig::camera_at(0, 850, 544, 0, false).fx;
    CHECK(result.density_per_mm2 == doctest::Approx(f_px * f_px / 1800 / 1800).epsilon(0.05));
}
