// SPDX-License-Identifier: Apache-2.0
// Calls of the hardware's interfaces fail, once or always, during the commands that search or
// merge: autoexpose, iris learn, iris sharp=, capture average= and bracket=. Afterwards either the
// rig is safe, or its lenses are at rest, and windows, exposures and gains are as before, in the
// sensors too; and the next try works. By default one call of each kind is tried, selected by the
// seed; VERGENCE_RIG_FAULTS is their number, or "all" (tools/campaign rig).
#include <doctest/doctest.h>

#include <array>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "bench/rig_bench.hpp"
#include "synthetic/seed.hpp"

using rig_bench::Fault;
using rig_bench::Port;
using rig_bench::RigBench;

namespace {

// What must be as before after a failure.
std::vector<uint32_t> settings_of(const ::rig &rig) {
    std::vector<uint32_t> values = {rig.format.width_px, rig.format.height_px};
    for (const rig_camera &camera : rig.camera) {
        const mt9t001_window &window = camera.sensor.window;
        values.insert(values.end(),
                      {camera.sensor.shutter_rows, camera.exposure_us, camera.sensor.gain_q3,
                       camera.gain_q3, window.column_px, window.row_px, window.width_px,
                       window.height_px, window.skip, window.hblank_clocks, window.vblank_rows});
    }
    return values;
}

struct Tried {
    const char *line;
    // Lines that set what it changes.
    std::vector<std::string> lead;
    bool keeps_settings;  // restores the settings also when it succeeds
    bool is_long;         // long command: fewer kinds of failures are tried
};

const Tried kAutoexpose = {"autoexpose", {"exposure 700", "gain 2"}, false, false};
const Tried kIrisLearn = {"iris learn side=left", {"exposure 10000", "gain 2"}, true, true};
const Tried kIrisSharp = {"iris sharp=1790:1810",
                          {"zoom 10x", "focus 1800 mm", "iris 850", "exposure 2000"},
                          false,
                          false};
const Tried kAverage = {"capture average=3", {"exposure 10000", "gain 1"}, true, false};
const Tried kBracket = {"capture bracket=3", {"exposure 10000", "gain 1"}, true, false};

int run(RigBench &bench, const std::string &line, std::string &message) {
    if (line.rfind("capture ", 0) != 0) {
        return bench.run(line, message);
    }
    static constexpr pair_memory kMemory = {std::malloc, std::free};
    const bool averages = line.find("average") != std::string::npos;
    const auto frames = uint8_t(line.back() - '0');
    const pair_options options = {false, averages ? frames : uint8_t(0),
                                  averages ? uint8_t(0) : frames, 0, &kMemory};
    ::pair pair{};
    const int error = pair_capture(&bench.rig, &options, &pair);
    if (error == ERROR_OK) {
        pair_release(pair.frame);
    }
    message = bench.rig.last_error.text;
    return error;
}

void prepare(RigBench &bench, const Tried &tried) {
    std::string message;
    bench.faulty.fail({});
    if (bench.rig.state != RIG_READY) {
        REQUIRE_MESSAGE(rig_bringup(&bench.rig) == ERROR_OK, bench.rig.last_error.text);
    }
    for (const std::string &line : tried.lead) {
        const int error = bench.run(line, message);
        INFO(line << ": " << message);
        REQUIRE(error == ERROR_OK);
    }
}

void check_after(RigBench &bench, const std::vector<uint32_t> &before, bool as_before) {
    if (bench.rig.state != RIG_READY) {
        return;
    }
    if (as_before) {
        CHECK(settings_of(bench.rig) == before);
    }
    for (rig_camera &camera : bench.rig.camera) {
        CHECK(mt9t001_check(&camera.sensor) == ERROR_OK);
    }
    CHECK(bench.control("status").find("lens_moves: true") == std::string::npos);
}

// Whether it came to the call: how many there are depends on when a lens arrives.
bool try_fault(RigBench &bench, const Tried &tried, const Fault &fault) {
    prepare(bench, tried);
    const std::vector<uint32_t> before = settings_of(bench.rig);
    std::string message;
    bench.faulty.fail(fault);
    const int error = run(bench, tried.line, message);
    const bool failed = bench.faulty.failed_us() != 0;
    bench.faulty.fail({});
    CAPTURE(message);
    CAPTURE(error);
    CHECK((error == ERROR_OK || (failed && !message.empty())));
    check_after(bench, before, tried.keeps_settings || error != ERROR_OK);
    return failed;
}

void try_kind(RigBench &bench, const Tried &tried, const Fault &kind, uint64_t calls) {
    const uint64_t seed = synthetic::test_seed();
    std::mt19937_64 random(seed + uint64_t(kind.port) * 2 + kind.for_ever);
    const char *wanted = std::getenv("VERGENCE_RIG_FAULTS");
    const bool all = wanted != nullptr && std::string(wanted) == "all";
    const uint64_t some = wanted == nullptr ? 1 : std::strtoull(wanted, nullptr, 10);
    const uint64_t tries = all || calls < some ? calls : some;
    uint64_t failed = 0;
    for (uint64_t i = 0; i < tries; i++) {
        // One per section.
        const uint64_t from = calls * i / tries, to = calls * (i + 1) / tries;
        Fault fault = kind;
        fault.call = from + random() % (to - from);
        CAPTURE(seed);
        CAPTURE(tried.line);
        CAPTURE(int(fault.port));
        CAPTURE(fault.for_ever);
        CAPTURE(fault.error);
        CAPTURE(fault.call);
        CAPTURE(calls);
        failed += try_fault(bench, tried, fault);
    }
    CHECK(failed * 2 >= tries);
}

// `asked`: how often the command asks whether it should stop.
void cancel(RigBench &bench, const Tried &tried, unsigned asked) {
    const uint64_t seed = synthetic::test_seed();
    std::mt19937_64 random(seed);
    std::string message;
    for (int i = 0; i < (tried.is_long ? 1 : 2); i++) {
        prepare(bench, tried);
        const std::vector<uint32_t> before = settings_of(bench.rig);
        int left = int(random() % asked);
        INFO("VERGENCE_SEED=" << seed << ": " << tried.line << " stops after " << left << " of "
                              << asked);
        bench.keep_going = [&left] { return left-- > 0; };
        const int error = run(bench, tried.line, message);
        bench.keep_going = [] { return true; };
        CHECK((error == ERROR_CANCELLED || error == ERROR_OK));
        CHECK(bench.rig.state == RIG_READY);
        check_after(bench, before, tried.keeps_settings || error != ERROR_OK);
    }
}

void try_all(const Tried &tried) {
    static constexpr std::array<Fault, 11> kKinds = {{
        {Port::kI2c, 0, false, ERROR_I2C_NACK},
        {Port::kI2c, 0, true, ERROR_I2C_NACK},
        {Port::kI2c, 0, false, ERROR_IO},
        {Port::kI2c, 0, true, ERROR_DEVICE},
        {Port::kCamera, 0, false, ERROR_TIMEOUT},
        {Port::kCamera, 0, true, ERROR_TIMEOUT},
        {Port::kCamera, 0, false, ERROR_DEVICE},
        {Port::kUart, 0, false, ERROR_TIMEOUT},
        {Port::kUart, 0, true, ERROR_TIMEOUT},
        {Port::kUart, 0, false, ERROR_DEVICE},
        {Port::kUart, 0, true, ERROR_DEVICE},
    }};
    RigBench bench;
    std::string message;
    prepare(bench, tried);
    bench.faulty.fail({});
    unsigned asked = 0;
    bench.keep_going = [&asked] { return ++asked > 0; };
    const int error = run(bench, tried.line, message);
    bench.keep_going = [] { return true; };
    INFO(tried.line << ": " << message);
    REQUIRE(error == ERROR_OK);
    std::array<uint64_t, rig_bench::kPorts> calls{};
    for (int port = 0; port < rig_bench::kPorts; port++) {
        calls[size_t(port)] = bench.faulty.calls(Port(port));
    }
    for (size_t i = 0; i < kKinds.size(); i += tried.is_long ? 5 : 1) {
        if (calls[size_t(kKinds[i].port)] > 0) {
            try_kind(bench, tried, kKinds[i], calls[size_t(kKinds[i].port)]);
        }
    }
    cancel(bench, tried, asked);
    // And it leaves no trace.
    prepare(bench, tried);
    CHECK(run(bench, tried.line, message) == ERROR_OK);
}

}  // namespace

TEST_CASE("autoexpose fails or is cancelled") {
    try_all(kAutoexpose);
}
TEST_CASE("iris learn fails or is cancelled") {
    try_all(kIrisLearn);
}
TEST_CASE("iris sharp= fails or is cancelled") {
    try_all(kIrisSharp);
}
TEST_CASE("capture average= fails or is cancelled") {
    try_all(kAverage);
}
TEST_CASE("capture bracket= fails or is cancelled") {
    try_all(kBracket);
}
