// SPDX-License-Identifier: Apache-2.0
// Injected faults: the script, which call fails, and that each part fails as a real one would.
#include "daemon/backends/fault/fault.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "camera_harness.hpp"
#include "core/error.h"
#include "daemon/backends/linux/i2c_dev.h"
#include "daemon/backends/linux/monotonic_clock.h"
#include "daemon/backends/store/store.h"
#include "fake_i2c.h"
#include "scratch.hpp"
#include "synthetic/seed.hpp"

namespace {

using linux_harness::Kernel;
using linux_harness::kStart_us;

fault_plan plan_of(const char *script) {
    fault_plan plan;
    message text;
    INFO(std::string(script));
    REQUIRE(fault_plan_parse(&plan, script, &text) == ERROR_OK);
    return plan;
}

std::string rejection(const char *script) {
    fault_plan plan;
    message text;
    CHECK(fault_plan_parse(&plan, script, &text) != ERROR_OK);
    return text.text;
}

/// Whether a message contains all of the words.
bool names(const std::string &text, const std::vector<const char *> &words) {
    return std::all_of(words.begin(), words.end(),
                       [&](const char *word) { return text.find(word) != std::string::npos; });
}

fault_common common_of(fault_plan *plan, const char *part) {
    return {plan, &monotonic_clock, part};
}

// The errors that a plan gives the first calls of an operation.
std::vector<int> errors_of(fault_plan *plan, const char *part, const char *operation, int calls) {
    std::vector<int> errors;
    for (int i = 0; i < calls; i++) {
        errors.push_back(fault_plan_next(plan, part, operation).error);
    }
    return errors;
}

// A serial line that delivers "abc" and counts its calls.
struct EchoUart {
    int calls = 0;
    hal_uart_operations operations{[](void *self, const void *, size_t, uint64_t) {
                                       static_cast<EchoUart *>(self)->calls++;
                                       return 0;
                                   },
                                   [](void *self, void *data, size_t, uint64_t, size_t *bytes) {
                                       static_cast<EchoUart *>(self)->calls++;
                                       std::memcpy(data, "abc", 3);
                                       *bytes = 3;
                                       return 0;
                                   },
                                   [](void *self) {
                                       static_cast<EchoUart *>(self)->calls++;
                                       return 0;
                                   }};
    hal_uart hal{&operations, this};
};

struct EchoGpio {
    int calls = 0;
    hal_gpio_operations operations{[](void *self, hal_gpio_line, bool) {
                                       static_cast<EchoGpio *>(self)->calls++;
                                       return 0;
                                   },
                                   [](void *self, hal_gpio_line, bool *active) {
                                       static_cast<EchoGpio *>(self)->calls++;
                                       *active = true;
                                       return 0;
                                   }};
    hal_gpio hal{&operations, this};
};

}  // namespace

TEST_CASE("which call a rule applies to") {
    const int n = ERROR_I2C_NACK, t = ERROR_TIMEOUT;
    fault_plan once = plan_of("i2c.transfer@3=i2c_nack");
    CHECK(errors_of(&once, "i2c", "transfer", 5) == std::vector<int>{0, 0, n, 0, 0});
    CHECK(once.injected == 1);
    fault_plan ever = plan_of(" i2c.transfer@2+=timeout ,");
    CHECK(errors_of(&ever, "i2c", "transfer", 4) == std::vector<int>{0, t, t, t});
    CHECK(errors_of(&ever, "i2c", "lines", 4) == std::vector<int>{0, 0, 0, 0});
    CHECK(errors_of(&ever, "uart", "read", 4) == std::vector<int>{0, 0, 0, 0});
    fault_plan any = plan_of("*.*@2=timeout i2c.*@1=i2c_nack");
    CHECK(errors_of(&any, "i2c", "lines", 1) == std::vector<int>{n});
    CHECK(errors_of(&any, "store", "save", 2) == std::vector<int>{t, 0});
    fault_plan none = plan_of("");
    CHECK(errors_of(&none, "i2c", "transfer", 2) == std::vector<int>{0, 0});
}

