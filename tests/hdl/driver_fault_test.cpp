// SPDX-License-Identifier: Apache-2.0
// The driver with bus faults, one at a time: its return value, its counters, and the bridge's
// registers.
#include <doctest/doctest.h>

#include "bench/driver_rig.hpp"

namespace {

using hdl::kMs;
using hdl::kUs;

constexpr uint16_t kOld = 0x1234, kNew = 0xA5C3;

// The fall before bit `bit` of byte `byte`; 8 is its acknowledge bit.
constexpr uint64_t fall(unsigned byte, unsigned bit) {
    return 9 * byte + bit + 1;
}
// A write with read-back: address, index, high, low, START, address, index, START, address, data.
constexpr uint64_t kReadBack = fall(4, 0) + fall(2, 0) + fall(1, 0);

// Ends a transfer in the middle, as the DSP's reset does.
void break_off(hdl::DriverRig &rig, uint8_t address, uint8_t index, uint64_t moves) {
    hdl::I2cMaster master(rig.world.bridge, hdl::branch_timing(400));
    master.abort_after(moves);
    try {
        master.write(address, {index}, false);
        master.read(address, 4);
        FAIL("it ended before");
    } catch (const hdl::Aborted &) {
    }
    master.let_go();
}

// At this fall of each transfer, or of the first only.
void at_fall(hdl::DriverRig &rig, uint64_t number, bool once, std::function<void()> what) {
    const uint64_t only = rig.bus.transfers() + 1;
    rig.bus.on_fall([&rig, number, once, only, what](uint64_t n) {
        if (n == number && (!once || rig.bus.transfers() == only)) {
            what();
        }
    });
}

}  // namespace

TEST_CASE("a bridge that is not there, or stays silent in the middle") {
    hdl::DriverRig rig;
    uint16_t value = 77;
    rig.world.bridge.in.reset = 1;
    rig.world.bridge.drive();
    CHECK(fpga_bridge_read(&rig.driver, BRIDGE_SCRATCH, &value) == ERROR_I2C_NACK);
    CHECK(value == 77);
    CHECK(rig.counted() == "nacks 4, repeats 3");
    fpga_bridge other;
    CHECK(fpga_bridge_open(&other, rig.bus.bus(), rig.bus.clock()) == ERROR_I2C_NACK);
    rig.heal();
    CHECK(fpga_bridge_read(&rig.driver, BRIDGE_SCRATCH, &value) == ERROR_OK);
    CHECK(value == 0);
    CHECK(rig.counted() == "transfers 1");
}

TEST_CASE("bytes that are not acknowledged") {
    hdl::DriverRig rig;
    const auto write = [&] { return fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, kNew); };
    for (unsigned byte : {0u, 1u, 2u}) {
        const auto wrong = [byte](uint64_t n) { return n == fall(byte, 8); };
        rig.bus.misread(wrong);
        CHECK(write() == ERROR_I2C_NACK);
        CHECK(rig.counted() == "nacks 4, repeats 3");
        rig.heal();
        CHECK(rig.world.peek(BRIDGE_SCRATCH) == kOld);
    }
    // The low byte's: the bridge may have accepted the word, and here it did.
    rig.bus.misread([](uint64_t n) { return n == fall(3, 8); });
    CHECK(write() == ERROR_REFUSED);
    CHECK(rig.counted() == "repeats 3, refused 4");
    rig.heal();
    CHECK(rig.world.peek(BRIDGE_SCRATCH) == kNew);
    const uint64_t first = rig.bus.transfers() + 1;
    rig.bus.misread([&](uint64_t n) { return n == fall(2, 8) && rig.bus.transfers() == first; });
    CHECK(fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, 0x5678) == ERROR_OK);
    CHECK(rig.counted() == "transfers 1, nacks 1, repeats 1");
    CHECK(rig.world.peek(BRIDGE_SCRATCH) == 0x5678);
}

TEST_CASE("words that the bridge refuses, and a register that is not there") {
    hdl::DriverRig rig;
    REQUIRE(rig.world.poke(BRIDGE_UNLOCK, 0));
    CHECK(fpga_bridge_write(&rig.driver, BRIDGE_CAM_SELECT, 3) == ERROR_REFUSED);
    CHECK(rig.counted() == "repeats 3, refused 4");
    CHECK(fpga_bridge_write(&rig.driver, BRIDGE_SERVO0_MIN_Q4, 9600) == ERROR_REFUSED);
    CHECK(fpga_bridge_write(&rig.driver, BRIDGE_WDG_MS, 0) == ERROR_REFUSED);
    CHECK(rig.world.peek(BRIDGE_CAM_SELECT) == 0x0200);
    CHECK(rig.world.peek(BRIDGE_SERVO0_MIN_Q4) == 0x3840);
    CHECK(rig.world.peek(BRIDGE_WDG_MS) == 1000);
    rig.counted();
    uint8_t bytes[] = {0xF0, 1, 2};
    const hal_i2c_message message = {bytes, sizeof bytes, BRIDGE_I2C_ADDRESS, false};
    fpga_bridge_job job{};
    job.messages = &message;
    job.count = 1;
    job.repeatable_bytes = SIZE_MAX;
    CHECK(fpga_bridge_bus_run(&rig.driver.bus, &job) == ERROR_I2C_NACK);
    CHECK(rig.counted() == "nacks 4, repeats 3");
}

