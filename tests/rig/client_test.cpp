// SPDX-License-Identifier: Apache-2.0
// The client of the simulated rig: errors exactly as specified by hal/, and invalid rigs.
#include <doctest/doctest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <string>
#include <thread>

#include "bench/rig_bench.hpp"

using rig_bench::SimrigProcess;

namespace {

struct Opened {
    SimrigProcess process;
    sim_backend backend{};
    Opened() {
        REQUIRE(sim_backend_open(&backend, process.where().c_str(), 60000) == ERROR_OK);
        wait_ms(1);
    }
    ~Opened() { sim_backend_close(&backend); }
    uint64_t now_us() { return backend.clock.operations->now_us(backend.clock.self); }
    void wait_ms(uint64_t time_ms) {
        backend.clock.operations->wait_until_us(backend.clock.self, now_us() + 1000 * time_ms);
    }
    // Writes these bytes; returns what reached the bus.
    int write(uint8_t address, std::vector<uint8_t> bytes, size_t &begun) {
        uint8_t back[2];
        const hal_i2c_message messages[] = {{bytes.data(), uint16_t(bytes.size()), address, false},
                                            {bytes.data(), 1, address, false},
                                            {back, sizeof back, address, true}};
        begun = 0;
        return backend.i2c.operations->transfer(backend.i2c.self, messages, 3, now_us() + 25000,
                                                &begun);
    }
};

// Listens, and sends `bytes` to every client.
class Stranger {
  public:
    explicit Stranger(const std::string &bytes) : where("unix:" + folder_ / "socket") {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::strcpy(address.sun_path, (folder_ / "socket").c_str());
        socket_ = socket(AF_UNIX, SOCK_STREAM, 0);
        REQUIRE(bind(socket_, reinterpret_cast<sockaddr *>(&address), sizeof address) == 0);
        REQUIRE(listen(socket_, 1) == 0);
        thread_ = std::thread([this, bytes] {
            const int client = accept(socket_, nullptr, nullptr);
            if (!bytes.empty()) {
                (void)!::write(client, bytes.data(), bytes.size());
            }
            char ignored[64];
            while (read(client, ignored, sizeof ignored) > 0) {
            }
            close(client);
        });
    }
    ~Stranger() {
        thread_.join();
        close(socket_);
    }

  private:
    scratch folder_;
    int socket_ = -1;
    std::thread thread_;

  public:
    const std::string where;
};

}  // namespace

TEST_CASE("what went over the bus is reported exactly") {
    Opened rig;
    size_t begun = 0;
    CHECK(rig.write(BRIDGE_I2C_ADDRESS, {BRIDGE_SCRATCH, 1, 2}, begun) == ERROR_OK);
    CHECK(begun == 4 + 2 + 3);
    CHECK(rig.write(0x11, {0, 1, 2}, begun) == ERROR_I2C_NACK);
    CHECK(begun == 1);
    // Locked: its low byte is rejected.
    CHECK(rig.write(BRIDGE_I2C_ADDRESS, {BRIDGE_SERVO0_MIN_Q4, 0x30, 0}, begun) == ERROR_I2C_NACK);
    CHECK(begun == 4);
    sim_connection_control(&rig.backend.connection, "fault bus sda", nullptr, 0);
    CHECK(rig.write(BRIDGE_I2C_ADDRESS, {BRIDGE_SCRATCH, 1, 2}, begun) == ERROR_I2C_STUCK);
    CHECK(begun == 0);
    sim_connection_control(&rig.backend.connection, "fault bus scl", nullptr, 0);
    CHECK(rig.write(BRIDGE_I2C_ADDRESS, {BRIDGE_SCRATCH, 1, 2}, begun) == ERROR_I2C_STUCK);
    sim_connection_control(&rig.backend.connection, "fault bus ok", nullptr, 0);
    CHECK(rig.write(BRIDGE_I2C_ADDRESS, {BRIDGE_SCRATCH, 1, 2}, begun) == ERROR_OK);
}

TEST_CASE("the number of begun bytes is never reported too low") {
    uint8_t byte = 0;
    const hal_i2c_message messages[] = {
        {&byte, 3, 1, false}, {&byte, 1, 1, false}, {&byte, 4, 1, true}};
    CHECK(sim_i2c_begun(SIMRIG_OK, messages, 3, 3, 0) == 11);
    CHECK(sim_i2c_begun(SIMRIG_I2C_NACK_ADDRESS, messages, 3, 1, 0) == 5);
    CHECK(sim_i2c_begun(SIMRIG_I2C_NACK_DATA, messages, 3, 0, 2) == 4);
    CHECK(sim_i2c_begun(SIMRIG_I2C_ARBITRATION, messages, 3, 2, 1) == 4 + 2 + 1 + 2);
    CHECK(sim_i2c_begun(SIMRIG_I2C_TIMEOUT, messages, 3, 3, 0) == 11);
    CHECK(sim_i2c_begun(SIMRIG_I2C_STUCK, messages, 3, 0, 0) == 0);
}

TEST_CASE("the level of the interrupt, and outputs that do not exist") {
    Opened rig;
    const hal_gpio &gpio = rig.backend.gpio;
    size_t begun = 0;
    bool active = true;
    CHECK(gpio.operations->get(gpio.self, HAL_GPIO_BRIDGE_IRQ, &active) == ERROR_OK);
    CHECK(!active);
    REQUIRE(rig.write(BRIDGE_I2C_ADDRESS, {BRIDGE_IRQ_ENABLE, 0, 0x80}, begun) == ERROR_OK);
    rig.write(BRIDGE_I2C_ADDRESS, {BRIDGE_IRQ_TEST, 0, 0x80}, begun);
    CHECK(gpio.operations->get(gpio.self, HAL_GPIO_BRIDGE_IRQ, &active) == ERROR_OK);
    CHECK(active);
    CHECK(gpio.operations->set(gpio.self, HAL_GPIO_LENS_POWER, true) == ERROR_UNSUPPORTED);
}