TEST_CASE("probabilities follow the seed and are approximately right") {
    fault_plan first = plan_of("i2c.*%0.1=io,seed=7"), same = plan_of("seed=7,i2c.*%0.1=io");
    fault_plan other = plan_of("i2c.*%0.1=io,seed=8");
    const std::vector<int> errors = errors_of(&first, "i2c", "transfer", 10000);
    CHECK(errors == errors_of(&same, "i2c", "transfer", 10000));
    CHECK(errors != errors_of(&other, "i2c", "transfer", 10000));
    CHECK(first.injected > 850);
    CHECK(first.injected < 1150);
    fault_plan always = plan_of("i2c.*%1=io"), never = plan_of("i2c.*%0=io");
    errors_of(&always, "i2c", "transfer", 1000);
    errors_of(&never, "i2c", "transfer", 1000);
    CHECK(always.injected == 1000);
    CHECK(never.injected == 0);
}

TEST_CASE("only error names are accepted, and all of them") {
#define CHECK_NAME(name, number, text)                                       \
    if ((number) != 0) {                                                     \
        std::string word = #name;                                            \
        for (char &c : word) {                                               \
            c = static_cast<char>(std::tolower(c));                          \
        }                                                                    \
        fault_plan named = plan_of(("i2c.transfer@1=" + word).c_str());      \
        CHECK(fault_plan_next(&named, "i2c", "transfer").error == (number)); \
    }
    ERROR_LIST(CHECK_NAME)
#undef CHECK_NAME
    CHECK(names(rejection("i2c.transfer@1=ok"), {"unknown error"}));
}

TEST_CASE("an invalid script is rejected with the rule and the reason") {
    const struct {
        const char *rule;
        std::vector<const char *> words;
    } wrong[] = {
        {"i2c.transfer@5=nak", {"unknown error", "io", "timeout"}},
        {"i2c@5=io", {"PART.OPERATION@N=ERROR", "@N+", "%P"}},
        {"i2c.transfer@0=io", {"1 to 1000000000"}},
        {"i2c.transfer%2=io", {"probability", "0 to 1"}},
        {"uart.write@1=spoil", {"transfer take read get"}},
        {"i2c.transfer@1", {"PART.OPERATION@N=ERROR"}},
        {"seed=x", {"not an integer"}},
    };
    for (const auto &one : wrong) {
        const std::string text = rejection(one.rule);
        CAPTURE(text);
        CHECK(text.find("fault \"" + std::string(one.rule) + "\": ") == 0);
        CHECK(names(text, one.words));
    }
    for (const char *script :
         {".", "i2c.", ".read", "*.*", "*.*=io", "*.*@", "*.*@x=io", "*.*@-1=io",
          "*.*@99999999999=io", "*.*%=io", "*.*%nan=io", "*.*@1=", "*.*@1=io/", "*.*@1=io/later",
          "*.*@1+x=io", "seed=", "averyverylongpartname.read@1=io",
          "i2c.averyverylongoperation@1=io"}) {
        CHECK_FALSE(rejection(script).empty());
    }
    std::string many;
    for (int i = 0; i < FAULT_PLAN_RULES + 1; i++) {
        many += "*.*@1=io,";
    }
    CHECK(names(rejection(many.c_str()), {"too many rules", "16"}));
}

