// SPDX-License-Identifier: Apache-2.0
// hal_gpio on libgpiod 1.6 or 2, with identical behaviour. gpiod_v2_test.py builds this with the
// version that the system does not have.
#include "daemon/backends/linux/gpiod_lines.h"

#include <string>

#include "core/error.h"
#include "fake_gpio.h"
#include "linux_harness.hpp"

namespace {

using linux_harness::Kernel;
using linux_harness::record;

const char *const kChip = "/dev/gpiochip0";

struct Lines {
    gpiod_line_location places[HAL_GPIO_LINES]{};
    gpiod_lines lines{};
    message text{};
    int opened;

    explicit Lines(bool active_low = false, bool lens_power = true) {
        places[HAL_GPIO_BRIDGE_RESET] = {kChip, 3, active_low, false};
        places[HAL_GPIO_BRIDGE_IRQ] = {kChip, 5, active_low, false};
        places[HAL_GPIO_LENS_POWER] = {lens_power ? kChip : nullptr, 7, false, true};
        places[HAL_GPIO_TRIGGER] = {kChip, 6, !active_low, false};
        opened = gpiod_lines_open(&lines, places, &text);
    }
    Lines(const Lines &) = delete;
    Lines &operator=(const Lines &) = delete;
    ~Lines() { gpiod_lines_close(&lines); }

    int set(hal_gpio_line line, bool active) {
        return lines.hal.operations->set(lines.hal.self, line, active);
    }
    int get(hal_gpio_line line, bool *active) {
        return lines.hal.operations->get(lines.hal.self, line, active);
    }
};

}  // namespace

TEST_CASE("outputs: initial level, set, get, for both polarities") {
    MESSAGE("built with ", std::string(gpiod_shim_library()));
    for (const bool active_low : {false, true}) {
        const Kernel kernel;
        const fake_gpio *chip = fake_gpio_add(kChip);
        {
            Lines lines(active_low);
            INFO(std::string(lines.text.text));
            REQUIRE(lines.opened == ERROR_OK);
            CHECK(chip->is_output[3]);
            CHECK(chip->is_output[7]);
            CHECK_FALSE(chip->is_output[5]);
            CHECK(std::string(chip->consumer[3]) == "vergence");
            CHECK(chip->wire[3] == active_low);
            CHECK(chip->wire[7]);
            CHECK(chip->is_output[6]);
            CHECK(chip->wire[6] == !active_low);  // inactive until pulsed
            for (const bool active : {true, false}) {
                CHECK(lines.set(HAL_GPIO_TRIGGER, active) == ERROR_OK);
                CHECK(chip->wire[6] == (active == active_low));
            }
            record();
            for (const bool active : {true, false, true}) {
                bool read = !active;
                CHECK(lines.set(HAL_GPIO_BRIDGE_RESET, active) == ERROR_OK);
                CHECK(chip->wire[3] == (active != active_low));
                CHECK(lines.get(HAL_GPIO_BRIDGE_RESET, &read) == ERROR_OK);
                CHECK(read == active);
            }
            CHECK(fake_kernel_calls() == 6);  // one system call each
        }
        CHECK_FALSE(chip->requested[3]);
        CHECK_FALSE(chip->requested[5]);
        CHECK_FALSE(chip->requested[7]);
        CHECK_FALSE(chip->requested[6]);
    }
}

TEST_CASE("an input reads its level, for both polarities") {
    for (const bool active_low : {false, true}) {
        const Kernel kernel;
        fake_gpio *chip = fake_gpio_add(kChip);
        Lines lines(active_low);
        REQUIRE(lines.opened == ERROR_OK);
        for (const bool wire : {true, false}) {
            chip->wire[5] = wire;
            bool active = !wire;
            CHECK(lines.get(HAL_GPIO_BRIDGE_IRQ, &active) == ERROR_OK);
            CHECK(active == (wire != active_low));
        }
    }
}

TEST_CASE("missing lines, and wrong uses of lines") {
    const Kernel kernel;
    fake_gpio_add(kChip);
    Lines lines(false, false);
    REQUIRE(lines.opened == ERROR_OK);
    bool active = true;
    CHECK(lines.set(HAL_GPIO_LENS_POWER, true) == ERROR_UNSUPPORTED);
    CHECK(lines.get(HAL_GPIO_LENS_POWER, &active) == ERROR_UNSUPPORTED);
    CHECK(lines.set(HAL_GPIO_BRIDGE_IRQ, true) == ERROR_UNSUPPORTED);
    const struct gpiod_line_location none[HAL_GPIO_LINES] = {};
    gpiod_lines empty;
    CHECK(gpiod_lines_open(&empty, none, &lines.text) == ERROR_OK);
    gpiod_lines_close(&empty);
}

