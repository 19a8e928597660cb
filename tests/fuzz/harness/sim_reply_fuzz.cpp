// SPDX-License-Identifier: Apache-2.0
// Arbitrary replies of a simulated rig to the daemon's backends: every call ends with a value from
// the replies or an error, outputs are unchanged on errors, and the message is one line.
//
// The first byte selects the calls, the second whether the greeting is from the input, too. Then
// the replies, each after a byte for its form: an even one is followed by status, length (two
// bytes) and body, which get the header that fits the request; after an odd one bytes are sent
// unchanged. The socket calls are replaced here, so that nothing waits.
#include <climits>
#include <cstring>
#include <string>

#include "core/error.h"
#include "daemon/backends/sim/sim_bytes.h"
#include "daemon/backends/sim/sim_camera.h"
#include "daemon/backends/sim/sim_connection.h"
#include "daemon/backends/sim/sim_ports.h"
#include "daemon/backends/sim/sim_socket.h"
#include "fuzz_check.hpp"

namespace {

constexpr int kSocket = INT_MAX;  // no process has it, so closing it has no effect
constexpr std::uint16_t kWidth = 4, kHeight = 2;

struct Rig {
    std::string input;
    std::size_t at = 0;
    bool greets = false;   // sends a valid greeting
    std::string received;  // a request's bytes
    std::string reply;     // what is still to come of it
    bool raw = false;

    std::uint8_t byte() {
        return at < input.size() ? static_cast<std::uint8_t>(input[at++]) : std::uint8_t{0};
    }

    void answer(std::int32_t status, const std::string &body) {
        const auto *request = reinterpret_cast<const std::uint8_t *>(received.data());
        std::uint8_t head[SIMRIG_HEADER_BYTES + 4];
        sim_bytes_put_u32(head, static_cast<std::uint32_t>(4 + body.size()));
        sim_bytes_put_u16(head + 4,
                          static_cast<std::uint16_t>(sim_bytes_u16(request + 4) | SIMRIG_REPLY));
        sim_bytes_put_u16(head + 6, sim_bytes_u16(request + 6));
        sim_bytes_put_u32(head + SIMRIG_HEADER_BYTES, static_cast<std::uint32_t>(status));
        reply.assign(reinterpret_cast<const char *>(head), sizeof head);
        reply += body;
    }

    void begin_reply() {
        raw = false;
        const std::uint16_t type =
            sim_bytes_u16(reinterpret_cast<const std::uint8_t *>(received.data()) + 4);
        if (type == SIMRIG_HELLO && greets) {
            answer(SIMRIG_OK, std::string("\1\0\0\0simrig", 10));
        } else if (at < input.size() && byte() % 2 == 0) {
            const auto status = static_cast<std::int8_t>(byte());
            const std::size_t low = byte(), bytes = low + 256u * byte();
            const std::string body = input.substr(at, bytes);
            at += body.size();
            answer(status, body);
        } else {
            raw = true;
        }
        received.clear();
    }

    int receive(char *data, std::size_t bytes) {
        if (reply.empty() && !received.empty()) {
            begin_reply();
        }
        std::string &from = raw ? input : reply;
        const std::size_t begin = raw ? at : 0;
        if (bytes == 0 || from.size() - begin < bytes) {
            return bytes == 0 ? ERROR_OK : ERROR_IO;
        }
        std::memcpy(data, from.data() + begin, bytes);
        if (raw) {
            at += bytes;
        } else {
            reply.erase(0, bytes);
        }
        return ERROR_OK;
    }
};

Rig rig;

}  // namespace

extern "C" {

int sim_socket_connect(const char *, std::int64_t) {
    // Unread bytes of the previous connection are lost.
    rig.received.clear();
    rig.reply.clear();
    rig.raw = false;
    return kSocket;
}

bool sim_socket_has_ended(int) {
    return false;
}

int sim_socket_send(int, const void *data, std::size_t bytes, std::int64_t) {
    if (rig.raw || rig.reply.empty()) {
        rig.received.append(static_cast<const char *>(data), bytes);
        return ERROR_OK;
    }
    FUZZ_CHECK(false);  // a reply is taken whole before the next request
    return ERROR_IO;
}

int sim_socket_receive(int, void *data, std::size_t bytes, std::int64_t) {
    return rig.receive(static_cast<char *>(data), bytes);
}
}

