// SPDX-License-Identifier: Apache-2.0
// Lens moves in steps that do not wait, several at once. Random; replay a failure with
// VERGENCE_SEED.
#include <doctest/doctest.h>

#include "lens_draw.hpp"

using namespace motion;

namespace {

// A move of its own for each lens.
struct TwoMoves {
    std::array<Draw, 2> draws;
    rig_lens_move moves[2];

    explicit TwoMoves(const Draw &draw, simrig::Noise &noise) : draws{draw, draw}, moves{} {
        for (unsigned side = 0; side < 2; side++) {
            draws[side].sides = 1u << side;
            draws[side].axis = lens_axis(noise.next() % 3);
            draws[side].target = 300 + int32_t(noise.next() % 551);
        }
    }
    int begin(LensRig &lenses, unsigned side) {
        return rig_lens_move_begin(&lenses.rig, &moves[side], draws[side].sides, draws[side].axis,
                                   draws[side].target, LENS_MOVE_IF_NEEDED);
    }
    // Steps the moves `sides` until all are done, with other work between the steps. Returns their
    // results.
    std::array<int, 2> run(LensRig &lenses, LensWorld &world, unsigned sides,
                           const std::function<double()> &pause_us) {
        std::array<int, 2> results{};
        const double begin_us = world.now_us();
        for (bool done = false; !done;) {
            REQUIRE(world.now_us() < begin_us + 60e6);
            done = true;
            for (unsigned side = 0; side < 2; side++) {
                if ((sides >> side & 1) != 0 && !rig_lens_move_done(&moves[side])) {
                    const double before_us = world.now_us();
                    results[side] = rig_lens_move_step(&lenses.rig, &moves[side], 0);
                    CHECK(world.now_us() == before_us);
                    CHECK((results[side] == ERROR_OK || rig_lens_move_done(&moves[side])));
                    done = done && rig_lens_move_done(&moves[side]);
                }
            }
            world.advance(world.now_us() + pause_us());
        }
        return results;
    }
};

}  // namespace

TEST_CASE("both lenses move at once in steps that do not wait, in much less time") {
    const uint64_t seed = synthetic::test_seed();
    double at_once_s = 0, in_turn_s = 0;
    for (uint64_t i = 0; i < draws(300); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        const Draw draw(noise);
        TwoMoves two(draw, noise);
        const uint64_t world_seed = noise.next();
        const auto pause_us = [&] {  // frames, and now and then something longer
            return noise.chance(0.002) ? between(noise, 2e5, 2.5e6) : between(noise, 1e3, 4e4);
        };
        for (const bool at_once : {true, false}) {
            LensWorld world(draw.motors, draw.positions, world_seed);
            world.advance(draw.warm_us);
            LensRig lenses(world);
            REQUIRE(lenses.open() == ERROR_OK);
            const double begin_us = world.now_us();
            for (const unsigned sides :
                 at_once ? std::vector<unsigned>{kBoth} : std::vector<unsigned>{kLeft, kRight}) {
                for (unsigned side = 0; side < 2; side++) {
                    REQUIRE(((sides >> side & 1) == 0 || two.begin(lenses, side) == ERROR_OK));
                }
                const auto results = two.run(lenses, world, sides, pause_us);
                INFO(lenses.rig.last_error.text);
                REQUIRE(results == std::array<int, 2>{});
            }
            (at_once ? at_once_s : in_turn_s) += (world.now_us() - begin_us) * 1e-6;
            check_arrival(two.draws[0], world);
            check_arrival(two.draws[1], world);
            check_rest(world);
        }
    }
    MESSAGE("at once " << at_once_s / double(draws(300)) << " s, in turn "
                       << in_turn_s / double(draws(300)) << " s");
    CHECK(at_once_s < 0.85 * in_turn_s);  // they share the line
}

TEST_CASE("two axes of one lens move at once") {
    const uint64_t seed = synthetic::test_seed();
    for (uint64_t i = 0; i < draws(200); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        const Draw draw(noise);
        TwoMoves two(draw, noise);
        for (unsigned which = 0; which < 2; which++) {
            two.draws[which].sides = kLeft;
            two.draws[which].axis = which == 0 ? LENS_ZOOM : LENS_FOCUS;
        }
        LensWorld world(draw.motors, draw.positions, noise.next());
        LensRig lenses(world);
        REQUIRE(lenses.open() == ERROR_OK);
        REQUIRE(two.begin(lenses, 0) == ERROR_OK);
        REQUIRE(two.begin(lenses, 1) == ERROR_OK);
        const auto results =
            two.run(lenses, world, kBoth, [&] { return between(noise, 1e3, 3e4); });
        INFO(lenses.rig.last_error.text);
        REQUIRE(results == std::array<int, 2>{});
        check_arrival(two.draws[0], world);
        check_arrival(two.draws[1], world);
    }
}

