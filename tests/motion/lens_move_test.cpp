// SPDX-License-Identifier: Apache-2.0
// Lens moves with the simulated controller and its motors: play, noise, outliers, drift, jams, and
// lines that lose, change or delay bytes. Random; replay a failure with VERGENCE_SEED.
#include <doctest/doctest.h>

#include <cstdio>
#include <cstdlib>

#include "lens_draw.hpp"
#include "synthetic/seed.hpp"

using namespace motion;
using simrig::LensAxis;
using simrig::LensMotorSettings;

TEST_CASE("a lens arrives, from above, wherever it stood") {
    const uint64_t seed = synthetic::test_seed();
    for (uint64_t i = 0; i < draws(500); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        const Draw draw(noise);
        LensWorld world(draw.motors, draw.positions, noise.next());
        world.advance(draw.warm_us);
        LensRig lenses(world);
        REQUIRE(lenses.open() == ERROR_OK);
        const double begin_us = world.now_us();
        INFO("target " << draw.target << " sides " << draw.sides << " axis " << draw.axis);
        const int error = lenses.go(draw.sides, draw.axis, draw.target);
        INFO(lenses.rig.last_error.text);
        REQUIRE(error == ERROR_OK);
        check_arrival(draw, world);
        CHECK(world.now_us() - begin_us <= double(limit_us(lenses, draw)));
        CHECK(lenses.longest_silence_us <= 100000);
        CHECK(!lenses.went_back);
        check_rest(world);
        // Again to the same position.
        REQUIRE(lenses.go(draw.sides, draw.axis, draw.target) == ERROR_OK);
        check_arrival(draw, world);
    }
}

TEST_CASE("a jam is reported in time, and no jammed lens arrives") {
    const uint64_t seed = synthetic::test_seed();
    unsigned after_arrival = 0;
    std::vector<double> reported;  // seconds after the jam
    for (uint64_t i = 0; i < draws(500); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        const Draw draw(noise);
        LensWorld world(draw.motors, draw.positions, noise.next());
        world.advance(draw.warm_us);
        LensRig lenses(world);
        REQUIRE(lenses.open() == ERROR_OK);
        unsigned side = unsigned(noise.next() % 2);
        side = draw.has(side) ? side : 1 - side;
        const double begin_us = world.now_us(), jam_us = begin_us + between(noise, 0, 6e6);
        simrig::LensMotor &motor = world.controller.motor(side, LensAxis(draw.axis));
        world.at(jam_us, [&motor](double time_us) { motor.jam(time_us, true); });
        const int error = lenses.go(draw.sides, draw.axis, draw.target);
        INFO(lenses.rig.last_error.text << " target " << draw.target << " side " << side);
        const double end_us = world.now_us();
        if (error == ERROR_OK) {
            check_arrival(draw, world);
            after_arrival++;
            continue;
        }
        REQUIRE(error == ERROR_JAMMED);
        CHECK(lenses.rig.last_error.part == (side == 0 ? RIG_PART_LEFT_LENS : RIG_PART_RIGHT_LENS));
        // Down, up, and down once more; each with the first readings of a leg.
        const uint64_t leg_us =
            lens_move_stall_us(&lenses.rig.profile, draw.axis) + LENS_MOVE_STALL_US;
        CHECK(end_us - jam_us <= double(3 * leg_us + LENS_MOVE_REST_US));
        reported.push_back((end_us - std::max(jam_us, begin_us)) * 1e-6);
        // When freed, it moves only to the position that its potentiometer had reported.
        motor.jam(end_us, false);
        const LensMotorSettings &settings = draw.motors[side][draw.axis];
        check_rest(world, 3 + 4 * settings.read_noise_counts +
                              std::abs(simrig::drift_counts(settings, end_us)));
        // Then it moves again.
        REQUIRE(lenses.go(draw.sides, draw.axis, draw.target) == ERROR_OK);
        check_arrival(draw, world);
    }
    REQUIRE(reported.size() > draws(500) / 4);
    std::sort(reported.begin(), reported.end());
    MESSAGE("jams reported " << reported.size() << ", arrived before " << after_arrival
                             << "; seconds until then p50 " << reported[reported.size() / 2]
                             << " p99 " << reported[reported.size() * 99 / 100] << " max "
                             << reported.back());
    CHECK(reported[reported.size() / 2] < 2.5);
    CHECK(after_arrival > draws(500) / 10);
}

