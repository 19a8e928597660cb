// SPDX-License-Identifier: Apache-2.0
// From power-up to an instrument whose parts are all known, or reported.
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "bench/rig_bench.hpp"

using rig_bench::RigBench;

namespace {

constexpr rig_part kParts[] = {RIG_PART_BRIDGE,      RIG_PART_LEFT_SENSOR,  RIG_PART_RIGHT_SENSOR,
                               RIG_PART_LEFT_CAMERA, RIG_PART_RIGHT_CAMERA, RIG_PART_LEFT_SERVO,
                               RIG_PART_RIGHT_SERVO, RIG_PART_LEFT_LENS,    RIG_PART_RIGHT_LENS,
                               RIG_PART_RESET_LINE,  RIG_PART_IRQ_LINE};

// What a bring-up must report if something is broken.
struct Broken {
    const char *fault, *heal;
    rig_part part;
    const char *words;              // beginning of the error message
    std::vector<rig_part> missing;  // all others must be found
    size_t lines;                   // number of lines in the log
};

}  // namespace

TEST_CASE("all parts are found, and nothing moves") {
    RigBench bench;
    const std::string before = bench.control("status");
    INFO(bench.rig.last_error.text);
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    CHECK(bench.rig.state == RIG_READY);
    CHECK(bench.logged.empty());
    for (const rig_part part : kParts) {
        CAPTURE(std::string(rig_part_text(part)));
        CHECK(bench.rig.health[part].present);
        CHECK(bench.rig.health[part].error == ERROR_OK);
        CHECK(bench.rig.health[part].failures == 0);
    }
    CHECK(bench.rig.format.width_px == 128);
    CHECK(bench.rig.format.height_px == 96);
    CHECK(rig_check(&bench.rig) == ERROR_OK);
    const std::string after = bench.control("status");
    CHECK(before.substr(before.find('\n')) == after.substr(after.find('\n')));
    // Again, starting from the state of the first.
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
}

TEST_CASE("a part that fails is named in one line, and the rest is still looked at") {
    const Broken all[] = {
        {"fault camera left unplug",
         "fault camera left ok",
         RIG_PART_LEFT_SENSOR,
         "left sensor: no answer on I2C",
         {RIG_PART_LEFT_SENSOR, RIG_PART_LEFT_CAMERA},
         1},
        {"fault camera right stuck",
         "fault camera right ok",
         RIG_PART_RIGHT_SENSOR,
         "right sensor: its I2C lines are stuck low",
         {RIG_PART_RIGHT_SENSOR, RIG_PART_RIGHT_CAMERA},
         1},
        {"fault camera right silent",
         "fault camera right ok",
         RIG_PART_RIGHT_CAMERA,
         "right camera: no pixel clock",
         {RIG_PART_RIGHT_CAMERA},
         1},
        {"fault camera left torn 4",
         "fault camera left ok",
         RIG_PART_LEFT_CAMERA,
         "left camera: data line 4 always reads 0",
         {},
         1},
        {"fault serial silent",
         "fault serial ok",
         RIG_PART_LEFT_LENS,
         "left lens: its controller does not answer",
         {RIG_PART_LEFT_LENS, RIG_PART_RIGHT_LENS},
         2},
        {"fault bus sda",
         "fault bus ok",
         RIG_PART_BRIDGE,
         "FPGA bridge: I2C bus stuck low",
         {RIG_PART_BRIDGE, RIG_PART_LEFT_SENSOR, RIG_PART_RIGHT_SENSOR, RIG_PART_LEFT_CAMERA,
          RIG_PART_RIGHT_CAMERA, RIG_PART_LEFT_SERVO, RIG_PART_RIGHT_SERVO, RIG_PART_IRQ_LINE},
         1},
        {"fault bus scl",
         "fault bus ok",
         RIG_PART_BRIDGE,
         "FPGA bridge: I2C bus stuck low",
         {RIG_PART_BRIDGE, RIG_PART_LEFT_SENSOR, RIG_PART_RIGHT_SENSOR, RIG_PART_LEFT_CAMERA,
          RIG_PART_RIGHT_CAMERA, RIG_PART_LEFT_SERVO, RIG_PART_RIGHT_SERVO, RIG_PART_IRQ_LINE},
         1},
    };
    RigBench bench;
    for (const Broken &broken : all) {
        CAPTURE(std::string(broken.fault));
        bench.logged.clear();
        bench.control(broken.fault);
        CHECK(rig_bringup(&bench.rig) != ERROR_OK);
        const std::string text = bench.rig.last_error.text;
        CHECK(bench.rig.state == RIG_SAFE);
        CHECK(bench.rig.last_error.part == broken.part);
        CHECK_MESSAGE(text.rfind(broken.words, 0) == 0, text);
        CHECK(text.find('\n') == std::string::npos);
        CHECK(bench.logged.size() == broken.lines);
        for (const rig_part part : kParts) {
            CAPTURE(std::string(rig_part_text(part)));
            bool missing = false;
            for (const rig_part other : broken.missing) {
                missing = missing || other == part;
            }
            CHECK(bench.rig.health[part].present == !missing);
        }
        bench.control(broken.heal);
    }
    INFO(bench.rig.last_error.text);
    CHECK(rig_bringup(&bench.rig) == ERROR_OK);
}

