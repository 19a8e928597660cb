// SPDX-License-Identifier: Apache-2.0
// Calls with random arguments and results, recorded and replayed: equal calls get equal results, to
// the byte; a different call ends the replay with a line that names it.
#include <deque>
#include <fstream>
#include <functional>
#include <iterator>
#include <sstream>

#include "daemon/backends/replay/replay.h"
#include "daemon/session/record.h"
#include "scratch.hpp"
#include "session_harness.hpp"
#include "synthetic/seed.hpp"

using namespace session_harness;

namespace {

/// Backends with random results.
struct random_backend {
    Random chance{synthetic::test_seed()};
    std::uint64_t time = 1000;
    std::vector<std::uint16_t> planes[2];
    hal_clock_operations clock_operations{
        [](void *self) { return static_cast<random_backend *>(self)->time += 7; },
        [](void *self, std::uint64_t time_us) {
            auto &now = static_cast<random_backend *>(self)->time;
            now = std::max(now, time_us);
        },
        nullptr};
    hal_i2c_operations i2c_operations{
        [](void *self, const hal_i2c_message *messages, std::size_t count, std::uint64_t,
           std::size_t *begun) {
            auto &random = static_cast<random_backend *>(self)->chance;
            *begun = upto(random, 300);
            for (std::size_t i = 0; i < count; i++) {
                for (int k = 0; messages[i].read && k < messages[i].bytes; k++) {
                    messages[i].data[k] = static_cast<std::uint8_t>(random());
                }
            }
            return upto(random, 3) == 0 ? int(ERROR_I2C_NACK) : 0;
        },
        [](void *self, unsigned pulled, unsigned *high) {
            *high = pulled ^
                    static_cast<unsigned>(upto(static_cast<random_backend *>(self)->chance, 3));
            return 0;
        }};
    hal_gpio_operations gpio_operations{
        [](void *, hal_gpio_line line, bool) { return line == 0 ? 0 : int(ERROR_UNSUPPORTED); },
        [](void *self, hal_gpio_line, bool *active) {
            *active = upto(static_cast<random_backend *>(self)->chance, 1) == 1;
            return 0;
        }};
    hal_uart_operations uart_operations{
        [](void *, const void *, std::size_t, std::uint64_t) { return 0; },
        [](void *self, void *data, std::size_t capacity, std::uint64_t, std::size_t *bytes) {
            auto &random = static_cast<random_backend *>(self)->chance;
            if (upto(random, 3) == 0) {
                return int(ERROR_TIMEOUT);
            }
            *bytes = 1 + upto(random, capacity - 1);
            for (std::size_t i = 0; i < *bytes; i++) {
                static_cast<std::uint8_t *>(data)[i] = static_cast<std::uint8_t>(random());
            }
            return 0;
        },
        [](void *) { return 0; }};
    hal_camera_operations camera_operations{
        [](void *, const hal_camera_format *) { return 0; }, [](void *) { return 0; },
        [](void *self, std::uint64_t not_before_us, std::uint64_t, hal_camera_frame *frame) {
            auto &backend = *static_cast<random_backend *>(self);
            if (upto(backend.chance, 4) == 0) {
                return int(ERROR_TIMEOUT);
            }
            pair_frame made{};
            auto &pixels = backend.planes[upto(backend.chance, 1)];
            random_frame(backend.chance, made, pixels);
            *frame = {};
            frame->image = made.image;
            frame->sequence = made.sequence;
            frame->faults = static_cast<std::uint32_t>(upto(backend.chance, 15));
            frame->begin_us = not_before_us;
            frame->end_us = not_before_us + 50;
            return 0;
        },
        [](void *self, hal_camera_control, std::int32_t value, std::int32_t *applied) {
            *applied = value - static_cast<std::int32_t>(
                                   upto(static_cast<random_backend *>(self)->chance, 9));
            return 0;
        },
        [](void *self, hal_camera_counts *counts) {
            counts->frames =
                static_cast<std::uint32_t>(static_cast<random_backend *>(self)->chance());
            counts->faulty = counts->gaps = counts->timeouts = counts->restarts = 3;
        }};
    hal_clock clock{&clock_operations, this};
    hal_i2c i2c{&i2c_operations, this};
    hal_gpio gpio{&gpio_operations, this};
    hal_uart uart{&uart_operations, this};
    hal_camera camera{&camera_operations, this};
    rig_ports ports{};
    random_backend() {
        ports.clock = &clock;
        ports.i2c = &i2c;
        ports.gpio = &gpio;
        ports.camera[0] = ports.camera[1] = &camera;
        ports.lens_uart = &uart;
    }
};

void report_i2c(const rig_ports &ports, Random &random, std::ostream &out) {
    std::uint8_t data[HAL_I2C_MESSAGES_MAX][HAL_I2C_BYTES_MAX];
    hal_i2c_message messages[HAL_I2C_MESSAGES_MAX];
    const std::size_t count = 1 + upto(random, HAL_I2C_MESSAGES_MAX - 1);
    for (std::size_t i = 0; i < count; i++) {
        const auto bytes = static_cast<std::uint16_t>(1 + upto(random, HAL_I2C_BYTES_MAX - 1));
        messages[i] = {data[i], bytes, static_cast<std::uint8_t>(upto(random, 127)),
                       upto(random, 1) == 1};
        for (int k = 0; k < bytes; k++) {
            data[i][k] = static_cast<std::uint8_t>(random());
        }
    }
    std::size_t begun = 0;
    const int code =
        ports.i2c->operations->transfer(ports.i2c->self, messages, count, random(), &begun);
    out << code << " " << begun;
    for (std::size_t i = 0; i < count && code == 0; i++) {
        out.write(reinterpret_cast<const char *>(data[i]), messages[i].bytes);
    }
}

void report_camera(const rig_ports &ports, Random &random, std::ostream &out) {
    const hal_camera &camera = *ports.camera[upto(random, 1)];
    hal_camera_frame frame{};
    const int code = camera.operations->take(camera.self, random(), random(), &frame);
    out << code;
    if (code != 0) {
        return;
    }
    out << frame.image.width_px << " " << frame.image.height_px << " " << int(frame.image.bits)
        << frame.image.layout << " " << frame.sequence << " " << frame.faults << " "
        << frame.begin_us << " " << frame.end_us;
    for (int y = 0; y < frame.image.height_px; y++) {
        out.write(reinterpret_cast<const char *>(raw_image_row(&frame.image, y)),
                  long(raw_image_row_values(&frame.image) * sizeof *frame.image.data));
    }
    raw_image_release(&frame.image);
}

void report_uart(const rig_ports &ports, Random &random, std::ostream &out) {
    std::vector<std::uint8_t> data(1 + upto(random, 5000));
    for (auto &byte : data) {
        byte = static_cast<std::uint8_t>(random());
    }
    const hal_uart &uart = *ports.lens_uart;
    if (upto(random, 1) == 0) {
        out << uart.operations->write(uart.self, data.data(), data.size(), random());
    } else {
        std::size_t bytes = 0;
        const int code =
            uart.operations->read(uart.self, data.data(), data.size(), random(), &bytes);
        out << code << " ";
        out.write(reinterpret_cast<const char *>(data.data()), long(code == 0 ? bytes : 0));
    }
    out << uart.operations->discard(uart.self);
}

void report_rest(const rig_ports &ports, Random &random, std::ostream &out) {
    const hal_gpio &gpio = *ports.gpio;
    const auto line = static_cast<hal_gpio_line>(upto(random, HAL_GPIO_LINES - 1));
    bool active = false;
    out << gpio.operations->set(gpio.self, line, upto(random, 1) == 1);
    out << gpio.operations->get(gpio.self, line, &active) << active;
    const hal_clock &clock = *ports.clock;
    clock.operations->wait_until_us(clock.self, upto(random, 1000000));
    out << clock.operations->now_us(clock.self) << " ";
    unsigned high = 0;
    out << ports.i2c->operations->lines(ports.i2c->self, static_cast<unsigned>(upto(random, 3)),
                                        &high)
        << high;
    const hal_camera &camera = *ports.camera[0];
    const hal_camera_format format{static_cast<std::uint16_t>(upto(random, 2048)), 3};
    std::int32_t applied = 0;
    hal_camera_counts counts{};
    out << camera.operations->start(camera.self, &format)
        << camera.operations->control(camera.self, HAL_CAMERA_GAIN_PART, 500, &applied) << applied
        << camera.operations->stop(camera.self);
    camera.operations->counts(camera.self, &counts);
    out << counts.frames << " " << counts.restarts;
}

/// Makes one or a few calls; returns them as text with all results.
std::string report(const rig_ports &ports, Random &random) {
    std::ostringstream out;
    switch (upto(random, 3)) {
        case 0:
            report_i2c(ports, random, out);
            break;
        case 1:
            report_camera(ports, random, out);
            break;
        case 2:
            report_uart(ports, random, out);
            break;
        default:
            report_rest(ports, random, out);
            break;
    }
    return out.str();
}

struct recorded {
    scratch folder;
    std::string path = folder / "session";
    std::vector<std::string> reported;

