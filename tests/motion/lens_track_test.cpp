// SPDX-License-Identifier: Apache-2.0
// Where a ring was at the time of a frame, from the readings of a move, against the simulated
// motor's ring. Source of the figures in firmware/rig/lens_move.h. Random; replay a failure with
// VERGENCE_SEED.
#include <doctest/doctest.h>

#include <cstdio>
#include <string>

#include "lens_draw.hpp"

using namespace motion;

namespace {

struct Errors {
    double squares = 0, worst = 0, scaled = 0;
    unsigned count = 0;
    void add(double error, double sigma) {
        squares += error * error;
        scaled += error * error / sigma / sigma;
        worst = std::max(worst, std::abs(error));
        count++;
    }
    double rms() const { return std::sqrt(squares / std::max(count, 1u)); }
    double over_sigma() const { return std::sqrt(scaled / std::max(count, 1u)); }
};

constexpr size_t kAround = 31;  // frames: 0.3 s

// The ring at a time.
struct Truth {
    double time_us, ring;
};

struct Sweeps {
    Errors steady, turning, rest;
    double readings_per_s = 0;

    // Frames every `frame_us` while the lenses `sides` move up and down, the right one's zoom with
    // the left one's focus; the focus is looked at.
    Sweeps(unsigned sides, double counts_per_s, double frame_us, uint64_t seed) {
        std::array<LensWorld::Motors, 2> motors;
        for (LensWorld::Motors &side : motors) {
            for (LensMotorSettings &motor : side) {
                motor.counts_per_s = counts_per_s;
            }
        }
        LensWorld world(motors, {{{320, 320, 850}, {320, 320, 850}}}, seed);
        LensRig lenses(world);
        REQUIRE(lenses.open() == ERROR_OK);
        for (uint64_t i = 0; i < draws(40); i++) {
            sweep(world, lenses, sides, i % 2 == 0 ? 840 : 320, frame_us,
                  motors[0][0].backlash_counts / 2);
        }
    }

  private:
    void sweep(LensWorld &world, LensRig &lenses, unsigned sides, int32_t target, double frame_us,
               double play) {
        rig *rig = &lenses.rig;
        rig->profile.lens.axis[LENS_FOCUS].approach =
            target > 500 ? LENS_FROM_BELOW : LENS_FROM_ABOVE;
        rig_lens_move moves[2]{};
        for (unsigned side = 0; side < 2; side++) {
            REQUIRE(((sides >> side & 1) == 0 ||
                     rig_lens_move_begin(rig, &moves[side], 1u << side, LENS_FOCUS, target,
                                         LENS_MOVE_ALWAYS) == ERROR_OK));
        }
        std::vector<Truth> truths;
        const double begin_us = world.now_us(), end_us = begin_us + 7e6;
        for (double time_us = begin_us; time_us < end_us; time_us += frame_us) {
            world.at(time_us, [&](double now_us) {
                truths.push_back(
                    {now_us, world.controller.motor(0, LensAxis::kFocus).ring(now_us)});
            });
        }
        const uint32_t before = rig->camera[0].lens.tracked;
        size_t next = 0;
        double moved_us = 0;
        while (world.now_us() < end_us) {
            for (unsigned side = 0; side < 2; side++) {
                REQUIRE(rig_lens_move_step(rig, &moves[side], 0) == ERROR_OK);
            }
            world.advance(world.now_us() + 5e3);
            if (!rig_lens_move_done(&moves[0])) {
                moved_us = world.now_us() - begin_us;
                readings_per_s = double(rig->camera[0].lens.tracked - before) / (moved_us * 1e-6);
            }
            const double late_us = rig_lens_move_done(&moves[0]) ? 0 : 0.6e6;
            while (next < truths.size() && truths[next].time_us + late_us < world.now_us()) {
                judge(rig, truths, next++, target > 500 ? play : -play);
            }
        }
    }
    void judge(const rig *rig, const std::vector<Truth> &truths, size_t at, double play) {
        int32_t position_q4 = 0;
        uint16_t sigma_q4 = 0;
        const int error = rig_lens_position_at(rig, 0, LENS_FOCUS, uint64_t(truths[at].time_us),
                                               &position_q4, &sigma_q4);
        if (error == ERROR_MISSING) {
            missing++;
            return;
        }
        REQUIRE(error == ERROR_OK);
        const auto ring_at = [&](size_t index) {
            return truths[std::min(index, truths.size() - 1)].ring;
        };
        const double ring = truths[at].ring;
        const double back = ring_at(at < kAround ? 0 : at - kAround) - ring;
        const double on = ring_at(at + kAround) - ring;
        const double deviation = position_q4 / 16.0 - play - ring;
        if (std::abs(ring - truths[0].ring) < 0.1) {
            return;  // the play may be on the other side
        }
        const bool still = std::abs(back) < 0.1 && std::abs(on) < 0.1;
        const bool moving = std::abs(back + on) < 0.1;
        (still ? rest : moving ? steady : turning).add(deviation, sigma_q4 / 16.0);
    }