TEST_CASE("an unknown part or operation is rejected with the known ones") {
    const struct {
        const char *rule;
        std::vector<const char *> words;
    } wrong[] = {
        {"watchdoc.feed@1=io",
         {"unknown part \"watchdoc\"", "i2c left right gpio uart store watchdog *"}},
        {"x.*@1=io", {"unknown part \"x\"", "i2c "}},
        {"i2c.take@1=io", {"unknown operation \"take\"", "transfer lines *"}},
        {"watchdog.period_us@1=io", {"unknown operation \"period_us\"", "feed *"}},
        {"*.sove@1=io",
         {"unknown operation \"sove\"", "set get write read discard load save remove feed *"}},
    };
    for (const auto &one : wrong) {
        const std::string text = rejection(one.rule);
        CAPTURE(text);
        CHECK(text.find("fault \"" + std::string(one.rule) + "\": ") == 0);
        CHECK(names(text, one.words));
    }
    for (const char *script : {"*.save@1=io", "store.*@1=io", "*.*@1=io", "right.take@1=spoil"}) {
        plan_of(script);
    }
    const fault_plan some = plan_of("store.*@1=io,*.feed@1=io");
    CHECK(fault_plan_names(&some, "store"));
    CHECK_FALSE(fault_plan_names(&some, "watchdog"));
    CHECK_FALSE(fault_plan_names(&some, "*.feed"));
}

TEST_CASE("threads that share a plan lose no faults") {
    constexpr int kThreads = 4, kCalls = 20000;
    fault_plan plan = plan_of("*.*@30000=io,*.*@70000=timeout,uart.*@19999=device,i2c.*%1=crc");
    std::vector<std::thread> threads;
    std::array<int, kThreads> seen{};
    const char *const parts[kThreads][2] = {
        {"store", "save"}, {"watchdog", "feed"}, {"uart", "read"}, {"left", "take"}};
    for (size_t i = 0; i < kThreads; i++) {
        threads.emplace_back([&, i] {
            for (int call = 0; call < kCalls; call++) {
                seen[i] += fault_plan_next(&plan, parts[i][0], parts[i][1]).error != 0;
            }
        });
    }
    for (std::thread &thread : threads) {
        thread.join();
    }
    CHECK(std::accumulate(seen.begin(), seen.end(), 0) == 3);
    CHECK(plan.injected == 3);
}

TEST_CASE("a bus: before, after, corrupted, at the deadline; no lines if it has none") {
    const Kernel kernel;
    fake_i2c *adapter = fake_i2c_add("/dev/i2c-1", 0x5D);
    adapter->registers[0] = 0x16;
    i2c_dev dev;
    message text;
    REQUIRE(i2c_dev_open(&dev, "/dev/i2c-1", &text) == ERROR_OK);
    fault_plan plan = plan_of(
        "i2c.transfer@2=i2c_nack,i2c.transfer@3=timeout,i2c.transfer@4=io/after,"
        "i2c.transfer@5=spoil");
    const fault_common common = common_of(&plan, "i2c");
    fault_i2c bus;
    fault_i2c_wrap(&bus, &common, &dev.hal);
    const bool reaches_lines = bus.hal.operations->lines != nullptr;
    CHECK_FALSE(reaches_lines);
    const struct {
        int error;
        unsigned transfers;
        size_t begun;
        uint8_t byte;
        uint64_t took_us;
    } expected[] = {{ERROR_OK, 1, 4, 0x16, 0},         {ERROR_I2C_NACK, 1, 1, 0xEE, 0},
                    {ERROR_TIMEOUT, 1, 0, 0xEE, 5000}, {ERROR_IO, 2, 4, 0x16, 0},
                    {ERROR_OK, 3, 4, 0xE9, 0},         {ERROR_OK, 4, 4, 0x16, 0}};
    for (const auto &one : expected) {
        uint8_t index = 0, byte = 0xEE;
        size_t begun = 99;
        const hal_i2c_message messages[] = {{&index, 1, 0x5D, false}, {&byte, 1, 0x5D, true}};
        const uint64_t before_us = fake_kernel_now_us();
        CHECK(bus.hal.operations->transfer(bus.hal.self, messages, 2, before_us + 5000, &begun) ==
              one.error);
        CHECK(adapter->transfers == one.transfers);
        CHECK(begun == one.begun);
        CHECK(byte == one.byte);
        CHECK(index == 0);
        CHECK(fake_kernel_now_us() == before_us + one.took_us);
    }
    i2c_dev_close(&dev);
}

