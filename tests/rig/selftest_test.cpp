// SPDX-License-Identifier: Apache-2.0
// The self test fails at any of its calls: afterwards the cameras have their previous source, or
// the rig is safe; and the message names the part. By default few calls are tried, selected by the
// seed; with VERGENCE_RIG_FAULTS=all, all of them (tools/campaign rig).
#include <doctest/doctest.h>

#include <array>
#include <cstdlib>
#include <random>
#include <string>

#include "bench/rig_bench.hpp"
#include "synthetic/seed.hpp"

using rig_bench::Fault;
using rig_bench::Port;
using rig_bench::RigBench;

namespace {

/// The source selected in the bridge.
uint16_t selected(RigBench &bench) {
    uint16_t select = 0;
    REQUIRE(fpga_bridge_read(&bench.rig.bridge, BRIDGE_CAM_SELECT, &select) == ERROR_OK);
    return select;
}

void bring_up(RigBench &bench) {
    ::pair pair{};
    bench.faulty.fail({});
    REQUIRE(rig_bringup(&bench.rig) == ERROR_OK);
    uint32_t applied_us = 0;
    REQUIRE(rig_exposure(&bench.rig, 3, 4000, &applied_us) == ERROR_OK);
    REQUIRE(bench.capture(pair) == ERROR_OK);  // the right camera is selected after it
}

void try_fault(RigBench &bench, const Fault &fault) {
    if (bench.rig.state != RIG_READY) {
        bring_up(bench);
    }
    const uint16_t before = selected(bench);
    const rig rig_before = bench.rig;
    std::string message;
    bench.faulty.fail(fault);
    const int error = bench.run("selftest", message);
    bench.faulty.fail({});
    CAPTURE(message);
    INFO(std::string(error_text(error)));
    CHECK(bench.rig.format.width_px == rig_before.format.width_px);
    CHECK(bench.rig.format.height_px == rig_before.format.height_px);
    if (error != 0) {
        // The part, not only the name of an error.
        CHECK(message != error_text(error));
        bool named = message.find("bridge's test picture") != std::string::npos ||
                     message.find("port behind the bridge") != std::string::npos;
        for (int part = RIG_PART_NONE + 1; part < RIG_PARTS; part++) {
            named = named || message.rfind(rig_part_text(rig_part(part)), 0) == 0;
        }
        CHECK(named);
    }
    if (bench.rig.state == RIG_READY) {
        ::pair pair{};
        CHECK(selected(bench) == before);
        CHECK(bench.capture(pair) == ERROR_OK);
        for (const pair_frame &frame : pair.frame) {
            CHECK(frame.image.width_px == rig_before.format.width_px);
            CHECK(frame.exposure_us == rig_before.camera[0].exposure_us);
        }
    } else {
        CHECK(error != 0);
        CHECK(bench.rig.state == RIG_SAFE);
        fpga_bridge bridge{};
        uint16_t control = 0xFFFF;
        if (fpga_bridge_open(&bridge, &bench.backend.i2c, &bench.backend.clock) == ERROR_OK) {
            REQUIRE(fpga_bridge_read(&bridge, BRIDGE_CTRL, &control) == ERROR_OK);
            CHECK(control == 0);
        }
        CHECK(!bench.rig.camera[RIG_LEFT].streaming);
        CHECK(!bench.rig.camera[RIG_RIGHT].streaming);
    }
}

}  // namespace

TEST_CASE("a self test that fails leaves the rig as it was, or safe, and names the part") {
    RigBench bench(rig_bench::small_profile(64, 48));
    std::string message;
    bring_up(bench);
    const uint16_t before = selected(bench);
    bench.faulty.fail({});
    REQUIRE(bench.run("selftest", message) == ERROR_OK);
    CHECK(selected(bench) == before);
    const uint64_t seed = synthetic::test_seed();
    std::mt19937_64 random(seed);
    const char *wanted = std::getenv("VERGENCE_RIG_FAULTS");
    const bool all = wanted != nullptr && std::string(wanted) == "all";
    const std::array<uint64_t, 2> counts = {bench.faulty.calls(Port::kCamera),
                                            bench.faulty.calls(Port::kI2c)};
    for (const Port port : {Port::kCamera, Port::kI2c}) {
        const uint64_t count = counts.at(port == Port::kI2c ? 1 : 0);
        using Errors = std::array<int, 2>;
        const Errors errors = port == Port::kCamera ? Errors{ERROR_TIMEOUT, ERROR_DEVICE}
                                                    : Errors{ERROR_I2C_NACK, ERROR_IO};
        REQUIRE(count > 0);
        const uint64_t tries = all || port == Port::kCamera ? count : 2;
        for (uint64_t i = 0; i < tries; i++) {
            // One call per section, once or permanently, with one error or the other.
            const uint64_t from = count * i / tries, to = count * (i + 1) / tries;
            const uint64_t call = from + random() % (to - from);
            const uint64_t chosen = random() % 4;
            for (unsigned way = 0; way < 4; way++) {
                if (all || way == chosen) {
                    const bool for_ever = way % 2 != 0;
                    const int error = errors.at(way / 2);
                    CAPTURE(seed);
                    CAPTURE(call);
                    CAPTURE(for_ever);
                    INFO(std::string(error_text(error)));
                    try_fault(bench, {port, call, for_ever, error});
                }
            }
        }
    }
}
