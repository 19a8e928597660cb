// SPDX-License-Identifier: Apache-2.0
// Pans the cameras through the bridge's Verilog and the simulated servos.
#include <cmath>
#include <string>

#include "pan_bench.hpp"
#include "synthetic/seed.hpp"
#include "tools/simrig/devices/noise.hpp"

using namespace motion;

namespace {

// Servos as in rigs/default.yaml, with this repeatability.
simrig::RigSettings servos(double repeatability_degrees) {
    simrig::RigSettings settings;
    settings.seed = synthetic::test_seed();
    settings.servo[0].offset_degrees = 0.4;
    settings.servo[1].offset_degrees = -0.7;
    for (simrig::ServoSettings &servo : settings.servo) {
        servo.repeatability_degrees = repeatability_degrees;
    }
    return settings;
}

int32_t any_angle(simrig::Noise &noise) {
    return int32_t((noise.uniform() - 0.5) * 2 * 500000);
}

// Small moves and large ones.
int32_t next_angle(simrig::Noise &noise, int32_t before) {
    const int32_t near = before + int32_t((noise.uniform() - 0.5) * 40000);
    return noise.chance(0.5) ? any_angle(noise) : std::clamp(near, -500000, 500000);
}

double rms_deg(PanBench &bench, const simrig::RigSettings &settings, int moves, double &worst) {
    simrig::Noise noise(synthetic::test_seed());
    double squares = 0;
    int32_t left = 0, right = 0;
    worst = 0;
    for (int i = 0; i < moves; i++) {
        INFO("seed " << synthetic::test_seed() << " move " << i);
        left = next_angle(noise, left);
        right = next_angle(noise, right);
        bench.begin();
        REQUIRE(rig_pan_both(&bench.rig, left, right) == ERROR_OK);
        for (unsigned side = 0; side < 2; side++) {
            CHECK(!bench.moving(side));
            const double beside =
                bench.beside_deg(side, side == 0 ? left : right, settings.servo[side]);
            squares += beside * beside;
            worst = std::max(worst, std::abs(beside));
        }
        CHECK(bench.longest_silence_us <= 100000);
    }
    return std::sqrt(squares / (2 * moves));
}

}  // namespace

TEST_CASE("horns rest where they should, whatever the dead band") {
    // Without repeatability error the dead band is left: 0.29 degrees without the approach.
    const simrig::RigSettings settings = servos(0);
    PanBench bench(settings);
    double worst = 0;
    const double rms = rms_deg(bench, settings, 15, worst);
    MESSAGE("with the approach: rms " << rms << ", worst " << worst << " degrees");
    CHECK(worst < 0.02);
    for (servo_model &model : bench.rig.profile.servo) {
        model.dead_band_q4 = 0;
    }
    const double direct = rms_deg(bench, settings, 15, worst);
    MESSAGE("without: rms " << direct << ", worst " << worst << " degrees");
    CHECK(worst > 0.1);
    CHECK(worst < 0.31);
}

TEST_CASE("with the repeatability of real ones") {
    const simrig::RigSettings settings = servos(0.3);
    PanBench bench(settings);
    double worst = 0;
    // The rms of 40 values is known to 11 %.
    const double rms = rms_deg(bench, settings, synthetic::rounds(20, 5), worst);
    MESSAGE("rms " << rms << ", worst " << worst << " degrees");
    CHECK(rms < 0.4);
    CHECK(rms > 0.15);
}

TEST_CASE("an angle is where the bridge has it, to half a sixteenth of a microsecond") {
    PanBench bench(servos(0));
    for (int32_t angle : {0, 69290, -69290, 400000, -523599, 523599}) {
        REQUIRE(rig_pan(&bench.rig, RIG_RIGHT, angle) == ERROR_OK);
        int32_t now = 0;
        REQUIRE(rig_pan_read(&bench.rig, RIG_RIGHT, &now) == ERROR_OK);
        CHECK(std::abs(now - angle) <= 53);
        // Again: nothing moves, and no time passes except for the queries.
        const double begin_us = bench.world.now_us();
        REQUIRE(rig_pan(&bench.rig, RIG_RIGHT, angle) == ERROR_OK);
        CHECK(bench.world.now_us() - begin_us < 2000);
    }
    CHECK(bench.world.servo(0).last_pulse_us() == 0);  // the other got none
}

TEST_CASE("a slow slew takes its time, and the watchdog does not bite") {
    PanBench bench(servos(0));
    bench.set_slew(RIG_LEFT, 16);
    const double begin_us = bench.world.now_us();
    bench.begin();
    REQUIRE(rig_pan(&bench.rig, RIG_LEFT, 400000) == ERROR_OK);
    CHECK(bench.world.now_us() - begin_us > 4e6);
    CHECK(bench.longest_silence_us <= 100000);
    CHECK(!bench.moving(0));
    uint16_t watchdog = BRIDGE_WDG_FIRED_MASK;
    REQUIRE(fpga_bridge_read(&bench.rig.bridge, BRIDGE_WDG, &watchdog) == ERROR_OK);
    CHECK((watchdog & BRIDGE_WDG_FIRED_MASK) == 0);
}