TEST_CASE("a wrapped bus keeps its lines") {
    const hal_i2c_operations operations = {nullptr, [](void *, unsigned pulled, unsigned *high) {
                                               *high = ~pulled & (HAL_I2C_SCL | HAL_I2C_SDA);
                                               return 0;
                                           }};
    const hal_i2c real = {&operations, nullptr};
    fault_plan plan = plan_of("i2c.lines@1=io");
    const fault_common common = common_of(&plan, "i2c");
    fault_i2c bus;
    fault_i2c_wrap(&bus, &common, &real);
    unsigned high = 99;
    CHECK(bus.hal.operations->lines(bus.hal.self, HAL_I2C_SDA, &high) == ERROR_IO);
    CHECK(high == 99);
    CHECK(bus.hal.operations->lines(bus.hal.self, HAL_I2C_SDA, &high) == ERROR_OK);
    CHECK(high == HAL_I2C_SCL);
}

TEST_CASE("a camera: no frame is leaked, and damage is reported") {
    const Kernel kernel;
    fake_video_add(linux_harness::kVideo, V4L2_PIX_FMT_GREY, 64, 48);
    linux_harness::Camera real;
    fault_plan plan = plan_of(
        "left.start@1=unsupported,left.take@1=timeout,left.take@2=io/after,left.take@3=spoil,"
        "left.control@1=range,left.stop@1=device,right.take@1+=io");
    const fault_common common = common_of(&plan, "left");
    fault_camera wrapped;
    fault_camera_wrap(&wrapped, &common, &real.camera.hal);
    const hal_camera_operations *camera = wrapped.hal.operations;
    void *self = wrapped.hal.self;
    const hal_camera_format format = {64, 48};
    CHECK(camera->start(self, &format) == ERROR_UNSUPPORTED);
    REQUIRE(camera->start(self, &format) == ERROR_OK);
    hal_camera_frame frame{};
    CHECK(camera->take(self, 0, kStart_us + 1000, &frame) == ERROR_TIMEOUT);
    CHECK(fake_kernel_now_us() == kStart_us + 1000);
    CHECK(camera->take(self, 0, kStart_us + 1000000, &frame) == ERROR_IO);
    CHECK(frame.image.data == nullptr);
    CHECK(camera->take(self, 0, kStart_us + 1000000, &frame) == ERROR_OK);
    CHECK(frame.faults == HAL_CAMERA_DAMAGED);
    raw_image_release(&frame.image);
    for (int i = 0; i < 5; i++) {
        REQUIRE(camera->take(self, 0, kStart_us + 1000000, &frame) == ERROR_OK);
        CHECK(frame.faults == 0);
        raw_image_release(&frame.image);
    }
    int32_t applied = 0;
    CHECK(camera->control(self, HAL_CAMERA_GAIN_PART, 1, &applied) == ERROR_RANGE);
    CHECK(camera->control(self, HAL_CAMERA_GAIN_PART, 1, &applied) == ERROR_UNSUPPORTED);
    hal_camera_counts counts;
    camera->counts(self, &counts);
    CHECK(counts.frames == 7);
    CHECK(camera->stop(self) == ERROR_DEVICE);
    CHECK_FALSE(real.camera.stream.on);
}