TEST_CASE("serial bytes come in order, and their wait ends") {
    Opened rig;
    const hal_uart &uart = rig.backend.uart;
    REQUIRE(uart.operations->write(uart.self, "1?\n", 3, rig.now_us()) == ERROR_OK);
    const uint64_t deadline_us = rig.now_us() + 300000;
    std::string text;
    char piece[5];
    size_t bytes = 0;
    int error = ERROR_OK;
    while ((error = uart.operations->read(uart.self, piece, sizeof piece, deadline_us, &bytes)) ==
           ERROR_OK) {
        text.append(piece, bytes);
    }
    CHECK(error == ERROR_TIMEOUT);
    CHECK(rig.now_us() >= deadline_us);
    CHECK_MESSAGE(text.rfind("V3LC 1\rZoom:", 0) == 0, text);
}

TEST_CASE("frames that begin too early are neither given nor let through the port") {
    rig_bench::RigBench bench;
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    const hal_camera &camera = bench.backend.camera;
    const auto take = [&](uint64_t not_before_us, uint64_t deadline_us, hal_camera_frame &frame) {
        const int error = camera.operations->take(camera.self, not_before_us, deadline_us, &frame);
        if (error == ERROR_OK) {
            raw_image_release(&frame.image);
        }
        return error;
    };
    hal_camera_frame first{}, frame{};
    const uint64_t begin_us = bench.now_us();
    REQUIRE(take(begin_us, begin_us + 300000, first) == ERROR_OK);
    CHECK(take(begin_us + 500000, begin_us + 200000, frame) == ERROR_TIMEOUT);
    CHECK(bench.now_us() >= begin_us + 200000);
    CHECK(bench.now_us() < begin_us + 210000);
    REQUIRE(take(begin_us + 500000, begin_us + 800000, frame) == ERROR_OK);
    CHECK(frame.begin_us >= begin_us + 500000);
    CHECK(frame.begin_us < begin_us + 560000);
    // About twenty were sent meanwhile; each that passes costs its pixels.
    CHECK(frame.sequence <= first.sequence + 2);
}

TEST_CASE("a rig that has gone is an error from then on, and its clock runs out") {
    Opened rig;
    rig.process.kill();
    size_t begun = 0;
    const uint64_t now_us = rig.now_us();
    CHECK(rig.write(BRIDGE_I2C_ADDRESS, {BRIDGE_SCRATCH, 1, 2}, begun) == ERROR_DEVICE);
    rig.wait_ms(1000);
    CHECK(rig.now_us() == now_us + 1000000);
    const hal_camera_format format = {64, 48};
    const hal_camera &camera = rig.backend.camera;
    hal_camera_frame frame{};
    CHECK(camera.operations->start(camera.self, &format) == ERROR_OK);
    CHECK(camera.operations->take(camera.self, 0, rig.now_us() + 1000, &frame) == ERROR_DEVICE);
    CHECK(rig.backend.gpio.operations->set(rig.backend.gpio.self, HAL_GPIO_BRIDGE_RESET, true) ==
          ERROR_DEVICE);
}

TEST_CASE("a server that is not a rig is rejected with one line") {
    sim_connection connection{};
    CHECK(sim_connection_open(&connection, "rig.sock", SIMRIG_ROLE_BOARD, 1000) == ERROR_ARGUMENT);
    CHECK(std::string(connection.text).find("unix:PATH") != std::string::npos);
    CHECK(sim_connection_open(&connection, "tcp:nowhere", SIMRIG_ROLE_BOARD, 1000) ==
          ERROR_ARGUMENT);
    CHECK(sim_connection_open(&connection, "unix:/nowhere/rig", SIMRIG_ROLE_BOARD, 1000) ==
          ERROR_IO);
    CHECK(sim_connection_open(&connection, "unix:/no-such-rig", SIMRIG_ROLE_BOARD, 1000) ==
          ERROR_MISSING);
    CHECK(std::string(connection.text).find("is simrig running") != std::string::npos);
    CHECK(sim_connection_open(&connection, "tcp:127.0.0.1:1", SIMRIG_ROLE_BOARD, 1000) ==
          ERROR_MISSING);
    Opened rig;
    CHECK(sim_connection_open(&connection, rig.process.where().c_str(), SIMRIG_ROLE_BOARD, 5000) ==
          ERROR_REFUSED);
    CHECK(std::string(connection.text).find("another client is the board") != std::string::npos);
    sim_connection_close(&connection);
}

TEST_CASE("strangers that talk rubbish, too much or not at all are given up") {
    const std::string answers[] = {std::string(64, 'x'), std::string(64, '\0'),
                                   std::string("\x04\0\0\0\x01\x80\x02\0\0\0\0\0", 12),
                                   std::string("\xff\xff\xff\x7f\x01\x80\x01\0\0\0\0\0", 12), ""};
    for (const std::string &answer : answers) {
        Stranger stranger(answer);
        sim_connection connection{};
        const auto begin = std::chrono::steady_clock::now();
        CHECK(sim_connection_open(&connection, stranger.where.c_str(), SIMRIG_ROLE_BOARD, 500) ==
              (answer.empty() ? ERROR_TIMEOUT : ERROR_IO));
        CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(20));
        CHECK(std::strlen(connection.text) > 20);
        sim_connection_close(&connection);
    }
}