  public:
    unsigned missing = 0;
};

void print(const char *what, const Sweeps &sweeps) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "%-34s %4.1f   %4.2f %4.2f   %4.2f %4.2f   %4.2f %4.2f   %4.2f %4.2f %4.2f", what,
                  sweeps.readings_per_s, sweeps.steady.rms(), sweeps.steady.worst,
                  sweeps.turning.rms(), sweeps.turning.worst, sweeps.rest.rms(), sweeps.rest.worst,
                  sweeps.steady.over_sigma(), sweeps.turning.over_sigma(),
                  sweeps.rest.over_sigma());
    MESSAGE(text << " missing " << sweeps.missing);
}

}  // namespace

TEST_CASE("the ring's position at the time of a frame") {
    const uint64_t seed = synthetic::test_seed();
    MESSAGE("seed " << seed << ", sweeps a row " << draws(40));
    MESSAGE(
        "readings/s; rms and max: moving; within 0.3 s of start and stop; at rest; error/sigma");
    for (const unsigned sides : {kLeft, kBoth}) {
        for (const double counts_per_s : {150.0, 200.0}) {
            const Sweeps sweeps(sides, counts_per_s, 9700, seed + unsigned(counts_per_s) + sides);
            const std::string what = (sides == kBoth ? "both lenses, " : "one lens, ") +
                                     std::to_string(int(counts_per_s)) + " counts/s";
            print(what.c_str(), sweeps);
            CHECK(sweeps.steady.count > 100 * draws(40));
            CHECK(sweeps.steady.rms() < 0.6);
            CHECK(sweeps.steady.worst < 5);
            CHECK(sweeps.steady.over_sigma() < 1.5);
            CHECK(sweeps.turning.rms() < 2);
            CHECK(sweeps.rest.rms() < 0.9);
            CHECK(sweeps.missing <= 3 * draws(40));  // positions asked for before the first reading
        }
    }
}

TEST_CASE("a lens at its target moves there again only if it must") {
    LensWorld world({}, {{{320, 500, 850}, {320, 500, 850}}}, 1);
    LensRig lenses(world);
    REQUIRE(lenses.open() == ERROR_OK);
    int32_t q4 = 0;
    uint16_t sigma_q4 = 0;
    const auto at = [&](unsigned side, lens_axis axis) {
        return rig_lens_position_at(&lenses.rig, side, axis, uint64_t(world.now_us()), &q4,
                                    &sigma_q4);
    };
    CHECK(at(0, LENS_FOCUS) == ERROR_NOT_READY);
    REQUIRE(lenses.go(kLeft, LENS_FOCUS, 600) == ERROR_OK);
    for (const rig_lens_move_when when : {LENS_MOVE_IF_NEEDED, LENS_MOVE_ALWAYS}) {
        rig_lens_move move{};
        double highest = 600;
        REQUIRE(rig_lens_move_begin(&lenses.rig, &move, kLeft, LENS_FOCUS, 600, when) == ERROR_OK);
        while (!rig_lens_move_done(&move)) {
            REQUIRE(rig_lens_move_step(&lenses.rig, &move, uint64_t(world.now_us()) + 10000) ==
                    ERROR_OK);
            highest = std::max(highest, ring(world, 0, LENS_FOCUS));
        }
        CHECK((highest > 600 + kBacklash / 2) == (when == LENS_MOVE_ALWAYS));
        CHECK(at(0, LENS_FOCUS) == ERROR_OK);
        CHECK(std::abs(q4 / 16.0 + 2 - ring(world, 0, LENS_FOCUS)) < 2);
    }
    lens_mean means[LENS_AXES];
    REQUIRE(rig_lens_read_mean(&lenses.rig, 0, 16, means) == ERROR_OK);
    CHECK(std::abs(means[LENS_FOCUS].position_q4 / 16.0 + 2 - ring(world, 0, LENS_FOCUS)) < 1);
    CHECK(means[LENS_FOCUS].sigma_q4 < 8);
    CHECK(at(1, LENS_FOCUS) == ERROR_NOT_READY);
    lens_mean single[LENS_AXES];
    LensRig left_only(world, true);
    CHECK(rig_lens_position_at(&left_only.rig, 1, LENS_FOCUS, 0, &q4, &sigma_q4) ==
          ERROR_NOT_CONNECTED);
    CHECK(rig_lens_read_mean(&left_only.rig, 1, 4, single) == ERROR_NOT_CONNECTED);
}
