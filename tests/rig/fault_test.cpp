// SPDX-License-Identifier: Apache-2.0
// Every call of the hardware's interfaces fails or hangs, once or always, during bring-up, panning,
// a region and capture: within two seconds of rig time the instrument works again or is safe, and
// reports the part. For two cameras with their own ports see unit/rig/pair_two_cameras_test.cpp and
// unit/rig/pair_triggered_test.cpp; for reconstruction, which only uses the store,
// console/reconstruct_test.py. By default one call of each kind is tried, selected by the seed;
// VERGENCE_RIG_FAULTS is their number, or "all" (tools/campaign rig).
#include <doctest/doctest.h>

#include <cstdlib>
#include <random>
#include <string>

#include "bench/rig_bench.hpp"
#include "rig/rig_region.h"
#include "synthetic/seed.hpp"

using rig_bench::Fault;
using rig_bench::Port;
using rig_bench::RigBench;
using rig_bench::small_profile;

namespace {

constexpr uint64_t kLimitUs = 2000000;

bool is_named(Port port, rig_part part) {
    switch (port) {
        case Port::kI2c:
            return part == RIG_PART_BRIDGE || part == RIG_PART_LEFT_SENSOR ||
                   part == RIG_PART_RIGHT_SENSOR || part == RIG_PART_LEFT_SERVO ||
                   part == RIG_PART_RIGHT_SERVO;
        case Port::kGpio:
            return part == RIG_PART_RESET_LINE || part == RIG_PART_IRQ_LINE;
        case Port::kCamera:
            return part == RIG_PART_LEFT_CAMERA || part == RIG_PART_RIGHT_CAMERA;
        default:
            return part == RIG_PART_LEFT_LENS || part == RIG_PART_RIGHT_LENS;
    }
}

// Neither pulses nor frames, according to the bridge itself; or it is held in reset.
bool is_at_rest(RigBench &bench) {
    fpga_bridge bridge{};
    uint16_t control = 0;
    if (fpga_bridge_open(&bridge, &bench.backend.i2c, &bench.backend.clock) != ERROR_OK) {
        return true;
    }
    REQUIRE(fpga_bridge_read(&bridge, BRIDGE_CTRL, &control) == ERROR_OK);
    return control == 0;
}

// A few frames of a region, as the searches take them.
int look_closely(RigBench &bench) {
    const rig_rectangle where = {400, 300, 64, 48};
    rig_region region{};
    uint32_t applied_us = 0;
    int error = rig_region_begin(&bench.rig, &region, RIG_RIGHT, &where, 1);
    if (error == ERROR_OK) {
        error = rig_region_exposure(&bench.rig, &region, 1000, &applied_us);
    }
    for (int i = 0; i < 2 && error == ERROR_OK; i++) {
        rig_region_frame frame{};
        error = rig_region_take(&bench.rig, &region, 0, &frame);
        raw_image_release(&frame.image);
    }
    const int ended = rig_region_end(&bench.rig, &region, false);
    return error == ERROR_OK ? ended : error;
}

int run_all(RigBench &bench, ::pair &pair) {
    int error = rig_bringup(&bench.rig);
    if (error == ERROR_OK) {
        error = rig_pan_both(&bench.rig, 69289, -69289);  // towards each other: servos get pulses
    }
    if (error == ERROR_OK) {
        error = look_closely(bench);
    }
    return error == ERROR_OK ? bench.capture(pair) : error;
}

void try_fault(RigBench &bench, const Fault &fault) {
    ::pair pair{};
    bench.faulty.fail(fault);
    const int error = run_all(bench, pair);
    const uint64_t took_us = bench.now_us() - bench.faulty.failed_us();
    const bool failed = bench.faulty.failed_us() != 0;
    REQUIRE(failed);
    if (error != ERROR_OK) {
        const std::string text = bench.rig.last_error.text;
        CAPTURE(text);
        CHECK(is_named(fault.port, bench.rig.last_error.part));
        CHECK(text.rfind(rig_part_text(bench.rig.last_error.part), 0) == 0);
        CHECK(took_us < kLimitUs);
        // A single failure on the bus is corrected, except for a word that must not be accepted
        // twice.
        CHECK((fault.for_ever || fault.port != Port::kI2c || bench.faulty.failed_once_only()));
    } else {
        // A single failure was corrected; a permanent failure is never a success.
        CHECK(!(fault.for_ever && fault.port == Port::kI2c));
    }
    if (bench.rig.state != RIG_READY) {
        CHECK(is_at_rest(bench));
    }
    bench.faulty.fail({});
}

void try_port(Port port, int error, bool for_ever) {
    RigBench bench;
    ::pair pair{};
    bench.faulty.fail({});
    REQUIRE(run_all(bench, pair) == ERROR_OK);
    const uint64_t calls = bench.faulty.calls(port);
    const uint64_t seed = synthetic::test_seed();
    std::mt19937_64 random(seed + uint64_t(port) * 2 + for_ever);
    const char *wanted = std::getenv("VERGENCE_RIG_FAULTS");
    const bool all = wanted != nullptr && std::string(wanted) == "all";
    const uint64_t some = wanted == nullptr ? 1 : std::strtoull(wanted, nullptr, 10);
    const uint64_t tries = all || calls < some ? calls : some;
    REQUIRE(calls > 0);
    REQUIRE(tries > 0);
    for (uint64_t i = 0; i < tries; i++) {
        // One per section.
        const uint64_t from = calls * i / tries, to = calls * (i + 1) / tries;
        const uint64_t call = from + random() % (to - from);
        CAPTURE(seed);
        CAPTURE(call);
        CAPTURE(calls);
        try_fault(bench, {port, call, for_ever, error});
    }
    // And it leaves no trace.
    INFO(bench.rig.last_error.text);
    CHECK(run_all(bench, pair) == ERROR_OK);
}

}  // namespace

