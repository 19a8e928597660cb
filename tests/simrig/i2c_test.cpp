// SPDX-License-Identifier: Apache-2.0
// What the board's I2C master reports when a line is held low, by the time that this begins.
#include <doctest/doctest.h>

#include <vector>

#include "tests/simrig/rig_harness.hpp"

using namespace rig_harness;

namespace {

constexpr unsigned kSpeedHz = 100000;
constexpr double kBitUs = 10, kNever = -1;

struct Reported {
    I2cStatus status;
    size_t messages, bytes;
    double took_us;
};

struct Held {
    bool sda, scl;
    double from_bit, to_bit;  // interval since START's fall of SDA, in bits; -1: never
};

// One transfer while a line is held low; afterwards it is released and the bus works again.
Reported transfer(Bench &bench, std::vector<I2cMessage> messages, const Held &held) {
    const double begin_us = bench.rig.now_us();
    const auto at = [&bench, begin_us](double bit, simrig::BusFaults faults) {
        bench.rig.wires().at(uint64_t((begin_us + bit * kBitUs) * simrig::kPsPerUs),
                             [&bench, faults] { bench.rig.host().set_faults(faults); });
    };
    simrig::BusFaults faults;
    faults.sda_stuck = held.sda;
    faults.scl_stuck = held.scl;
    if (held.from_bit <= 0) {
        bench.rig.host().set_faults(faults);
    } else {
        at(held.from_bit, faults);
    }
    if (held.to_bit > 0) {
        at(held.to_bit, {});
    }
    const simrig::I2cResult result = bench.rig.i2c(kSpeedHz, messages);
    const Reported reported = {result.status, result.path_costs_done, result.bytes_done,
                               bench.rig.now_us() - begin_us};
    bench.rig.host().set_faults({});
    CHECK(bench.rig.wires().in.scl);  // released by the master as well
    CHECK(bench.rig.wires().in.sda);
    bench.rig.advance(bench.rig.now_us() + 100, 0);
    CHECK(bench.read(kBridge, 0x00) == 0x5B1D);
    return reported;
}

// The address 0x2C as it goes out: 0101 1000. Then the index 0x04, 0000 0100, and two bytes.
const std::vector<I2cMessage> kWrite = {{kBridge, false, {0x04, 0xFF, 0xFF}}};
const std::vector<I2cMessage> kZeros = {{kBridge, false, {0x04, 0x00, 0x00}}};
const std::vector<I2cMessage> kRead = {{kBridge, false, {0x00}}, {kBridge, true, {0, 0}}};
constexpr double kByteBits = 9;

}  // namespace

TEST_CASE("no line held: the transfer takes the time of its bits") {
    Bench bench;
    const Reported reported = transfer(bench, kWrite, {false, false, kNever, kNever});
    CHECK(reported.status == I2cStatus::kOk);
    CHECK(reported.messages == 1);
    CHECK(reported.took_us == doctest::Approx((4 * kByteBits + 2) * kBitUs).epsilon(0.06));
}

TEST_CASE("a line that is low before START: stuck, and no clock is sent") {
    Bench bench;
    for (const bool scl : {false, true}) {
        const Reported reported = transfer(bench, kWrite, {!scl, scl, 0, kNever});
        CHECK(reported.status == I2cStatus::kStuck);
        CHECK(reported.messages == 0);
        CHECK(reported.bytes == 0);
        CHECK(reported.took_us == 0);
    }
}

TEST_CASE("SDA low where the master releases it: arbitration, at once and without STOP") {
    Bench bench;
    // Found at the next 1: bit 1 or 3 of the address; after its last one bit 5 of the index,
    // because the acknowledgement between them looks like one.
    const struct {
        double from_bit, found_bit;
        size_t bytes;
    } cases[] = {{0.7, 1, 0}, {1.2, 1, 0}, {2.5, 3, 0}, {5.6, kByteBits + 5, 0}};
    for (const auto &c : cases) {
        const Reported reported = transfer(bench, kWrite, {true, false, c.from_bit, kNever});
        CHECK(reported.status == I2cStatus::kArbitration);
        CHECK(reported.messages == 0);
        CHECK(reported.bytes == c.bytes);
        CHECK(reported.took_us > c.found_bit * kBitUs);
        CHECK(reported.took_us < (c.found_bit + 3) * kBitUs);
    }
    // In a byte of data: the address and the index have been acknowledged.
    const Reported data = transfer(bench, kWrite, {true, false, 2 * kByteBits + 3.5, kNever});
    CHECK(data.status == I2cStatus::kArbitration);
    CHECK(data.bytes == 1);
    // In a read: zeros come, and the master's own "no more" at its end is not seen on the wire.
    const Reported read = transfer(bench, kRead, {true, false, 4 * kByteBits + 2.5, kNever});
    CHECK(read.status == I2cStatus::kArbitration);
    CHECK(read.messages == 1);
    CHECK(read.bytes == 1);
}

TEST_CASE("SDA that does not rise at STOP: stuck, though every message is whole") {
    Bench bench;
    // Within the last zeros a held SDA cannot be noticed.
    const Reported reported = transfer(bench, kZeros, {true, false, 3 * kByteBits + 4.5, kNever});
    CHECK(reported.status == I2cStatus::kStuck);
    CHECK(reported.messages == 1);
    CHECK(reported.bytes == 0);
}

TEST_CASE("SCL held: the master waits 25 ms and no longer") {
    Bench bench;
    for (const double from_bit : {2.5, 2 * kByteBits + 3.5, 4 * kByteBits + 0.7}) {
        CAPTURE(from_bit);
        const Reported reported = transfer(bench, kZeros, {false, true, from_bit, kNever});
        CHECK(reported.status == I2cStatus::kTimeout);
        CHECK(reported.took_us > 25 * kMs);
        CHECK(reported.took_us < 26 * kMs);
    }
    const double long_bits = 20 * kMs / kBitUs;
    const Reported slow = transfer(bench, kZeros, {false, true, 2.5, 2.5 + long_bits});
    CHECK(slow.status == I2cStatus::kOk);
    CHECK(slow.took_us > 20 * kMs);
}

TEST_CASE("a lens controller shares the bus with the bridge") {
    simrig::RigSettings settings;
    settings.lens_controller.model = "arducam";
    Bench bench(settings);
    for (const unsigned speed_hz : {100000u, 400000u}) {
        std::vector<I2cMessage> zoom = {{0x0C, false, {0x00}}, {0x0C, true, {0, 0}}};
        const simrig::I2cResult read = bench.rig.i2c(speed_hz, zoom);
        CHECK(read.status == I2cStatus::kOk);
        CHECK(zoom[1].bytes == std::vector<uint8_t>{3000 >> 8, 3000 & 0xFF});
        std::vector<I2cMessage> none = {{0x0D, false, {0x00}}};
        CHECK(bench.rig.i2c(speed_hz, none).status == I2cStatus::kNackAddress);
        CHECK(bench.read(kBridge, 0x00) == 0x5B1D);
    }
}