TEST_CASE("of two moves one fails or is cancelled, rests, and does not disturb the other") {
    const uint64_t seed = synthetic::test_seed();
    unsigned cancelled = 0, jammed = 0;
    for (uint64_t i = 0; i < draws(300); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        const Draw draw(noise);
        TwoMoves two(draw, noise);
        LensWorld world(draw.motors, draw.positions, noise.next());
        LensRig lenses(world);
        REQUIRE(lenses.open() == ERROR_OK);
        const unsigned side = unsigned(noise.next() % 2);
        const bool jams = noise.chance(0.5);
        simrig::LensMotor &motor = world.controller.motor(side, LensAxis(two.draws[side].axis));
        for (unsigned each = 0; each < 2; each++) {
            REQUIRE(two.begin(lenses, each) == ERROR_OK);
        }
        world.at(world.now_us() + between(noise, 0, 3e6), [&](double time_us) {
            if (jams) {
                motor.jam(time_us, true);
            } else {
                rig_lens_move_cancel(&lenses.rig, &two.moves[side]);
            }
        });
        const auto results =
            two.run(lenses, world, kBoth, [&] { return between(noise, 1e3, 2e4); });
        REQUIRE(results[1 - side] == ERROR_OK);
        check_arrival(two.draws[1 - side], world);
        motor.jam(world.now_us(), false);
        if (results[side] == ERROR_OK) {
            check_arrival(two.draws[side], world);
            continue;
        }
        REQUIRE(results[side] == (jams ? ERROR_JAMMED : ERROR_CANCELLED));
        (jams ? jammed : cancelled)++;
        check_rest(world, jams ? 3 + 4 * draw.motors[side][two.draws[side].axis].read_noise_counts +
                                     std::abs(simrig::drift_counts(
                                         draw.motors[side][two.draws[side].axis], world.now_us()))
                               : 1);
        REQUIRE(two.begin(lenses, side) == ERROR_OK);
        REQUIRE(two.run(lenses, world, 1u << side, [] { return 1e4; })[side] == ERROR_OK);
        check_arrival(two.draws[side], world);
    }
    CHECK(cancelled > draws(300) / 8);
    CHECK(jammed > draws(300) / 8);
}

TEST_CASE("a coarse move ends near its target, and another one follows at once") {
    const uint64_t seed = synthetic::test_seed();
    double coarse_s = 0, full_s = 0;
    unsigned jammed = 0;
    for (uint64_t i = 0; i < draws(300); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        Draw draw(noise);
        const uint64_t world_seed = noise.next();
        const bool jams = noise.chance(0.1);
        for (const rig_lens_move_when when : {LENS_MOVE_COARSE, LENS_MOVE_ALWAYS}) {
            LensWorld world(draw.motors, draw.positions, world_seed);
            LensRig lenses(world);
            REQUIRE(lenses.open() == ERROR_OK);
            rig_lens_move move{};
            REQUIRE(rig_lens_move_begin(&lenses.rig, &move, draw.sides, draw.axis, draw.target,
                                        when) == ERROR_OK);
            const double begin_us = world.now_us();
            const unsigned side = draw.has(0) ? 0 : 1;
            const double way = std::abs(ring(world, side, draw.axis) - draw.target);
            if (jams) {
                world.controller.motor(side, LensAxis(draw.axis)).jam(world.now_us(), true);
            }
            int error = ERROR_OK;
            while (!rig_lens_move_done(&move)) {
                error = rig_lens_move_step(&lenses.rig, &move, 0);
                world.advance(world.now_us() + 5e3);
            }
            if (jams && way > 60) {
                REQUIRE(error == ERROR_JAMMED);
                jammed++;
                continue;
            }
            REQUIRE((error == ERROR_OK || jams));
            if (jams) {
                continue;
            }
            (when == LENS_MOVE_COARSE ? coarse_s : full_s) += (world.now_us() - begin_us) * 1e-6;
            const LensMotorSettings &motor = draw.motors[side][draw.axis];
            const double late = 0.3 * motor.counts_per_s;  // the median of readings is late
            CHECK((when != LENS_MOVE_COARSE ||
                   std::abs(ring(world, side, draw.axis) - draw.target) <=
                       int(LENS_MOVE_STEP_COUNTS) + late + motor.backlash_counts));
            if (when == LENS_MOVE_COARSE) {  // the motor may still run, away from the next target
                draw.target = std::clamp(draw.target + int32_t(noise.next() % 61) - 30, 300, 850);
                REQUIRE(lenses.go(draw.sides, draw.axis, draw.target) == ERROR_OK);
                check_arrival(draw, world);
            }
        }
    }
    MESSAGE("coarse " << coarse_s / double(draws(300)) << " s, with an approach "
                      << full_s / double(draws(300)) << " s");
    CHECK(coarse_s + 0.3 * double(draws(300)) < full_s);
    CHECK(jammed > draws(300) / 20);
}

