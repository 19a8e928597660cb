// SPDX-License-Identifier: Apache-2.0
// Every backend rejects other kinds of files and devices without writing to them.
#include <sys/stat.h>

#include <functional>
#include <sstream>
#include <string>

#include "core/error.h"
#include "daemon/backends/linux/i2c_dev.h"
#include "daemon/backends/linux/termios_uart.h"
#include "daemon/backends/linux/v4l2_stream.h"
#include "daemon/backends/linux/watchdog_dev.h"
#include "daemon/base/serial_device.h"
#include "linux_harness.hpp"

namespace {

using linux_harness::Kernel;

const struct {
    const char *kind;
    std::function<int(const char *, message *)> open;
} kBackends[] = {
    {"I2C bus",
     [](const char *path, message *text) {
         i2c_dev bus;
         return i2c_dev_open(&bus, path, text);
     }},
    {"serial line",
     [](const char *path, message *text) {
         termios_uart line;
         return termios_uart_open(&line, path, 9600, text);
     }},
    {"camera",
     [](const char *path, message *text) {
         v4l2_stream stream;
         return v4l2_stream_open(&stream, path, text);
     }},
    {"watchdog",
     [](const char *path, message *text) {
         watchdog_dev watchdog;
         return watchdog_dev_open(&watchdog, path, 15, text);
     }},
    {"serial line",  // used by the console and the client
     [](const char *path, message *text) { return serial_device_open(path, 9600, text); }},
};

}  // namespace

TEST_CASE("files, pipes and directories are rejected unchanged") {
    const scratch folder;
    const std::string file = folder.write("file", "abcdefgh\nline\n");
    REQUIRE(mkfifo((folder / "pipe").c_str(), 0600) == 0);
    for (const auto &backend : kBackends) {
        for (const std::string &path : {file, folder / "pipe", folder.path}) {
            const Kernel kernel;
            message text;
            INFO(std::string(backend.kind), " ", path);
            CHECK(backend.open(path.c_str(), &text) == ERROR_DEVICE);
            CHECK(std::string(text.text).find(backend.kind) != std::string::npos);
            CHECK(std::string(text.text).find(path) != std::string::npos);
        }
    }
    std::ostringstream now;
    now << std::ifstream(file).rdbuf();
    CHECK(now.str() == "abcdefgh\nline\n");
}

TEST_CASE("other kinds of devices are rejected") {
    for (const auto &backend : kBackends) {
        for (const char *path : {"/dev/null", "/dev/zero"}) {
            const Kernel kernel;
            message text;
            INFO(std::string(backend.kind), " ", path);
            CHECK(backend.open(path, &text) < 0);
            CHECK(std::string(text.text).find(path) != std::string::npos);
        }
    }
}