    explicit recorded(int calls) {
        random_backend backend;
        auto recorder = std::make_unique<record>();
        rig_ports ports{};
        record_init(recorder.get(), &backend.ports, &ports);
        CHECK(ports.camera[0] == ports.camera[1]);
        auto writer = new_writer();
        message last_error{};
        REQUIRE(session_writer_begin(writer.get(), AT_FDCWD, path.c_str(), "v1", "rig", "now",
                                     &last_error) == 0);
        Random before(1);
        report(ports, before);  // not recorded
        REQUIRE(record_start(recorder.get(), writer.get(), &last_error) == 0);
        Random random(synthetic::test_seed() + 1);
        for (int i = 0; i < calls; i++) {
            reported.push_back(report(ports, random));
            if (i % 50 == 0) {
                REQUIRE(record_flush(recorder.get(), &last_error) == 0);
            }
        }
        REQUIRE(record_stop(recorder.get(), &last_error) == 0);
        report(ports, before);
        REQUIRE(session_writer_end(writer.get(), &last_error) == 0);
    }
    std::string log() const {
        std::ifstream file(path + "/calls.log", std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
};

struct player {
    std::unique_ptr<replay> value = std::make_unique<replay>();
    message last_error{};
    int code;
    explicit player(const std::string &path)
        : code(replay_open(value.get(), AT_FDCWD, path.c_str(), nullptr, &last_error)) {}
    ~player() { replay_close(value.get()); }
    player(const player &) = delete;
    player &operator=(const player &) = delete;
};

}  // namespace

TEST_CASE("the same calls get the same answers, twice") {
    const recorded original(400);
    for (int round = 0; round < 2; round++) {
        player played(original.path);
        INFO(std::string(played.last_error.text));
        REQUIRE(played.code == 0);
        CHECK(std::string(played.value->profile) == "rig");
        Random random(synthetic::test_seed() + 1);
        for (std::size_t i = 0; i < original.reported.size(); i++) {
            INFO("call ", i, ": ", std::string(played.value->last_error.text));
            REQUIRE(!replay_is_over(played.value.get()));
            REQUIRE(report(played.value->ports, random) == original.reported[i]);
        }
        CHECK(replay_is_over(played.value.get()));
        CHECK(!played.value->ended);
        // One call too many; time must continue.
        const hal_clock &clock = *played.value->ports.clock;
        clock.operations->wait_until_us(clock.self, 0);
        const std::uint64_t now = clock.operations->now_us(clock.self);
        CHECK(clock.operations->now_us(clock.self) >= now + 1000000);
        CHECK(std::string(played.value->last_error.text).find("the recording ends here") !=
              std::string::npos);
    }
}

TEST_CASE("a different call ends the replay, and is named") {
    const recorded original(40);
    player played(original.path);
    REQUIRE(played.code == 0);
    Random random(synthetic::test_seed() + 1);
    for (int i = 0; i < 20; i++) {
        REQUIRE(report(played.value->ports, random) == original.reported[std::size_t(i)]);
    }
    const hal_clock &clock = *played.value->ports.clock;
    clock.operations->wait_until_us(clock.self, 4711);
    const std::string last_error = played.value->last_error.text;
    CHECK(last_error.find("calls.log: line ") != std::string::npos);
    CHECK(last_error.find("expected the call '") != std::string::npos);
    CHECK(last_error.find("got 'clock wait 4711'") != std::string::npos);
    CHECK(last_error.find('\n') == std::string::npos);
    // All calls fail from here on, none blocks, and the first reason is kept.
    hal_camera_frame frame{};
    const hal_camera &camera = *played.value->ports.camera[0];
    CHECK(camera.operations->take(camera.self, 0, 1, &frame) == ERROR_IO);
    CHECK(played.value->last_error.text == last_error);
}

TEST_CASE("the clock, idling and cancellations are replayed where they were recorded") {
    const scratch folder;
    const std::string path = folder / "session";
    random_backend backend;
    auto recorder = std::make_unique<record>();
    auto instrument = std::make_unique<rig>();
    auto writer = new_writer();
    message last_error{};
    rig_ports ports{};
    record_init(recorder.get(), &backend.ports, &ports);
    instrument->ports = ports;
    REQUIRE(session_writer_begin(writer.get(), AT_FDCWD, path.c_str(), "v1", "rig", "now",
                                 &last_error) == 0);
    REQUIRE(record_start(recorder.get(), writer.get(), &last_error) == 0);
    const auto read = [](const rig_ports &session_ports) {
        return session_ports.clock->operations->now_us(session_ports.clock->self);
    };
    const auto wait = [](const rig_ports &session_ports) {
        session_ports.clock->operations->wait_until_us(session_ports.clock->self, 0);
    };
    std::vector<std::uint64_t> times;
    record_command(recorder.get(), "one");
    for (int i = 0; i < 3000; i++) {  // the clock's time changes every millisecond without a call
        backend.time += upto(backend.chance, 9);
        times.push_back(read(ports));
        if (upto(backend.chance, 300) == 0) {
            wait(ports);
        }
    }
    wait(ports);
    record_cancel(recorder.get());
    record_cancel(recorder.get());
    record_command_end(recorder.get(), ERROR_CANCELLED);
    const std::uint64_t before = recorder->calls;
    backend.time += 5000;
    record_command(recorder.get(), "without a call, and a failure: not recorded");
    read(ports);
    record_cancel(recorder.get());
    record_command_end(recorder.get(), ERROR_CANCELLED);
    CHECK(record_idle(recorder.get(), instrument.get()) == 0);  // makes no call: not recorded
    CHECK(recorder->calls == before);
    REQUIRE(record_stop(recorder.get(), &last_error) == 0);
    REQUIRE(session_writer_end(writer.get(), &last_error) == 0);

    player played(path);
    REQUIRE(played.code == 0);
    int cancelled = 0;
    played.value->cancel = [](void *self) { ++*static_cast<int *>(self); };
    played.value->self = &cancelled;
    random_backend again;
    std::size_t at = 0;
    for (int i = 0; i < 3000; i++) {
        (void)upto(again.chance, 9);
        REQUIRE(read(played.value->ports) == times[at++]);
        if (upto(again.chance, 300) == 0) {
            wait(played.value->ports);
        }
    }
    CHECK(cancelled == 0);
    wait(played.value->ports);
    CHECK(cancelled == 1);
    CHECK(replay_is_over(played.value.get()));
    CHECK(!played.value->ended);
}

TEST_CASE("a truncated log replays up to its last CRC; a modified one is rejected") {
    const recorded original(120);
    const std::string whole = original.log();
    const std::size_t first = whole.find("crc32 ");
    for (std::size_t length = 0; length < whole.size(); length += 1 + length / 50) {
        original.folder.write("session/calls.log", whole.substr(0, length));
        player played(original.path);
        INFO("length ", length, ": ", std::string(played.last_error.text));
        CHECK(played.code == (length < first + 15 ? ERROR_MISSING : 0));
        if (played.code == 0) {
            Random random(synthetic::test_seed() + 1);
            for (const std::string &reported : original.reported) {
                const std::string again = report(played.value->ports, random);
                if (played.value->ended) {
                    break;
                }
                REQUIRE(again == reported);
            }
            CHECK(std::string(played.value->last_error.text).find("the recording ends here") !=
                  std::string::npos);
        }
    }
    Random random(synthetic::test_seed() + 2);
    for (int i = 0; i < 50; i++) {
        std::string changed = whole;
        const std::size_t at = upto(random, whole.rfind("crc32 "));
        changed[at] = static_cast<char>(changed[at] ^ 1);
        original.folder.write("session/calls.log", changed);
        const player played(original.path);
        INFO("byte ", at);
        CHECK(played.code != 0);
    }
}

TEST_CASE("a session of pairs without calls replays as two cameras") {
    const scratch folder;
    const std::string path = folder / "session";
    Random random(synthetic::test_seed());
    auto writer = new_writer();
    message last_error{};
    REQUIRE(session_writer_begin(writer.get(), AT_FDCWD, path.c_str(), "v1", "two-cameras", "now",
                                 &last_error) == 0);
    std::vector<owned_pair> pairs(5);
    std::uint64_t time_us = 1000;
    for (auto &made : pairs) {
        random_pair(random, made);
        for (auto &frame : made.value.frame) {
            frame.begin_us = time_us;
            frame.end_us = time_us += 40;
            frame.parts = 0;
        }
        REQUIRE(session_writer_pair(writer.get(), &made.value, &last_error) == 0);
    }
    REQUIRE(session_writer_end(writer.get(), &last_error) == 0);
    player played(path);
    REQUIRE(played.code == 0);
    const rig_ports &ports = played.value->ports;
    auto instrument = std::make_unique<rig>();
    played.value->rig = instrument.get();
    CHECK(ports.i2c == nullptr);
    REQUIRE(ports.camera[0] != ports.camera[1]);
    std::uint64_t end_us = 0;
    for (std::size_t i = 0; i <= pairs.size(); i++) {
        for (int side = 0; side < RIG_SIDES; side++) {
            const hal_camera &camera = *ports.camera[side];
            hal_camera_frame frame{};
            const std::uint64_t now_us = ports.clock->operations->now_us(ports.clock->self);
            int code = camera.operations->take(camera.self, now_us, now_us + 5000, &frame);
            if (code == 0 && upto(random, 1) == 0) {
                // The same scene until it is captured.
                raw_image_release(&frame.image);
                end_us = frame.end_us;
                code = camera.operations->take(camera.self, end_us, end_us + 5000, &frame);
            }
            if (i == pairs.size()) {
                CHECK(code == ERROR_TIMEOUT);
                CHECK(std::string(played.value->last_error.text).find("5 recorded pairs") !=
                      std::string::npos);
                continue;
            }
            REQUIRE(code == 0);
            const pair_frame &expected = pairs[i].value.frame[side];
            CHECK(frame.begin_us >= end_us);
            CHECK(frame.end_us - frame.begin_us == 40);
            end_us = frame.end_us;
            REQUIRE(frame.image.height_px == expected.image.height_px);
            for (int y = 0; y < frame.image.height_px; y++) {
                CHECK(std::memcmp(raw_image_row(&frame.image, y), raw_image_row(&expected.image, y),
                                  raw_image_row_values(&frame.image) * 2) == 0);
            }
            raw_image_release(&frame.image);
        }
        instrument->pairs++;  // simulates a capture
    }
    CHECK(replay_is_over(played.value.get()));
}