TEST_CASE("an axis has one move at a time, and none after a bring-up or in the safe state") {
    LensWorld world({}, {{{300, 300, 850}, {300, 300, 850}}}, 1);
    LensRig lenses(world);
    REQUIRE(lenses.open() == ERROR_OK);
    rig_lens_move move{}, other{};
    REQUIRE(rig_lens_move_begin(&lenses.rig, &move, kBoth, LENS_ZOOM, 800, LENS_MOVE_IF_NEEDED) ==
            ERROR_OK);
    CHECK(rig_lens_move_begin(&lenses.rig, &other, kRight, LENS_ZOOM, 400, LENS_MOVE_IF_NEEDED) ==
          ERROR_NOT_READY);
    CHECK(rig_lens_move_done(&other));
    CHECK(lenses.rig.last_error.part == RIG_PART_RIGHT_LENS);
    REQUIRE(rig_lens_move_begin(&lenses.rig, &other, kRight, LENS_FOCUS, 400,
                                LENS_MOVE_IF_NEEDED) == ERROR_OK);
    for (int i = 0; i < 100; i++) {
        CHECK(rig_lens_move_step(&lenses.rig, &move, 0) == ERROR_OK);
        CHECK(rig_lens_move_step(&lenses.rig, &other, 0) == ERROR_OK);
        world.advance(world.now_us() + 1e4);
    }
    lenses.rig.state = RIG_SAFE;
    int error = ERROR_OK;
    while (!rig_lens_move_done(&move)) {
        error = rig_lens_move_step(&lenses.rig, &move, uint64_t(world.now_us()) + 50000);
    }
    CHECK(error == ERROR_NOT_READY);
    lenses.rig.camera[RIG_RIGHT].lens.moving = 0;  // a bring-up leaves the lens in this state
    CHECK(rig_lens_move_step(&lenses.rig, &other, 0) == ERROR_NOT_READY);
    CHECK(rig_lens_move_done(&other));
    CHECK(rig_lens_move_step(&lenses.rig, &other, 0) == ERROR_OK);
    rig_lens_move_cancel(&lenses.rig, &other);
    CHECK(rig_lens_move_done(&other));
}

TEST_CASE("with an approach from below a move ends from below") {
    const uint64_t seed = synthetic::test_seed();
    for (uint64_t i = 0; i < draws(300); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        const Draw draw(noise);
        LensWorld world(draw.motors, draw.positions, noise.next());
        LensRig lenses(world);
        lenses.rig.profile.lens.axis[draw.axis].approach = LENS_FROM_BELOW;
        REQUIRE(lenses.open() == ERROR_OK);
        for (int pass = 0; pass < 2; pass++) {
            REQUIRE(lenses.go(draw.sides, draw.axis, draw.target) == ERROR_OK);
            for (unsigned side = 0; side < 2; side++) {
                const LensMotorSettings &motor = draw.motors[side][draw.axis];
                const bool room = lens_move_has_room(&lenses.rig.profile.lens.axis[draw.axis],
                                                     draw.target - kTolerance);
                const double error =
                    ring(world, side, draw.axis) + motor.backlash_counts / 2 - draw.target;
                CHECK((!draw.has(side) ||
                       std::abs(error) <= kTolerance + 1.5 + 3 * motor.read_noise_counts +
                                              (room ? 0 : motor.backlash_counts)));
            }
        }
        CHECK(lenses.go(draw.sides, draw.axis, draw.target) == ERROR_OK);
    }
    const lens_axis_settings axis = {300, 850, 80, 10, 3, LENS_FROM_ABOVE};
    CHECK(lens_move_has_room(&axis, 300));
    CHECK(!lens_move_has_room(&axis, 840));
}