TEST_CASE("a transfer that is not acknowledged once is made good") {
    try_port(Port::kI2c, ERROR_I2C_NACK, false);
}
TEST_CASE("a bus without any answer") {
    try_port(Port::kI2c, ERROR_I2C_NACK, true);
}
TEST_CASE("a bus that is stuck once") {
    try_port(Port::kI2c, ERROR_I2C_STUCK, false);
}
TEST_CASE("a bus that is stuck for ever") {
    try_port(Port::kI2c, ERROR_I2C_STUCK, true);
}
TEST_CASE("an adapter that reports a lost transfer, once and for ever") {
    try_port(Port::kI2c, ERROR_IO, false);
    try_port(Port::kI2c, ERROR_IO, true);
}
TEST_CASE("a bus whose adapter is unplugged") {
    try_port(Port::kI2c, ERROR_DEVICE, true);
}
TEST_CASE("lines that cannot be driven or read, once and for ever") {
    try_port(Port::kGpio, ERROR_DEVICE, false);
    try_port(Port::kGpio, ERROR_DEVICE, true);
}
TEST_CASE("a port that gives no frame once, or no more") {
    try_port(Port::kCamera, ERROR_TIMEOUT, false);
    try_port(Port::kCamera, ERROR_TIMEOUT, true);
}
TEST_CASE("a port that has gone") {
    try_port(Port::kCamera, ERROR_DEVICE, false);
    try_port(Port::kCamera, ERROR_DEVICE, true);
}
TEST_CASE("a bus that something else pulls at, once and for ever") {
    try_port(Port::kI2c, ERROR_I2C_ARBITRATION, false);
    try_port(Port::kI2c, ERROR_I2C_ARBITRATION, true);
}
TEST_CASE("a transfer that takes for ever, once and always") {
    try_port(Port::kI2c, ERROR_TIMEOUT, false);
    try_port(Port::kI2c, ERROR_TIMEOUT, true);
}
TEST_CASE("a serial line that has gone, once and for ever") {
    try_port(Port::kUart, ERROR_IO, false);
    try_port(Port::kUart, ERROR_IO, true);
}
TEST_CASE("a serial adapter that was pulled out, once and for ever") {
    try_port(Port::kUart, ERROR_DEVICE, false);
    try_port(Port::kUart, ERROR_DEVICE, true);
}
TEST_CASE("a lens controller that falls silent") {
    try_port(Port::kUart, ERROR_TIMEOUT, false);
    try_port(Port::kUart, ERROR_TIMEOUT, true);
}