TEST_CASE("SDA held by the bridge or by a sensor in the middle of a read that was broken off") {
    for (uint8_t address : {uint8_t(BRIDGE_I2C_ADDRESS), uint8_t(0x5C)}) {
        hdl::DriverRig rig;
        rig.world.left.registers.fill(0);
        uint64_t moves = 70;  // far into the data
        do {
            moves++;
            rig.world.bridge.run_idle(40 * kMs);
            break_off(rig, address, BRIDGE_STATUS, moves);
        } while (rig.world.bridge.out().sda != 0);
        rig.took_us();
        uint16_t value = 0;
        CHECK(fpga_bridge_read(&rig.driver, BRIDGE_SCRATCH, &value) == ERROR_OK);
        CHECK(value == kOld);
        CHECK(rig.counted() == "transfers 1, stuck 1, repeats 1, recoveries 1");
        CHECK(rig.took_us() <= 35000);
        CHECK(rig.bus.recovery_falls() == 0);
    }
}

TEST_CASE("a sensor that holds its SDA does not keep the driver from the bridge") {
    hdl::DriverRig rig;
    rig.world.left.hang(true, false);
    rig.bus.wait(10 * kUs);
    uint16_t value = 0;
    CHECK(fpga_bridge_read(&rig.driver, BRIDGE_SCRATCH, &value) == ERROR_OK);
    CHECK(fpga_bridge_read(&rig.driver, BRIDGE_I2C_DIAG, &value) == ERROR_OK);
    CHECK((value & BRIDGE_I2C_DIAG_BRANCH_SDA_MASK) == 2 << BRIDGE_I2C_DIAG_BRANCH_SDA_SHIFT);
    CHECK(rig.counted() == "transfers 2");
}

TEST_CASE("SDA held by something else, temporarily and permanently") {
    hdl::DriverRig rig;
    rig.bus.others_pull(HAL_I2C_SDA, 10 * kMs);
    CHECK(fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, kNew) == ERROR_OK);
    CHECK(rig.counted() == "transfers 1, stuck 1, repeats 1, recoveries 1");
    CHECK(rig.world.peek(BRIDGE_SCRATCH) == kNew);
    rig.took_us();
    rig.bus.others_pull(HAL_I2C_SDA);
    CHECK(fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, kOld) == ERROR_I2C_STUCK);
    CHECK(rig.counted() == "stuck 1, recoveries 1, unrecovered 1");
    CHECK(rig.took_us() <= FPGA_BRIDGE_CALL_US);
    rig.heal();
    CHECK(rig.world.peek(BRIDGE_SCRATCH) == kNew);
    CHECK(fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, kOld) == ERROR_OK);
}

TEST_CASE("SCL held: within the deadline, beyond it, permanently, and often") {
    hdl::DriverRig rig;
    const auto write = [&](uint16_t value) {
        return fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, value);
    };
    const auto stretch = [&](uint64_t duration_ps) {
        return [&rig, duration_ps] { rig.bus.others_pull(HAL_I2C_SCL, duration_ps); };
    };
    at_fall(rig, fall(3, 4), false, stretch(20 * kMs));
    CHECK(write(kNew) == ERROR_OK);
    CHECK(rig.counted() == "transfers 1");
    at_fall(rig, fall(3, 4), true, stretch(40 * kMs));
    CHECK(write(kOld) == ERROR_OK);
    CHECK(rig.counted() == "transfers 1, timeouts 1, repeats 1, recoveries 1");
    CHECK(rig.world.peek(BRIDGE_SCRATCH) == kOld);
    at_fall(rig, fall(3, 4), false, stretch(28 * kMs));
    rig.took_us();
    CHECK(write(kNew) == ERROR_TIMEOUT);
    CHECK(rig.counted() == "timeouts 4, repeats 3, recoveries 4");
    CHECK(rig.took_us() <= FPGA_BRIDGE_CALL_US);
    CHECK(rig.world.peek(BRIDGE_SCRATCH) == kOld);
    at_fall(rig, fall(3, 4), true, stretch(UINT64_MAX));
    CHECK(write(kNew) == ERROR_I2C_STUCK);
    CHECK(rig.counted() == "timeouts 1, recoveries 1, unrecovered 1");
    CHECK(rig.took_us() <= FPGA_BRIDGE_CALL_US);
    rig.heal();
    CHECK(rig.world.peek(BRIDGE_SCRATCH) == kOld);
    rig.bus.on_fall([&](uint64_t) { rig.bus.others_pull(HAL_I2C_SCL, 500 * kUs); });
    CHECK(write(kNew) == ERROR_TIMEOUT);
    CHECK(rig.counted() == "timeouts 4, repeats 3, recoveries 4");
}

