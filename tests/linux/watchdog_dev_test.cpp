// SPDX-License-Identifier: Apache-2.0
// hal_watchdog on /dev/watchdog: armed, fed, and disarmed only at an orderly end.
#include "daemon/backends/linux/watchdog_dev.h"

#include <string>

#include "core/error.h"
#include "fake_watchdog.h"
#include "linux_harness.hpp"

namespace {

using linux_harness::Kernel;
using linux_harness::record;

const char *const kPath = "/dev/watchdog";

int feed(watchdog_dev &watchdog) {
    return watchdog.hal.operations->feed(watchdog.hal.self);
}

uint64_t period_us(watchdog_dev &watchdog) {
    return watchdog.hal.operations->period_us(watchdog.hal.self);
}

}  // namespace

TEST_CASE("the calls of opening, feeding and an orderly end") {
    const Kernel kernel;
    const fake_watchdog *device = fake_watchdog_add(kPath);
    watchdog_dev watchdog;
    message text;
    REQUIRE(watchdog_dev_open(&watchdog, kPath, 15, &text) == ERROR_OK);
    CHECK(record() ==
          "watchdog open wronly noctty cloexec\n"
          "watchdog ioctl GETSUPPORT\n"
          "watchdog ioctl SETTIMEOUT 15\n");
    CHECK(device->armed);
    CHECK(period_us(watchdog) == 15000000);
    CHECK(feed(watchdog) == ERROR_OK);
    CHECK(record() == "watchdog ioctl KEEPALIVE\n");
    CHECK(device->feeds == 1);
    CHECK(watchdog_dev_close(&watchdog, true));
    CHECK(record() == "watchdog write 1\nwatchdog close\n");
    CHECK_FALSE(device->armed);
    CHECK_FALSE(watchdog_dev_close(&watchdog, true));
}

TEST_CASE("the period is the one that the driver sets") {
    const struct {
        bool sets, reports;
        unsigned wanted_s;
        uint64_t period_us;
    } cases[] = {{true, true, 1, 2000000},
                 {true, true, 3600, 120000000},
                 {false, true, 15, 60000000},
                 {false, false, 15, 0}};
    for (const auto &one : cases) {
        const Kernel kernel;
        fake_watchdog *device = fake_watchdog_add(kPath);
        device->sets_period = one.sets;
        device->reports_period = one.reports;
        watchdog_dev watchdog;
        message text;
        REQUIRE(watchdog_dev_open(&watchdog, kPath, one.wanted_s, &text) == ERROR_OK);
        CHECK(period_us(watchdog) == one.period_us);
        watchdog_dev_close(&watchdog, true);
    }
}

TEST_CASE("a driver without KEEPALIVE is fed by writing, and never with the magic byte") {
    const Kernel kernel;
    fake_watchdog *device = fake_watchdog_add(kPath);
    device->has_keepalive = false;
    watchdog_dev watchdog;
    message text;
    REQUIRE(watchdog_dev_open(&watchdog, kPath, 15, &text) == ERROR_OK);
    CHECK(feed(watchdog) == ERROR_OK);
    CHECK(device->feeds == 1);
    watchdog_dev_close(&watchdog, false);
    CHECK(device->armed);
}

TEST_CASE("each call fails in turn, and signals are not failures") {
    for (const int error : linux_harness::kErrors) {
        linux_harness::each_call_fails(
            error, 1,
            [&] {
                const fake_watchdog *device = fake_watchdog_add(kPath);
                watchdog_dev watchdog;
                message text;
                int result = watchdog_dev_open(&watchdog, kPath, 15, &text);
                if (result != ERROR_OK) {
                    CHECK(watchdog.fd == -1);
                    CHECK(std::string(text.text).find(kPath) != std::string::npos);
                    // Nothing is written, not even to disarm it, to what may not be a watchdog.
                    CHECK(device->armed ==
                          (std::string(text.text).find("not a watchdog") != std::string::npos));
                    return result;
                }
                result = feed(watchdog);
                watchdog_dev_close(&watchdog, true);
                return result;
            },
            [&](unsigned nth, int result) {
                const bool other_way = error == ENOTTY || (error == EINVAL && nth == 3);
                CHECK((result != ERROR_OK) == (nth <= 2 || (nth <= 4 && !other_way)));
            });
    }
    const Kernel kernel;
    const fake_watchdog *device = fake_watchdog_add(kPath);
    for (const char *call : {"open", "GETSUPPORT", "SETTIMEOUT", "KEEPALIVE", "write"}) {
        watchdog_dev watchdog;
        message text;
        fake_kernel_fail(call, 1, EINTR, 2);
        REQUIRE(watchdog_dev_open(&watchdog, kPath, 15, &text) == ERROR_OK);
        CHECK(feed(watchdog) == ERROR_OK);
        CHECK(watchdog_dev_close(&watchdog, true));
        CHECK_FALSE(device->armed);
    }
}

TEST_CASE("two programs cannot feed one watchdog") {
    const Kernel kernel;
    fake_watchdog_add(kPath);
    watchdog_dev first, second;
    message text;
    REQUIRE(watchdog_dev_open(&first, kPath, 15, &text) == ERROR_OK);
    CHECK(watchdog_dev_open(&second, kPath, 15, &text) == ERROR_REFUSED);
    CHECK(std::string(text.text).find("watchdog /dev/watchdog: Device or resource busy; ") == 0);
    CHECK(std::string(text.text).find("another program") != std::string::npos);
    watchdog_dev_close(&first, true);
}
