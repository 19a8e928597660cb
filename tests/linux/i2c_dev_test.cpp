// SPDX-License-Identifier: Apache-2.0
// hal_i2c on i2c-dev: its calls, and how it maps their errors.
#include "daemon/backends/linux/i2c_dev.h"

#include <fcntl.h>
#include <linux/i2c.h>

#include <array>
#include <string>
#include <vector>

#include "core/error.h"
#include "daemon/backends/linux/monotonic_clock.h"
#include "fake_i2c.h"
#include "linux_harness.hpp"

namespace {

using linux_harness::Kernel;
using linux_harness::kStart_us;
using linux_harness::record;

const char *const kPath = "/dev/i2c-1";
constexpr uint8_t kBridge = 0x5D;

// Reads the word at index 0x10, as every driver does: an index, a repeated START, two bytes.
int read_word(i2c_dev &bus, uint64_t deadline_us, size_t *begun, std::array<uint8_t, 2> *word) {
    uint8_t index = 0x10;
    const hal_i2c_message messages[] = {{&index, 1, kBridge, false},
                                        {word->data(), 2, kBridge, true}};
    return bus.hal.operations->transfer(bus.hal.self, messages, 2, deadline_us, begun);
}

struct Bus {
    i2c_dev dev;
    message text;

    Bus() { REQUIRE(i2c_dev_open(&dev, kPath, &text) == ERROR_OK); }
    ~Bus() { i2c_dev_close(&dev); }
};

}  // namespace

TEST_CASE("one transfer may have as many messages and bytes as the interface allows") {
    const Kernel kernel;
    fake_i2c_add(kPath, kBridge);
    const Bus bus;
    std::vector<uint8_t> bytes(HAL_I2C_BYTES_MAX, 0xA5);
    std::vector<hal_i2c_message> messages(HAL_I2C_MESSAGES_MAX,
                                          {bytes.data(), HAL_I2C_BYTES_MAX, kBridge, false});
    messages.back().read = true;
    size_t begun = 0;
    CHECK(bus.dev.hal.operations->transfer(bus.dev.hal.self, messages.data(), messages.size(),
                                           kStart_us + 1000000, &begun) == ERROR_OK);
    CHECK(begun == HAL_I2C_MESSAGES_MAX * (1 + HAL_I2C_BYTES_MAX));
}

TEST_CASE("every errno maps to the interface's error, and the transfer is not repeated") {
    const struct {
        int system, ours;
    } pairs[] = {
        {ENXIO, ERROR_I2C_NACK},
        {EREMOTEIO, ERROR_I2C_NACK},
        {EAGAIN, ERROR_I2C_ARBITRATION},
        {ETIMEDOUT, ERROR_TIMEOUT},
        {EINTR, ERROR_TIMEOUT},
        {EBUSY, ERROR_I2C_STUCK},
        {EOPNOTSUPP, ERROR_UNSUPPORTED},
        {ENODEV, ERROR_DEVICE},
        {ESHUTDOWN, ERROR_DEVICE},
        {EIO, ERROR_IO},
        {EINVAL, ERROR_IO},
        {ENOMEM, ERROR_IO},
        {EPROTO, ERROR_IO},
    };
    for (const auto &pair : pairs) {
        CAPTURE(pair.system);
        const Kernel kernel;
        const fake_i2c *adapter = fake_i2c_add(kPath, kBridge);
        Bus bus;
        size_t begun = 99;
        std::array<uint8_t, 2> word{};
        fake_kernel_fail("I2C_RDWR", 1, pair.system, 1);
        CHECK(read_word(bus.dev, kStart_us + 50000, &begun, &word) == pair.ours);
        CHECK(begun == 5);  // the kernel does not report how far it got
        CHECK(adapter->transfers == 0);
        CHECK(read_word(bus.dev, kStart_us + 50000, &begun, &word) == ERROR_OK);

        // Before the transfer nothing was clocked.
        fake_kernel_fail("I2C_TIMEOUT", 1, pair.system, 1);
        CHECK(read_word(bus.dev, kStart_us + 500000, &begun, &word) == pair.ours);
        CHECK(begun == 0);
        CHECK(adapter->transfers == 1);
    }
}

