// SPDX-License-Identifier: Apache-2.0
// Devices that are missing, disappear, and reappear under the same name.
#include "camera_harness.hpp"
#include "daemon/backends/linux/i2c_dev.h"
#include "daemon/backends/linux/termios_uart.h"
#include "fake_i2c.h"

namespace {

using namespace linux_harness;

const char *const kBus = "/dev/i2c-1";
constexpr uint8_t kBridge = 0x2C;

int write_byte(i2c_dev &bus) {
    uint8_t byte = 0;
    const hal_i2c_message message = {&byte, 1, kBridge, false};
    size_t begun = 7;
    const uint64_t deadline_us = fake_kernel_now_us() + 50000;
    const int error = bus.hal.operations->transfer(bus.hal.self, &message, 1, deadline_us, &begun);
    CHECK((error == ERROR_OK || begun == 0 || bus.fd >= 0));
    return error;
}

}  // namespace

TEST_CASE("every call of a closed device returns an error") {
    const Kernel kernel;
    i2c_dev bus;
    i2c_dev_init(&bus);
    CHECK(!i2c_dev_is_current(&bus, kBus));
    CHECK(write_byte(bus) == ERROR_DEVICE);
    i2c_dev_close(&bus);
    termios_uart uart;
    termios_uart_init(&uart);
    CHECK(!termios_uart_is_current(&uart, "/dev/ttyS1"));
    char byte = 'x';
    size_t bytes = 0;
    const hal_uart_operations &line = *uart.hal.operations;
    CHECK(line.write(uart.hal.self, &byte, 1, kStart_us) == ERROR_DEVICE);
    CHECK(line.read(uart.hal.self, &byte, 1, kStart_us, &bytes) == ERROR_DEVICE);
    CHECK(line.discard(uart.hal.self) == ERROR_DEVICE);
    termios_uart_close(&uart);
    v4l2_camera camera;
    v4l2_camera_init(&camera, kVideo, 33333, nullptr);
    message text;
    CHECK(v4l2_camera_renew(&camera, &text) == ERROR_DEVICE);
    CHECK(std::string(text.text).find("/dev/video0: No such file") != std::string::npos);
    const hal_camera_format format = {64, 48};
    CHECK(camera.hal.operations->start(camera.hal.self, &format) == ERROR_DEVICE);
    int32_t applied = 0;
    CHECK(camera.hal.operations->control(camera.hal.self, HAL_CAMERA_GAIN_PART, 1, &applied) ==
          ERROR_DEVICE);
    v4l2_camera_close(&camera);
    CHECK(record() == "");
}

TEST_CASE("a reconnected bus is another one") {
    const Plug plug;
    const Kernel kernel;
    fake_i2c_add(kBus, kBridge);
    REQUIRE(fake_kernel_plug(kBus, plug.file.c_str()));
    plug.in();
    i2c_dev bus;
    message text;
    REQUIRE(i2c_dev_open(&bus, kBus, &text) == ERROR_OK);
    CHECK(write_byte(bus) == ERROR_OK);
    CHECK(i2c_dev_is_current(&bus, kBus));
    plug.out();
    CHECK(write_byte(bus) == ERROR_DEVICE);
    CHECK(!i2c_dev_is_current(&bus, kBus));
    plug.in();
    CHECK(write_byte(bus) == ERROR_DEVICE);
    CHECK(!i2c_dev_is_current(&bus, kBus));
    i2c_dev_close(&bus);
    REQUIRE(i2c_dev_open(&bus, kBus, &text) == ERROR_OK);
    CHECK(write_byte(bus) == ERROR_OK);
    i2c_dev_close(&bus);
}

TEST_CASE("a camera is reopened only if it is another one") {
    const Plug plug;
    const Kernel kernel;
    fake_video_add(kVideo, V4L2_PIX_FMT_GREY, 64, 48);
    REQUIRE(fake_kernel_plug(kVideo, plug.file.c_str()));
    plug.in();
    v4l2_camera camera;
    message text;
    v4l2_camera_init(&camera, kVideo, 33333, nullptr);
    REQUIRE(v4l2_camera_renew(&camera, &text) == ERROR_OK);
    const hal_camera_format format = {64, 48};
    const hal_camera_operations &port = *camera.hal.operations;
    REQUIRE(port.start(camera.hal.self, &format) == ERROR_OK);
    record();
    CHECK(v4l2_camera_renew(&camera, &text) == ERROR_OK);
    CHECK(record() == "");
    plug.out();
    CHECK(v4l2_camera_renew(&camera, &text) == ERROR_DEVICE);
    plug.in();
    CHECK(v4l2_camera_renew(&camera, &text) == ERROR_OK);
    REQUIRE(port.start(camera.hal.self, &format) == ERROR_OK);
    hal_camera_frame frame;
    REQUIRE(port.take(camera.hal.self, 0, fake_kernel_now_us() + 1000000, &frame) == ERROR_OK);
    raw_image_release(&frame.image);
    v4l2_camera_close(&camera);
}
