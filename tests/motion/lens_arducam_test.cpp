// SPDX-License-Identifier: Apache-2.0
// A lens controller without position sensors on an I2C bus that loses transfers: its driver and the
// moves, with the simulated controller. Random; replay a failure with VERGENCE_SEED.
#include <doctest/doctest.h>

#include "lens_draw.hpp"

using namespace motion;

namespace {

constexpr double kTransferUs = 300;

// Time, and the controller on the bus.
struct Bus {
    explicit Bus(uint64_t seed)
        : noise(seed), motors{motors_of({seed, seed + 1, seed + 2}), motors_of({3, 4, 5})} {
        simrig::LensControllerSettings settings;
        settings.model = "arducam";
        controller = simrig::make_lens_controller(settings, motors, seed);
    }
    static simrig::LensMotors::value_type motors_of(const std::array<uint64_t, 3> &seeds) {
        LensMotorSettings settings;
        settings.settle_error_counts = 0;
        return {simrig::LensMotor(settings, 400, seeds[0]),
                simrig::LensMotor(settings, 500, seeds[1]),
                simrig::LensMotor(settings, 600, seeds[2])};
    }
    static Bus &of(void *self) { return *static_cast<Bus *>(self); }
    static int transfer(void *self, const hal_i2c_message *messages, size_t count, uint64_t,
                        size_t *begun) {
        Bus &bus = of(self);
        bus.time_us += kTransferUs;
        *begun = 1;
        if (bus.dead || messages[0].address != bus.controller->address()) {
            return ERROR_I2C_NACK;
        }
        if (bus.noise.chance(bus.lost)) {
            return ERROR_I2C_ARBITRATION;
        }
        const uint8_t index = messages[0].data[0];
        if (count == 2) {
            const uint16_t word = bus.controller->read(bus.time_us, index);
            messages[1].data[0] = uint8_t(word >> 8);
            messages[1].data[1] = uint8_t(word);
        } else {
            bus.controller->write(bus.time_us, index,
                                  uint16_t(messages[0].data[1] << 8 | messages[0].data[2]));
        }
        return ERROR_OK;
    }
    static uint64_t now_us(void *self) { return uint64_t(of(self).time_us); }
    static void wait_until_us(void *self, uint64_t until_us) {
        of(self).time_us = std::max(of(self).time_us, double(until_us));
    }
    double ring(LensAxis axis) { return controller->motor(0, axis).ring(time_us); }
    bool moving() {
        return controller->motor(0, simrig::kZoom).moving(time_us) ||
               controller->motor(0, simrig::kFocus).moving(time_us);
    }

    simrig::Noise noise;
    simrig::LensMotors motors;
    std::unique_ptr<simrig::LensController> controller;
    double time_us = 0, lost = 0;
    bool dead = false;
    hal_i2c_operations i2c_operations{transfer, nullptr};
    hal_clock_operations clock_operations{now_us, wait_until_us, nullptr};
    hal_i2c i2c{&i2c_operations, this};
    hal_clock clock{&clock_operations, this};
};

struct Instrument {
    explicit Instrument(Bus &bus) {
        std::memset(&rig, 0, sizeof rig);
        REQUIRE(rig_profile_set_lenses(&rig.profile, "arducam") == ERROR_OK);
        rig.ports.clock = &bus.clock;
        rig.ports.i2c = &bus.i2c;
        const lens_ports ports = {&bus.clock, nullptr, &bus.i2c};
        lens_controller_init(&rig.lens_controller, rig.profile.lens_driver, &rig.profile.lens,
                             &ports);
        rig.camera[RIG_LEFT].lens.drive = {&rig.lens_controller, 0};
        std::fill_n(rig.camera[RIG_LEFT].lens.commanded, 3, INT32_MIN);
        rig.state = RIG_READY;
    }
    struct rig rig;
};

double ring_of(const lens_axis_settings &axis, int32_t position) {
    return 300 + 550.0 * (position - axis.min) / (axis.max - axis.min);
}

}  // namespace