TEST_CASE("cancelled at any moment the motors rest") {
    const uint64_t seed = synthetic::test_seed();
    unsigned cancelled = 0;
    for (uint64_t i = 0; i < draws(300); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        const Draw draw(noise);
        LensWorld world(draw.motors, draw.positions, noise.next());
        LensRig lenses(world);
        REQUIRE(lenses.open() == ERROR_OK);
        lenses.cancel_us = world.now_us() + between(noise, 0, 5e6);
        const int error = lenses.go(draw.sides, draw.axis, draw.target);
        if (error == ERROR_OK) {
            check_arrival(draw, world);
            continue;
        }
        REQUIRE(error == ERROR_CANCELLED);
        CHECK(lenses.longest_silence_us <= 100000);
        CHECK(world.now_us() - lenses.cancelled_us <= LENS_MOVE_REST_US);
        check_rest(world);
        cancelled++;
        lenses.cancel_us = 1e18;
        REQUIRE(lenses.go(draw.sides, draw.axis, draw.target) == ERROR_OK);
        check_arrival(draw, world);
    }
    CHECK(cancelled > draws(300) / 4);
}

TEST_CASE("on a bad line a move arrives, or says so in time, and is never wrong") {
    const uint64_t seed = synthetic::test_seed();
    unsigned arrived = 0, timeouts = 0, jams = 0;
    for (uint64_t i = 0; i < draws(400); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        const Draw draw(noise);
        LensWorld world(draw.motors, draw.positions, noise.next());
        LensRig lenses(world);
        REQUIRE(lenses.open() == ERROR_OK);
        simrig::SerialFaults &faults = world.controller.line().faults;
        faults.late_ms = noise.chance(0.5) ? between(noise, 0, 600) : 0;
        faults.split_ms = noise.chance(0.5) ? between(noise, 0, 300) : 0;
        faults.garbage_chance = noise.chance(0.5) ? between(noise, 0, 0.03) : 0;
        faults.lost_chance = noise.chance(0.5) ? between(noise, 0, 0.01) : 0;
        const double begin_us = world.now_us();
        const int error = lenses.go(draw.sides, draw.axis, draw.target);
        INFO(lenses.rig.last_error.text << " target " << draw.target);
        INFO("late " << faults.late_ms << " split " << faults.split_ms << " garbage "
                     << faults.garbage_chance);
        CHECK(world.now_us() - begin_us <= double(limit_us(lenses, draw)));
        CHECK(lenses.longest_silence_us <= 100000);
        arrived += error == ERROR_OK;
        timeouts += error == ERROR_TIMEOUT;
        jams += error == ERROR_JAMMED;
        if (error == ERROR_OK) {
            check_arrival(draw, world);
        }
        REQUIRE((error == ERROR_OK || error == ERROR_TIMEOUT || error == ERROR_JAMMED));
    }
    MESSAGE("arrived " << arrived << ", time-outs " << timeouts << ", jams " << jams);
    CHECK(arrived > draws(400) * 8 / 10);
}

TEST_CASE("a controller that is slow, or loses an answer now and then, is not taken for dead") {
    const uint64_t seed = synthetic::test_seed();
    for (uint64_t i = 0; i < draws(300); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        const Draw draw(noise);
        LensWorld world(draw.motors, draw.positions, noise.next());
        LensRig lenses(world);
        simrig::SerialFaults &faults = world.controller.line().faults;
        const bool slow = noise.chance(0.5);
        faults.late_ms = between(noise, 0, slow ? 600 : 60);
        faults.split_ms = slow ? between(noise, 0, 100) : 0;
        // Chance per byte: one answer in ten is lost.
        faults.lost_chance = slow ? 0 : between(noise, 0, 0.002);
        REQUIRE(lenses.open() == ERROR_OK);
        for (int k = 0; k < 10; k++) {
            int32_t positions[LENS_AXES];
            INFO(lenses.rig.last_error.text << " late " << faults.late_ms << " lost "
                                            << faults.lost_chance);
            REQUIRE(rig_lens_read(&lenses.rig, k % 2 == 0 ? RIG_LEFT : RIG_RIGHT, positions) ==
                    ERROR_OK);
        }
    }
}

