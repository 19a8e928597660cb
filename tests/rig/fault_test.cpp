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
        // Cameras turned inwards: servos get pulses.
        error = rig_pan_both(&bench.rig, 69289, -69289);
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

// Fails calls of this kind, and then one works: it leaves no trace.
void try_kind(RigBench &bench, const Fault &kind, uint64_t calls) {
    ::pair pair{};
    const uint64_t seed = synthetic::test_seed();
    std::mt19937_64 random(seed + uint64_t(kind.port) * 2 + kind.for_ever);
    const char *wanted = std::getenv("VERGENCE_RIG_FAULTS");
    const bool all = wanted != nullptr && std::string(wanted) == "all";
    const uint64_t some = wanted == nullptr ? 1 : std::strtoull(wanted, nullptr, 10);
    const uint64_t tries = all || calls < some ? calls : some;
    REQUIRE(calls > 0);
    REQUIRE(tries > 0);
    for (uint64_t i = 0; i < tries; i++) {
        // One per section.
        const uint64_t from = calls * i / tries, to = calls * (i + 1) / tries;
        Fault fault = kind;
        fault.call = from + random() % (to - from);
        CAPTURE(seed);
        CAPTURE(fault.call);
        CAPTURE(calls);
        try_fault(bench, fault);
    }
    const int error = run_all(bench, pair);
    INFO(bench.rig.last_error.text);
    CHECK(error == ERROR_OK);
}

}  // namespace

TEST_CASE("a call that fails is made good, or named within two seconds with the rig safe") {
    const struct {
        const char *what;
        Port port;
        int error;
        bool once;  // the fault is also tried once
    } kinds[] = {
        {"a transfer that is not acknowledged", Port::kI2c, ERROR_I2C_NACK, true},
        {"a bus that is stuck", Port::kI2c, ERROR_I2C_STUCK, true},
        {"an adapter that reports a lost transfer", Port::kI2c, ERROR_IO, true},
        {"a bus whose adapter is unplugged", Port::kI2c, ERROR_DEVICE, false},
        {"a bus that something else pulls at", Port::kI2c, ERROR_I2C_ARBITRATION, true},
        {"a transfer that never ends", Port::kI2c, ERROR_TIMEOUT, true},
        {"lines that cannot be driven or read", Port::kGpio, ERROR_DEVICE, true},
        {"a port that gives no frame", Port::kCamera, ERROR_TIMEOUT, true},
        {"a port that has gone", Port::kCamera, ERROR_DEVICE, true},
        {"a serial line that has gone", Port::kUart, ERROR_IO, true},
        {"a serial adapter that was pulled out", Port::kUart, ERROR_DEVICE, true},
        {"a lens controller that falls silent", Port::kUart, ERROR_TIMEOUT, true},
    };
    RigBench bench;
    ::pair pair{};
    bench.faulty.fail({});
    REQUIRE(run_all(bench, pair) == ERROR_OK);
    uint64_t calls[rig_bench::kPorts];
    for (int port = 0; port < rig_bench::kPorts; port++) {
        calls[port] = bench.faulty.calls(Port(port));
    }
    for (const auto &kind : kinds) {
        CAPTURE(std::string(kind.what));
        if (kind.once) {
            try_kind(bench, {kind.port, 0, false, kind.error}, calls[int(kind.port)]);
        }
        try_kind(bench, {kind.port, 0, true, kind.error}, calls[int(kind.port)]);
    }
}