TEST_CASE("zoom and focus of one lens move at once, on a bus that loses transfers") {
    const uint64_t seed = synthetic::test_seed();
    for (uint64_t i = 0; i < draws(200); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::Noise noise(seed + i);
        Bus bus(noise.next());
        Instrument instrument(bus);
        rig *rig = &instrument.rig;
        REQUIRE(lens_open(&rig->camera[RIG_LEFT].lens.drive, 1000000) == ERROR_OK);
        bus.lost = noise.chance(0.5) ? between(noise, 0, 0.02) : 0;
        const auto &axes = rig->profile.lens.axis;
        rig_lens_move moves[2];
        int32_t targets[2];
        for (const lens_axis axis : {LENS_ZOOM, LENS_FOCUS}) {
            targets[axis] = axes[axis].min +
                            int32_t(noise.next() % uint64_t(axes[axis].max - axes[axis].min + 1));
            REQUIRE(rig_lens_move_begin(rig, &moves[axis], 1, axis, targets[axis],
                                        LENS_MOVE_IF_NEEDED) == ERROR_OK);
        }
        while (!rig_lens_move_done(&moves[0]) || !rig_lens_move_done(&moves[1])) {
            for (rig_lens_move &move : moves) {
                REQUIRE_MESSAGE(rig_lens_move_step(rig, &move, 0) == ERROR_OK,
                                rig->last_error.text);
            }
            bus.time_us += between(noise, 1e3, 3e4);
            REQUIRE(bus.time_us < 60e6);
        }
        CHECK(!bus.moving());
        for (const LensAxis axis : {simrig::kZoom, simrig::kFocus}) {
            // From below, but for targets without room there; a motor ignores less than 2 counts.
            const double error = bus.ring(axis) - ring_of(axes[axis], targets[axis]);
            const bool room = lens_move_has_room(&axes[axis], targets[axis]);
            CHECK(error <= (room ? 0 : 2) + 0.1);
            CHECK(error >= -2 - 2.1);
        }
        int32_t positions[LENS_AXES];
        REQUIRE(rig_lens_read(rig, RIG_LEFT, positions) == ERROR_OK);
        CHECK(positions[LENS_ZOOM] == targets[0]);
        CHECK(positions[LENS_FOCUS] == targets[1]);
        CHECK(positions[LENS_IRIS] == INT32_MIN);
    }
}

TEST_CASE("a cancelled move rests when the motor has ended its leg") {
    Bus bus(1);
    Instrument instrument(bus);
    rig *rig = &instrument.rig;
    rig_lens_move move;
    REQUIRE(rig_lens_move_begin(rig, &move, 1, LENS_ZOOM, 19000, LENS_MOVE_IF_NEEDED) == ERROR_OK);
    int error = ERROR_OK;
    while (!rig_lens_move_done(&move)) {
        error = rig_lens_move_step(rig, &move, uint64_t(bus.time_us) + 20000);
        if (bus.time_us > 5e5) {
            rig_lens_move_cancel(rig, &move);
        }
    }
    CHECK(error == ERROR_CANCELLED);
    CHECK(!bus.moving());
    CHECK(rig_lens_move_to(rig, 1, LENS_ZOOM, 5000) == ERROR_OK);
    CHECK(std::abs(bus.ring(simrig::kZoom) - ring_of(rig->profile.lens.axis[0], 5000)) <= 4.1);
}

TEST_CASE("a controller that disappears is reported within two seconds") {
    Bus bus(2);
    Instrument instrument(bus);
    rig *rig = &instrument.rig;
    rig_lens_move move;
    REQUIRE(rig_lens_move_begin(rig, &move, 1, LENS_FOCUS, 19000, LENS_MOVE_IF_NEEDED) == ERROR_OK);
    int error = ERROR_OK;
    while (!rig_lens_move_done(&move)) {
        error = rig_lens_move_step(rig, &move, uint64_t(bus.time_us) + 20000);
        bus.dead = bus.time_us > 5e5;
    }
    CHECK(error == ERROR_TIMEOUT);
    CHECK(rig->last_error.part == RIG_PART_LEFT_LENS);
    CHECK(bus.time_us < 5e5 + 1.7e6 + 12e6);
    CHECK(lens_open(&rig->camera[RIG_LEFT].lens.drive, UINT64_MAX) == ERROR_I2C_NACK);
    bus.dead = false;
    instrument.rig.profile.lens.address = 0x0D;
    CHECK(lens_open(&rig->camera[RIG_LEFT].lens.drive, UINT64_MAX) == ERROR_I2C_NACK);
}