TEST_CASE("arbitration lost at each bit that is let go") {
    hdl::DriverRig rig;
    unsigned lost = 0;
    for (uint64_t number = fall(0, 0); number < fall(4, 0); number++) {
        REQUIRE(rig.world.poke(BRIDGE_SCRATCH, kOld));
        at_fall(rig, number, true, [&] { rig.bus.others_pull(HAL_I2C_SDA, 4 * kUs); });
        CHECK(fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, kNew) == ERROR_OK);
        const std::string counted = rig.counted();
        if (counted != "transfers 1") {
            CHECK(counted == "transfers 1, arbitration 1, repeats 1, recoveries 1");
            lost++;
        }
        CHECK(rig.world.peek(BRIDGE_SCRATCH) == kNew);
    }
    // Ones of address, index and data; the other device's pull may last into the next bit.
    CHECK(lost >= 3 + 1 + 8);
    at_fall(rig, fall(3, 0), false, [&] { rig.bus.others_pull(HAL_I2C_SDA, 4 * kUs); });
    CHECK(fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, 0x00FF) == ERROR_I2C_ARBITRATION);
    CHECK(rig.counted() == "arbitration 4, repeats 3, recoveries 4");
    rig.heal();
    CHECK(rig.world.peek(BRIDGE_SCRATCH) == kNew);
}

TEST_CASE("a line that turns a bit over is noticed, whichever it is") {
    hdl::DriverRig rig;
    const auto turn = [&](uint64_t number, bool once) {
        const uint64_t only = rig.bus.transfers() + 1;
        rig.bus.on_fall([&rig, number, once, only](uint64_t n) {
            rig.world.bridge.in.sda_noise = n == number && (!once || rig.bus.transfers() == only);
            rig.world.bridge.drive();
        });
    };
    for (unsigned bit = 0; bit < 16; bit++) {
        const uint16_t wrong = uint16_t(kNew ^ 0x8000u >> bit);
        const uint64_t number = fall(2 + bit / 8, bit % 8);
        turn(number, true);
        CHECK(fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, kNew) == ERROR_OK);
        CHECK(rig.counted() == "transfers 1, verify 1, repeats 1");
        CHECK(rig.world.peek(BRIDGE_SCRATCH) == kNew);
        turn(number, false);
        CHECK(fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, kNew) == ERROR_VERIFY);
        CHECK(rig.counted() == "verify 4, repeats 3");
        rig.heal();
        CHECK(rig.world.peek(BRIDGE_SCRATCH) == wrong);
    }
    REQUIRE(fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, kOld) == ERROR_OK);
    for (unsigned bit = 0; bit < 16; bit++) {  // the bridge is correct, the master misreads it
        rig.counted();
        rig.bus.misread([&](uint64_t n) { return n == kReadBack + 9 * (bit / 8) + bit % 8; });
        CHECK(fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, kNew) == ERROR_VERIFY);
        CHECK(rig.counted() == "verify 4, repeats 3");
        rig.heal();
        CHECK(rig.world.peek(BRIDGE_SCRATCH) == kNew);
    }
}

TEST_CASE("another device, another version") {
    hdl::DriverRig rig;
    // A read: address, index, START, address, then ID and VERSION, high bytes first.
    constexpr uint64_t data = fall(2, 0) + fall(1, 0);
    fpga_bridge other;
    const auto open_misread = [&](unsigned bit) {
        rig.bus.misread([bit](uint64_t n) { return n == data + 9 * (bit / 8) + bit % 8; });
        const int error = fpga_bridge_open(&other, rig.bus.bus(), rig.bus.clock());
        rig.heal();
        return error;
    };
    for (unsigned bit = 0; bit < 24; bit++) {  // ID and the major version
        CHECK(open_misread(bit) == ERROR_DEVICE);
    }
    CHECK(open_misread(31) == ERROR_OK);  // a newer minor version
    CHECK(other.version == 0x0101);
    CHECK(open_misread(32) == ERROR_OK);  // BUILD may have any value
    CHECK(rig.world.peek(BRIDGE_SCRATCH) == kOld);
}

TEST_CASE("isolated spikes on the lines") {
    hdl::DriverRig rig;
    hdl::Random random(synthetic::test_seed());
    hdl::Spikes spikes(rig.world.bridge, synthetic::test_seed(), 2e4, 50 * hdl::kNs,
                       200 * hdl::kNs);
    const uint64_t count = hdl::draws(60);
    for (uint64_t i = 0; i < count; i++) {
        const auto value = uint16_t(random.next());
        uint16_t seen = 0;
        CHECK(fpga_bridge_write(&rig.driver, BRIDGE_SCRATCH, value) == ERROR_OK);
        CHECK(fpga_bridge_read(&rig.driver, BRIDGE_SCRATCH, &seen) == ERROR_OK);
        CHECK(seen == value);
    }
    spikes.end();
    MESSAGE(spikes.count() << " spikes; counted: " << rig.counted());
}