TEST_CASE("every errno maps to the interface's error") {
    const struct {
        int system, ours;
    } pairs[] = {
        {EIO, ERROR_IO}, {ENODEV, ERROR_DEVICE}, {ENXIO, ERROR_DEVICE}, {EINVAL, ERROR_IO}};
    for (const auto &pair : pairs) {
        const Kernel kernel;
        fake_gpio_add(kChip);
        Lines lines;
        REQUIRE(lines.opened == ERROR_OK);
        bool active = false;
        fake_kernel_fail("SET_VALUES", 1, pair.system, 1);
        CHECK(lines.set(HAL_GPIO_TRIGGER, true) == pair.ours);
        CHECK(lines.set(HAL_GPIO_TRIGGER, true) == ERROR_OK);
        fake_kernel_fail("SET_VALUES", 1, pair.system, 1);
        CHECK(lines.set(HAL_GPIO_BRIDGE_RESET, true) == pair.ours);
        CHECK(lines.set(HAL_GPIO_BRIDGE_RESET, true) == ERROR_OK);
        fake_kernel_fail("GET_VALUES", 1, pair.system, 1);
        CHECK(lines.get(HAL_GPIO_BRIDGE_RESET, &active) == pair.ours);
    }
}

TEST_CASE("each call of opening fails in turn: a message names the line, nothing stays open") {
    for (const int error : linux_harness::kErrors) {
        unsigned last = 0;
        message text;
        linux_harness::each_call_fails(
            error, 1,
            [&] {
                fake_gpio_add(kChip);
                const Lines lines;
                text = lines.text;
                return lines.opened;
            },
            [&](unsigned nth, int result) {
                last = nth;
                if (result != ERROR_OK) {
                    CHECK(std::string(text.text).find(kChip) != std::string::npos);
                }
            });
        CHECK(last >= 6);
    }
}

TEST_CASE("a line's error is reported in one line") {
    const Kernel kernel;
    fake_gpio *chip = fake_gpio_add(kChip);
    chip->requested[5] = true;
    {
        const Lines lines;
        CHECK(lines.opened == ERROR_REFUSED);
        const std::string text = lines.text.text;
        CHECK(text.find("line 5 of /dev/gpiochip0 for the bridge's interrupt: ") == 0);
        CHECK(text.find("another program") != std::string::npos);
        CHECK(text.find("gpioinfo") != std::string::npos);
        CHECK_FALSE(chip->requested[3]);  // lines already requested are released
    }
    chip->requested[5] = false;
    gpiod_lines lines;
    message text;
    gpiod_line_location places[HAL_GPIO_LINES] = {};
    places[HAL_GPIO_BRIDGE_RESET] = {kChip, 99, false, false};
    CHECK(gpiod_lines_open(&lines, places, &text) == ERROR_UNSUPPORTED);
    places[HAL_GPIO_BRIDGE_RESET] = {"/dev/gpiochip9", 1, false, false};
    CHECK(gpiod_lines_open(&lines, places, &text) == ERROR_DEVICE);
    places[HAL_GPIO_BRIDGE_RESET] = {"/dev/null", 1, false, false};
    CHECK(gpiod_lines_open(&lines, places, &text) == ERROR_DEVICE);
    CHECK(std::string(text.text).find("gpiodetect") != std::string::npos);
}

TEST_CASE("lines that are not requested return an error") {
    const Kernel kernel;
    gpiod_lines lines;
    gpiod_lines_init(&lines);
    const gpiod_line_location none[HAL_GPIO_LINES] = {};
    CHECK(!gpiod_lines_are_current(&lines, none));
    bool active = false;
    const hal_gpio_operations &port = *lines.hal.operations;
    CHECK(port.set(lines.hal.self, HAL_GPIO_BRIDGE_RESET, true) == ERROR_DEVICE);
    CHECK(port.get(lines.hal.self, HAL_GPIO_BRIDGE_IRQ, &active) == ERROR_DEVICE);
    gpiod_lines_close(&lines);
}

TEST_CASE("an unplugged chip counts as gone after the next use") {
    const Kernel kernel;
    fake_gpio_add(kChip);
    Lines open;
    REQUIRE(open.opened == ERROR_OK);
    CHECK(gpiod_lines_are_current(&open.lines, open.places));
    fake_kernel_fail("SET_VALUES", 1, ENODEV, 1);
    CHECK(open.set(HAL_GPIO_BRIDGE_RESET, true) == ERROR_DEVICE);
    CHECK(!gpiod_lines_are_current(&open.lines, open.places));
}

TEST_CASE("a chip that was reconnected between two uses is another one") {
    const linux_harness::Plug plug;
    const Kernel kernel;
    fake_gpio_add(kChip);
    REQUIRE(fake_kernel_plug(kChip, plug.file.c_str()));
    plug.in();
    Lines open;
    REQUIRE(open.opened == ERROR_OK);
    CHECK(gpiod_lines_are_current(&open.lines, open.places));
    plug.out();
    CHECK(!gpiod_lines_are_current(&open.lines, open.places));
    plug.in();
    CHECK(!gpiod_lines_are_current(&open.lines, open.places));
    CHECK(open.set(HAL_GPIO_BRIDGE_RESET, true) == ERROR_DEVICE);
    gpiod_lines_close(&open.lines);
    REQUIRE(gpiod_lines_open(&open.lines, open.places, &open.text) == ERROR_OK);
    CHECK(gpiod_lines_are_current(&open.lines, open.places));
    CHECK(open.set(HAL_GPIO_BRIDGE_RESET, true) == ERROR_OK);
}