TEST_CASE("a silent line is reported within two seconds, and then the lenses rest") {
    const uint64_t seed = synthetic::test_seed();
    for (uint64_t i = 0; i < draws(200); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        const Draw draw(noise);
        LensWorld world(draw.motors, draw.positions, noise.next());
        LensRig lenses(world);
        REQUIRE(lenses.open() == ERROR_OK);
        const double silent_us = world.now_us() + between(noise, 0, 3e6);
        world.at(silent_us, [&](double) { world.controller.line().faults.silent = true; });
        const int error = lenses.go(draw.sides, draw.axis, draw.target);
        if (error == ERROR_OK) {
            CHECK(world.now_us() <= silent_us + 60000);  // an answer that was on its way
            check_arrival(draw, world);
            continue;
        }
        CHECK(error == ERROR_TIMEOUT);
        CHECK(std::string(lenses.rig.last_error.text).find("1700 ms") != std::string::npos);
        CHECK(world.now_us() - silent_us <= 1.7e6 + double(LENS_MOVE_REST_US) + 2e5);
        CHECK(lenses.longest_silence_us <= 100000);
    }
}

TEST_CASE("a command that is lost is sent again") {
    for (int from_ms = 100; from_ms < 260; from_ms += 10) {
        INFO("lost from " << from_ms << " ms on");
        LensWorld world({}, {{{500, 300, 850}, {300, 300, 850}}}, synthetic::test_seed());
        LensRig lenses(world);
        REQUIRE(lenses.open() == ERROR_OK);
        double &lost = world.controller.line().faults.lost_chance;
        const double begin_us = world.now_us() + from_ms * 1000;
        world.at(begin_us, [&](double) { lost = 1; });
        world.at(begin_us + 40000, [&](double) { lost = 0; });
        CHECK(lenses.go(kLeft, LENS_ZOOM, 600) == ERROR_OK);
        CHECK(std::abs(ring(world, 0, LENS_ZOOM) - 2 - 600) <= kTolerance + 3);
    }
}

TEST_CASE("readings of which one in twenty is anything do not make it come from below") {
    const uint64_t seed = synthetic::test_seed();
    for (uint64_t i = 0; i < draws(500); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        std::array<LensWorld::Motors, 2> motors;
        motors[0][simrig::kZoom].outlier_chance = 0.05;
        motors[0][simrig::kZoom].backlash_counts = 8;
        const int32_t target = 700 + int32_t(noise.next() % 40);
        const double from = target - between(noise, 20, 100);
        LensWorld world(motors, {{{from, 300, 850}, {300, 300, 850}}}, noise.next());
        LensRig lenses(world);
        REQUIRE(lenses.open() == ERROR_OK);
        REQUIRE(lenses.go(kLeft, LENS_ZOOM, target) == ERROR_OK);
        CHECK(std::abs(ring(world, 0, LENS_ZOOM) - 4 - target) <= kTolerance + 4);
    }
}

TEST_CASE("what cannot be asked for is refused and moves nothing") {
    LensWorld world({}, {{{300, 300, 850}, {300, 300, 850}}}, 1);
    LensRig lenses(world);
    REQUIRE(lenses.open() == ERROR_OK);
    CHECK(lenses.go(kBoth, LENS_ZOOM, 299) == ERROR_RANGE);
    const std::string text = lenses.rig.last_error.text;
    CHECK_MESSAGE(text.rfind("left lens: position 299", 0) == 0, text);
    CHECK_MESSAGE(text.find("300 to 850") != std::string::npos, text);
    CHECK(lenses.go(kRight, LENS_FOCUS, 851) == ERROR_RANGE);
    CHECK(lenses.rig.last_error.part == RIG_PART_RIGHT_LENS);
    CHECK(lenses.go(0, LENS_ZOOM, 400) == ERROR_ARGUMENT);
    CHECK(lenses.go(4, LENS_ZOOM, 400) == ERROR_ARGUMENT);
    CHECK(lenses.go(kLeft, LENS_AXES, 400) == ERROR_ARGUMENT);
    lenses.rig.state = RIG_SAFE;
    CHECK(lenses.go(kLeft, LENS_ZOOM, 400) == ERROR_NOT_READY);
    rig_profile_set_lenses(&lenses.rig.profile, RIG_LENSES_FIXED);
    CHECK(lenses.go(kLeft, LENS_ZOOM, 400) == ERROR_NOT_CONNECTED);
    int32_t positions[LENS_AXES];
    lens_limits limits{};
    CHECK(rig_lens_read(&lenses.rig, 0, positions) == ERROR_NOT_CONNECTED);
    CHECK(rig_lens_read(&lenses.rig, 2, positions) == ERROR_ARGUMENT);
    CHECK(rig_lens_limits(&lenses.rig, 0, LENS_ZOOM, &limits) == ERROR_NOT_CONNECTED);
    check_rest(world);
    CHECK(ring(world, 0, LENS_ZOOM) == doctest::Approx(300));
}