TEST_CASE("a lens controller that answers late is found, since it is heard") {
    RigBench bench;
    for (const char *late_ms : {"200", "500", "800", "1100", "1400"}) {
        CAPTURE(std::string(late_ms));
        bench.control(std::string("fault serial late ") + late_ms);
        const int error = rig_bringup(&bench.rig);
        CHECK_MESSAGE(error == ERROR_OK, bench.rig.last_error.text);
    }
}

TEST_CASE("a bring-up can be cancelled at any time, and the next one works") {
    RigBench bench;
    for (int last : {0, 1, 2, 5, 8, 9, 10, 11}) {
        int asked = 0;
        bench.keep_going = [&asked, last] { return asked++ < last; };
        const int error = rig_bringup(&bench.rig);
        CAPTURE(last);
        CHECK(error == ERROR_CANCELLED);
        CHECK(bench.rig.state != RIG_READY);
        CHECK(bench.logged.empty());
        CHECK(asked == last + 1);
    }
    bench.keep_going = [] { return true; };
    CHECK(rig_bringup(&bench.rig) == ERROR_OK);
}

TEST_CASE("a bridge that was reset behind our back is noticed while nothing else runs") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    CHECK(bench.idle_ms(1000) == ERROR_OK);
    const hal_gpio &gpio = bench.backend.gpio;
    REQUIRE(gpio.operations->set(gpio.self, HAL_GPIO_BRIDGE_RESET, true) == ERROR_OK);
    bench.advance_ms(1);
    REQUIRE(gpio.operations->set(gpio.self, HAL_GPIO_BRIDGE_RESET, false) == ERROR_OK);
    CHECK(bench.idle_ms(1000) == ERROR_RESTARTED);
    CHECK(bench.rig.state == RIG_SAFE);
    CHECK(bench.rig.last_error.part == RIG_PART_BRIDGE);
    CHECK(rig_idle(&bench.rig) == ERROR_OK);
    CHECK(rig_bringup(&bench.rig) == ERROR_OK);
}

TEST_CASE("a check finds what has failed since, and moves nothing") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    bench.control("fault camera left unplug");
    bench.advance_ms(5);
    CHECK(rig_check(&bench.rig) == ERROR_I2C_NACK);
    CHECK(bench.rig.last_error.part == RIG_PART_LEFT_SENSOR);
    CHECK(bench.rig.state == RIG_READY);
    bench.control("fault camera left ok");
    bench.control("fault camera right silent");
    bench.advance_ms(5);
    CHECK(rig_check(&bench.rig) == ERROR_TIMEOUT);
    CHECK(bench.rig.last_error.part == RIG_PART_RIGHT_CAMERA);
    bench.control("fault camera right ok");
    bench.advance_ms(5);
    CHECK(rig_check(&bench.rig) == ERROR_OK);
}

TEST_CASE("a rig that vanishes is reported at once, by every call") {
    RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    bench.process.kill();
    CHECK(bench.idle_ms(1000) == ERROR_DEVICE);
    CHECK(bench.rig.state == RIG_SAFE);
    CHECK(rig_bringup(&bench.rig) == ERROR_DEVICE);
    ::pair pair{};
    CHECK(bench.capture(pair) == ERROR_NOT_READY);
    CHECK(rig_safe(&bench.rig) == ERROR_DEVICE);
}