TEST_CASE("a missing device, and a partial transfer") {
    const Kernel kernel;
    fake_i2c *adapter = fake_i2c_add(kPath, 0x20);
    Bus bus;
    size_t begun = 0;
    std::array<uint8_t, 2> word{};
    CHECK(read_word(bus.dev, kStart_us + 50000, &begun, &word) == ERROR_I2C_NACK);
    // i2c-virtio: no errno, but fewer messages than requested, or none.
    adapter->address = kBridge;
    for (const int done : {0, 1}) {
        adapter->only_messages = done;
        CHECK(read_word(bus.dev, kStart_us + 50000, &begun, &word) == ERROR_I2C_NACK);
        CHECK(begun == 5);
    }
}

TEST_CASE("deadlines set the adapter's timeout") {
    const Kernel kernel;
    const fake_i2c *adapter = fake_i2c_add(kPath, kBridge);
    Bus bus;
    size_t begun = 99;
    std::array<uint8_t, 2> word{};
    record();
    CHECK(read_word(bus.dev, kStart_us, &begun, &word) == ERROR_TIMEOUT);
    CHECK(begun == 0);
    CHECK(record().empty());
    CHECK(read_word(bus.dev, kStart_us + 1, &begun, &word) == ERROR_OK);
    CHECK(adapter->timeout_10ms == 1);  // 0 would mean no wait at all
    CHECK(read_word(bus.dev, kStart_us + 10000, &begun, &word) == ERROR_OK);
    CHECK(adapter->timeout_10ms == 1);
    CHECK(read_word(bus.dev, kStart_us + 600000, &begun, &word) == ERROR_OK);
    CHECK(adapter->timeout_10ms == 60);
    CHECK(read_word(bus.dev, UINT64_MAX, &begun, &word) == ERROR_OK);
    CHECK(adapter->timeout_10ms == 6000);
}

TEST_CASE("each call of opening fails in turn: an error with advice, and nothing open") {
    for (const int error : linux_harness::kErrors) {
        for (const unsigned times : {1U, 0U}) {
            message text;
            unsigned last = 0;
            linux_harness::each_call_fails(
                error, times,
                [&] {
                    fake_i2c_add(kPath, kBridge);
                    i2c_dev bus;
                    const int result = i2c_dev_open(&bus, kPath, &text);
                    CHECK((result == ERROR_OK) == (bus.fd >= 0));
                    i2c_dev_close(&bus);
                    return result;
                },
                [&](unsigned nth, int result) {
                    last = nth;
                    // Errors of close() do not matter.
                    CHECK((result != ERROR_OK) == (nth < 4));
                    CHECK(std::string(text.text).find(kPath) != std::string::npos);
                    if (nth == 1) {
                        CHECK(result == (error == ENODEV || error == ENXIO   ? ERROR_DEVICE
                                         : error == EACCES || error == EBUSY ? ERROR_REFUSED
                                                                             : ERROR_IO));
                    }
                });
            CHECK(last == 4);
        }
    }
}

TEST_CASE("signals do not disturb opening") {
    for (unsigned nth = 1; nth <= 2; nth++) {
        const Kernel kernel;
        fake_i2c_add(kPath, kBridge);
        fake_kernel_fail("", nth, EINTR, 2);
        const Bus bus;
        CHECK(bus.dev.fd >= 0);
    }
}

TEST_CASE("an SMBus-only adapter is rejected") {
    const Kernel kernel;
    fake_i2c_add(kPath, kBridge)->functions = I2C_FUNC_SMBUS_EMUL;
    i2c_dev bus;
    message text;
    CHECK(i2c_dev_open(&bus, kPath, &text) == ERROR_UNSUPPORTED);
    CHECK(std::string(text.text).find("I2C bus /dev/i2c-1 supports SMBus only") == 0);
    CHECK(std::string(text.text).find("I2C_FUNC_I2C") != std::string::npos);
    CHECK(i2c_dev_open(&bus, "/dev/i2c-99", &text) == ERROR_DEVICE);
    CHECK(std::string(text.text).find("I2C bus /dev/i2c-99: No such file or directory; ") == 0);
}

TEST_CASE("the clock sleeps to the microsecond despite signals") {
    const Kernel kernel;
    const hal_clock &clock = monotonic_clock;
    CHECK(clock.operations->now_us(clock.self) == kStart_us);
    fake_kernel_fail("clock sleep", 1, EINTR, 3);
    clock.operations->wait_until_us(clock.self, kStart_us + 1234567);
    CHECK(clock.operations->now_us(clock.self) == kStart_us + 1234567);
    CHECK(fake_kernel_failed());
    record();
    clock.operations->wait_until_us(clock.self, kStart_us);
    CHECK(record().empty());
}