TEST_CASE("cancelled, the horns stay where they are") {
    simrig::Noise noise(synthetic::test_seed());
    PanBench bench(servos(0));
    REQUIRE(rig_pan_both(&bench.rig, -500000, -500000) == ERROR_OK);
    for (unsigned side = 0; side < 2; side++) {
        bench.set_slew(side, 48);
    }
    int32_t angle = -500000;
    int stopped = 0;
    for (int i = 0; i < 4; i++) {
        INFO("seed " << synthetic::test_seed() << " try " << i);
        angle = -angle;
        bench.cancel_us = bench.world.now_us() + 1.5e6 * noise.uniform();
        REQUIRE(rig_pan_both(&bench.rig, angle, -angle) == ERROR_CANCELLED);
        CHECK(bench.world.now_us() - bench.cancel_us < 100000);
        bench.world.advance(bench.world.now_us() + 150000, 0);
        const double left = bench.world.servo(0).angle_deg(bench.world.now_us());
        stopped += std::abs(left - 0.4) < 28 ? 1 : 0;
        REQUIRE(fpga_bridge_watchdog_feed(&bench.rig.bridge) == ERROR_OK);
        bench.world.advance(bench.world.now_us() + 500000, 0);
        // Steps of exactly a dead band may be followed late.
        CHECK(std::abs(bench.world.servo(0).angle_deg(bench.world.now_us()) - left) < 0.3);
        REQUIRE(fpga_bridge_watchdog_feed(&bench.rig.bridge) == ERROR_OK);
        bench.cancel_us = 1e18;
        bench.rig.fed_us = 0;
        REQUIRE(rig_pan_both(&bench.rig, angle, -angle) == ERROR_OK);
    }
    CHECK(stopped > 0);
}

TEST_CASE("what cannot be asked for is refused and moves nothing") {
    PanBench bench(servos(0));
    CHECK(rig_pan(&bench.rig, RIG_LEFT, 523600) == ERROR_RANGE);
    const std::string text = bench.rig.last_error.text;
    CHECK_MESSAGE(text.rfind("left servo: angle 523 mrad", 0) == 0, text);
    CHECK_MESSAGE(text.find("-523 to 523 mrad") != std::string::npos, text);
    CHECK(rig_pan_both(&bench.rig, 0, -600000) == ERROR_RANGE);
    CHECK(bench.rig.last_error.part == RIG_PART_RIGHT_SERVO);
    CHECK(rig_pan(&bench.rig, 2, 0) == ERROR_ARGUMENT);
    int32_t angle = 0;
    CHECK(rig_pan_read(&bench.rig, 2, &angle) == ERROR_ARGUMENT);
    bench.rig.state = RIG_SAFE;
    CHECK(rig_pan(&bench.rig, RIG_LEFT, 0) == ERROR_NOT_READY);
    bench.rig.profile.servos = false;
    CHECK(rig_pan(&bench.rig, RIG_LEFT, 0) == ERROR_NOT_CONNECTED);
    CHECK(rig_pan_read(&bench.rig, RIG_LEFT, &angle) == ERROR_NOT_CONNECTED);
    bench.world.advance(bench.world.now_us() + 100000, 0);
    CHECK(bench.world.servo(0).last_pulse_us() == 0);
}

TEST_CASE("a bus that fails on the way ends it, and the servos rest") {
    PanBench bench(servos(0));
    REQUIRE(rig_pan(&bench.rig, RIG_LEFT, -400000) == ERROR_OK);
    bench.set_slew(RIG_LEFT, 16);
    simrig::BusFaults faults;
    faults.sda_stuck = true;
    bench.world.host().set_faults(faults);
    const double begin_us = bench.world.now_us();
    CHECK(rig_pan(&bench.rig, RIG_LEFT, 400000) == ERROR_I2C_STUCK);
    CHECK(bench.world.now_us() - begin_us < 2e6);
    CHECK(bench.rig.state == RIG_SAFE);
    CHECK(bench.rig.last_error.part == RIG_PART_LEFT_SERVO);
    bench.world.advance(bench.world.now_us() + 1.2e6, 0);
    CHECK(!bench.moving(0));  // the bridge's watchdog
    const double rests = bench.world.servo(0).angle_deg(bench.world.now_us());
    bench.world.advance(bench.world.now_us() + 1e6, 0);
    CHECK(bench.world.servo(0).angle_deg(bench.world.now_us()) == doctest::Approx(rests));
}

TEST_CASE("a watchdog that has fired, and narrowed limits, are reported") {
    PanBench bench(servos(0));
    REQUIRE(rig_pan(&bench.rig, RIG_LEFT, 100000) == ERROR_OK);
    REQUIRE(fpga_bridge_servo_limits(&bench.rig.bridge, 0, 23000, 25000) == ERROR_OK);
    CHECK(rig_pan(&bench.rig, RIG_LEFT, 300000) == ERROR_TIMEOUT);
    CHECK(std::string(bench.rig.last_error.text).rfind("left servo: the bridge sends 1562 us", 0) ==
          0);
    bench.world.advance(bench.world.now_us() + 1.5e6, 0);
    CHECK(rig_pan(&bench.rig, RIG_LEFT, 0) == ERROR_TIMEOUT);
    CHECK(bench.rig.last_error.part == RIG_PART_BRIDGE);
    CHECK(bench.rig.state == RIG_SAFE);
}

TEST_CASE("a jammed servo cannot be seen") {
    PanBench bench(servos(0));
    REQUIRE(rig_pan(&bench.rig, RIG_LEFT, 100000) == ERROR_OK);
    bench.world.servo(0).jam(bench.world.now_us(), true);
    CHECK(rig_pan(&bench.rig, RIG_LEFT, 300000) == ERROR_OK);
}