TEST_CASE("lines and serial lines: outputs are untouched on errors") {
    const Kernel kernel;
    EchoUart uart;
    fault_plan plan = plan_of(
        "uart.write@1=timeout/after,uart.read@1=device,uart.read@2=io/after,uart.read@3=spoil,"
        "uart.discard@1=io,gpio.get@1=io,gpio.get@2=spoil,gpio.set@1=device");
    const fault_common on_uart = common_of(&plan, "uart"), on_gpio = common_of(&plan, "gpio");
    fault_uart line;
    fault_uart_wrap(&line, &on_uart, &uart.hal);
    const auto read = [&](std::string *got) {
        char data[8] = "";
        size_t bytes = 77;
        const int error = line.hal.operations->read(line.hal.self, data, 8, kStart_us, &bytes);
        got->assign(data, 3);
        CHECK((error == ERROR_OK) == (bytes == 3));
        return error;
    };
    std::string got;
    CHECK(line.hal.operations->write(line.hal.self, "x", 1, kStart_us + 50) == ERROR_TIMEOUT);
    CHECK(uart.calls == 1);
    CHECK(read(&got) == ERROR_DEVICE);
    CHECK(uart.calls == 1);
    CHECK(read(&got) == ERROR_IO);
    CHECK(uart.calls == 2);
    CHECK(read(&got) == ERROR_OK);
    CHECK(got == "\x9E\x9D\x9C");
    CHECK(read(&got) == ERROR_OK);
    CHECK(got == "abc");
    CHECK(line.hal.operations->discard(line.hal.self) == ERROR_IO);
    CHECK(line.hal.operations->discard(line.hal.self) == ERROR_OK);

    EchoGpio gpio;
    fault_gpio lines;
    fault_gpio_wrap(&lines, &on_gpio, &gpio.hal);
    bool active = false;
    const hal_gpio_line reset = HAL_GPIO_BRIDGE_RESET;
    CHECK(lines.hal.operations->get(lines.hal.self, reset, &active) == ERROR_IO);
    CHECK_FALSE(active);
    CHECK(gpio.calls == 0);
    active = true;
    CHECK(lines.hal.operations->get(lines.hal.self, reset, &active) == ERROR_OK);
    CHECK_FALSE(active);
    CHECK(lines.hal.operations->get(lines.hal.self, reset, &active) == ERROR_OK);
    CHECK(active);
    CHECK(lines.hal.operations->set(lines.hal.self, reset, true) == ERROR_DEVICE);
    CHECK(gpio.calls == 2);
    CHECK(lines.hal.operations->set(lines.hal.self, reset, true) == ERROR_OK);
    CHECK(gpio.calls == 3);
}

TEST_CASE("a store and a watchdog") {
    const Kernel kernel;
    const scratch place;
    store real;
    message text;
    REQUIRE(store_open(&real, place.path.c_str(), &text) == ERROR_OK);
    fault_plan plan = plan_of(
        "store.save@1=full,store.save@2=io/after,store.load@1=crc,store.remove@1=refused,"
        "watchdog.feed@2+=device");
    const fault_common common = common_of(&plan, "store"),
                       on_watchdog = common_of(&plan, "watchdog");
    fault_store wrapped;
    fault_store_wrap(&wrapped, &common, &real.hal);
    const hal_store_operations *records = wrapped.hal.operations;
    char data[8] = "";
    size_t bytes = 77;
    CHECK(records->save(wrapped.hal.self, "a", "new", 3) == ERROR_FULL);
    CHECK(records->load(wrapped.hal.self, "a", data, 8, &bytes) == ERROR_CRC);
    CHECK(records->load(wrapped.hal.self, "a", data, 8, &bytes) == ERROR_MISSING);
    CHECK(bytes == 77);
    CHECK(records->save(wrapped.hal.self, "a", "new", 3) == ERROR_IO);
    CHECK(records->load(wrapped.hal.self, "a", data, 8, &bytes) == ERROR_OK);
    CHECK(bytes == 3);
    CHECK(records->remove(wrapped.hal.self, "a") == ERROR_REFUSED);
    CHECK(records->remove(wrapped.hal.self, "a") == ERROR_OK);
    store_close(&real);

    const hal_watchdog_operations operations = {[](void *) { return 0; },
                                                [](void *) { return uint64_t{15}; }};
    const hal_watchdog watchdog = {&operations, nullptr};
    fault_watchdog guarded;
    fault_watchdog_wrap(&guarded, &on_watchdog, &watchdog);
    CHECK(guarded.hal.operations->feed(guarded.hal.self) == ERROR_OK);
    CHECK(guarded.hal.operations->feed(guarded.hal.self) == ERROR_DEVICE);
    CHECK(guarded.hal.operations->period_us(guarded.hal.self) == 15);
}