TEST_CASE("both lenses go to positions of their own at once, or neither moves") {
    const int32_t wanted[] = {700, 640}, half[] = {700, 851};
    double took_us[2];
    for (const bool at_once : {false, true}) {
        LensWorld world({}, {{{300, 300, 850}, {300, 300, 850}}}, 1);
        LensRig lenses(world);
        REQUIRE(lenses.open() == ERROR_OK);
        CHECK(rig_lens_move_each(&lenses.rig, kBoth, LENS_ZOOM, half) == ERROR_RANGE);
        check_rest(world);
        const double begin_us = world.now_us();
        for (const unsigned sides : {kLeft, kRight}) {
            REQUIRE(rig_lens_move_each(&lenses.rig, at_once ? kBoth : sides, LENS_ZOOM, wanted) ==
                    ERROR_OK);
            if (at_once) {
                break;
            }
        }
        took_us[at_once] = world.now_us() - begin_us;
        for (unsigned side = 0; side < 2; side++) {
            CHECK(std::abs(ring(world, side, LENS_ZOOM) - wanted[side]) <= kTolerance + kBacklash);
        }
    }
    CHECK(took_us[true] < 0.75 * took_us[false]);
}

TEST_CASE("positions are read in spite of wild readings") {
    std::array<LensWorld::Motors, 2> motors;
    for (auto &side : motors) {
        for (LensMotorSettings &motor : side) {
            motor.outlier_chance = 0.03;
        }
    }
    LensWorld world(motors, {{{320, 400, 500}, {600, 700, 800}}}, synthetic::test_seed());
    LensRig lenses(world);
    REQUIRE(lenses.open() == ERROR_OK);
    unsigned wild = 0;
    for (int i = 0; i < 500; i++) {
        int32_t positions[LENS_AXES];
        REQUIRE(rig_lens_read(&lenses.rig, 1, positions) == ERROR_OK);
        for (int axis = 0; axis < LENS_AXES; axis++) {
            wild += std::abs(positions[axis] - (600 + 100 * axis)) > 4;
        }
    }
    CHECK(wild <= 12);  // two of three: 3 * 0.02^2 of 1500
    lens_limits limits{};
    CHECK(rig_lens_limits(&lenses.rig, 1, LENS_IRIS, &limits) == ERROR_OK);
    CHECK(limits.min == 300);
    CHECK(limits.max == 850);
}

TEST_CASE("the one lens of a V1LC") {
    simrig::LensControllerSettings settings;
    settings.lowest = 44;
    settings.highest = 180;
    std::array<LensWorld::Motors, 2> motors;
    motors[0].fill({});
    for (LensMotorSettings &motor : motors[0]) {
        motor.counts_per_s = 50;
        motor.stop_low = 40;
        motor.stop_high = 184;
        motor.backlash_counts = 1;
    }
    motors[0][simrig::kIris].outlier_chance = 1;  // a V1LC's iris value is known to be random
    LensWorld world(motors, {{{100, 90, 60}, {300, 300, 850}}}, synthetic::test_seed(), settings);
    LensRig lenses(world, true);
    for (lens_axis_settings &axis : lenses.rig.profile.lens.axis) {
        axis.counts_per_s = 30;
    }
    REQUIRE(lenses.open() == ERROR_OK);
    CHECK(lenses.go(kLeft, LENS_ZOOM, 60) == ERROR_OK);
    CHECK(std::abs(ring(world, 0, LENS_ZOOM) - 60) <= kTolerance + 2);
    CHECK(lenses.go(kLeft, LENS_FOCUS, 180) == ERROR_OK);
    CHECK(std::abs(ring(world, 0, LENS_FOCUS) - 180) <= kTolerance + 2);
    CHECK(lenses.go(kLeft, LENS_ZOOM, 181) == ERROR_RANGE);
    CHECK(lenses.go(kLeft, LENS_IRIS, 100) == ERROR_NOT_CONNECTED);
    CHECK(lenses.go(kRight, LENS_ZOOM, 100) == ERROR_NOT_CONNECTED);
    int32_t positions[LENS_AXES];
    REQUIRE(rig_lens_read(&lenses.rig, 0, positions) == ERROR_OK);
    CHECK(positions[LENS_IRIS] == INT32_MIN);
}