namespace {

// An error of a backend, with a line where the rig gave a reason.
bool failed(const sim_connection &connection, int error) {
    const std::size_t length = strnlen(connection.text, sizeof connection.text);
    FUZZ_CHECK(length < sizeof connection.text);
    for (std::size_t i = 0; i < length; i++) {
        const auto c = static_cast<unsigned char>(connection.text[i]);
        FUZZ_CHECK(c >= ' ' && c != 0x7F);
    }
    FUZZ_CHECK(error == ERROR_OK || std::strcmp(error_text(error), "unknown error") != 0);
    FUZZ_CHECK(error != ERROR_DEVICE || (connection.socket < 0 && length > 0));
    return error != ERROR_OK;
}

void bus(sim_connection *connection) {
    sim_i2c state = {connection, 400000};
    const hal_i2c i2c = sim_i2c_hal(&state);
    std::uint8_t index = 7, bytes[3] = {0xEE, 0xEE, 0xEE};
    std::size_t begun = 99;
    const hal_i2c_message messages[] = {{&index, 1, 0x5D, false}, {bytes, 3, 0x5D, true}};
    const int error = i2c.operations->transfer(i2c.self, messages, 2, 1000, &begun);
    FUZZ_CHECK(begun <= 6 && index == 7);
    failed(*connection, error);
}

void lines(sim_connection *connection) {
    static sim_gpio state;
    state = {};
    state.connection = connection;
    const hal_gpio hal = sim_gpio_hal(&state);
    const hal_gpio_operations &gpio = *hal.operations;
    bool active = true;
    const int error = gpio.get(hal.self, HAL_GPIO_BRIDGE_IRQ, &active);
    FUZZ_CHECK(!failed(*connection, error) || active);
}

void camera(sim_connection *connection) {
    static sim_camera state;
    FUZZ_CHECK(sim_camera_open(&state, connection, std::size_t{kWidth} * kHeight) == ERROR_OK);
    const hal_camera hal = sim_camera_hal(&state), *eye = &hal;
    const hal_camera_format format = {kWidth, kHeight};
    hal_camera_frame frame{};
    hal_camera_counts counts{};
    const bool started = !failed(*connection, eye->operations->start(eye->self, &format));
    FUZZ_CHECK(started);
    if (!failed(*connection, eye->operations->take(eye->self, 300, 9000, &frame))) {
        FUZZ_CHECK(frame.data != nullptr && frame.width_px == kWidth && frame.height_px == kHeight);
        FUZZ_CHECK(frame.begin_us >= 300 && frame.stride == kWidth);
        eye->operations->counts(eye->self, &counts);
        FUZZ_CHECK(counts.frames == 1 && counts.faulty == (frame.faults != 0 ? 1u : 0u));
        eye->operations->give_back(eye->self, &frame);
    }
    failed(*connection, eye->operations->stop(eye->self));
    sim_camera_close(&state);
}

void serial(sim_connection *connection) {
    static sim_uart state;
    state = {};
    state.connection = connection;
    const hal_uart hal = sim_uart_hal(&state), *line = &hal;
    char data[5] = "????";
    std::size_t bytes = 99;
    const int error = line->operations->read(line->self, data, 4, 5000, &bytes);
    FUZZ_CHECK(failed(*connection, error) ? bytes == 99 : bytes >= 1 && bytes <= 4);
    FUZZ_CHECK(data[4] == '\0');
    failed(*connection, line->operations->discard(line->self));
    failed(*connection, line->operations->write(line->self, "abc", 3, 5000));
}

void control(sim_connection *connection) {
    char answer[8] = "???????";
    const int error = sim_connection_control(connection, "status", answer, sizeof answer);
    FUZZ_CHECK(failed(*connection, error) || strnlen(answer, sizeof answer) < sizeof answer);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    static sim_connection connection;
    if (size < 2) {
        return 0;
    }
    rig = Rig{};
    rig.input.assign(reinterpret_cast<const char *>(data) + 2, size - 2);
    rig.greets = data[1] % 2 == 0;
    const unsigned calls = data[0];
    // Waits only one millisecond for another client that advances time.
    if (sim_connection_open(&connection, "unix:rig", SIMRIG_ROLE_BOARD, 1) != ERROR_OK) {
        FUZZ_CHECK(connection.socket < 0 && connection.text[0] != '\0');
        failed(connection, ERROR_OK);
        return 0;
    }
    if ((calls & 1) != 0) {
        std::uint32_t woken = 0;
        failed(connection, sim_connection_advance(&connection, 100, 7, &woken));
    }
    if ((calls & 2) != 0) {
        bus(&connection);
    }
    if ((calls & 4) != 0) {
        lines(&connection);
    }
    if ((calls & 8) != 0) {
        camera(&connection);
    }
    if ((calls & 16) != 0) {
        serial(&connection);
    }
    if ((calls & 32) != 0) {
        control(&connection);
    }
    if ((calls & 64) != 0) {
        const std::uint64_t before_us = connection.now_us;
        sim_connection_renew(&connection, "unix:rig", SIMRIG_ROLE_BOARD);
        FUZZ_CHECK(connection.now_us >= before_us);
        failed(connection, ERROR_OK);
    }
    sim_connection_close(&connection);
    return 0;
}
