// SPDX-License-Identifier: Apache-2.0
#include "i2c_master.hpp"

#include <algorithm>
#include <cmath>

namespace hdl {

I2cTiming standard_timing(unsigned khz) {
    const uint64_t period = kMs / khz;
    if (khz <= 100) {
        return {period - 4000 * kNs, 4000 * kNs, 4700 * kNs, 4000 * kNs, 4000 * kNs, 4700 * kNs, 0};
    }
    if (khz <= 400) {
        return {period - 600 * kNs, 600 * kNs, 600 * kNs, 600 * kNs, 600 * kNs, 1300 * kNs, 0};
    }
    return {period - 260 * kNs, 260 * kNs, 260 * kNs, 260 * kNs, 260 * kNs, 500 * kNs, 0};
}

I2cTiming branch_timing(unsigned khz) {
    I2cTiming timing = standard_timing(khz);
    timing.high = std::max(timing.high, 700 * kNs);
    timing.start_setup = std::max(timing.start_setup, 700 * kNs);
    timing.start_hold = std::max(timing.start_hold, 800 * kNs);
    timing.stop_setup = std::max(timing.stop_setup, 700 * kNs);
    timing.low = kMs / khz - timing.high;
    return timing;
}

void I2cMaster::count() {
    if (moves_left_ == 0) {
        throw Aborted();
    }
    moves_left_--;
    moves_++;
}

void I2cMaster::scl(bool level) {
    count();
    bridge_.in.scl = level;
    bridge_.drive();
}

void I2cMaster::sda(bool level) {
    if ((bridge_.in.sda != 0) == level) {
        return;
    }
    count();
    bridge_.in.sda = level;
    bridge_.drive();
}

void I2cMaster::start() {
    if (in_transfer_) {
        wait(timing_.data_hold);
        sda(true);
        wait(timing_.low - timing_.data_hold);
        scl(true);
        wait(timing_.start_setup);
    }
    in_transfer_ = true;
    sda(false);
    wait(timing_.start_hold);
    scl(false);
}

void I2cMaster::stop() {
    wait(timing_.data_hold);
    sda(false);
    wait(timing_.low - timing_.data_hold);
    scl(true);
    wait(timing_.stop_setup);
    sda(true);
    wait(timing_.free);
    in_transfer_ = false;
}

bool I2cMaster::bit(bool level) {
    wait(timing_.data_hold);
    sda(level);
    wait(timing_.low - timing_.data_hold);
    scl(true);
    wait(timing_.high / 2);
    const bool seen = bridge_.out().sda != 0;
    wait(timing_.high - timing_.high / 2);
    scl(false);
    return seen;
}

bool I2cMaster::write_byte(uint8_t value) {
    for (int i = 7; i >= 0; i--) {
        bit((value >> i & 1) != 0);
    }
    return !bit(true);
}

uint8_t I2cMaster::read_byte(bool acknowledge) {
    unsigned value = 0;
    for (int i = 0; i < 8; i++) {
        value = value << 1 | unsigned(bit(true));
    }
    bit(!acknowledge);
    return uint8_t(value);
}

size_t I2cMaster::write(uint8_t address, const std::vector<uint8_t> &bytes, bool with_stop) {
    start();
    size_t acknowledged = 0;
    if (write_byte(uint8_t(address << 1))) {
        acknowledged++;
        for (uint8_t value : bytes) {
            if (!write_byte(value)) {
                break;
            }
            acknowledged++;
        }
    }
    if (with_stop) {
        stop();
    }
    return acknowledged;
}

std::optional<std::vector<uint8_t>> I2cMaster::read(uint8_t address, size_t count) {
    start();
    std::optional<std::vector<uint8_t>> bytes;
    if (write_byte(uint8_t(address << 1 | 1))) {
        bytes.emplace();
        for (size_t i = 0; i < count; i++) {
            bytes->push_back(read_byte(i + 1 < count));
        }
    }
    stop();
    return bytes;
}

void I2cMaster::let_go() {
    never_abort();
    in_transfer_ = false;
    bridge_.in.scl = bridge_.in.sda = 1;
    bridge_.drive();
    wait(timing_.free);
}

bool I2cMaster::clear_bus() {
    never_abort();
    for (int clocks = 0; clocks < 18; clocks++) {
        scl(false);
        sda(true);
        wait(timing_.low);
        if (bridge_.out().sda != 0) {
            // A STOP at once: each further clock could be a bit of a word that a device stores.
            sda(false);
            wait(timing_.low);
        }
        scl(true);
        wait(timing_.stop_setup);
        const bool stopping = bridge_.in.sda == 0;
        sda(true);
        wait(timing_.free);
        if (stopping && bridge_.out().sda != 0 && bridge_.out().scl != 0) {
            in_transfer_ = false;
            return true;
        }
    }
    return false;
}

bool Registers::write(uint8_t index, uint16_t value) {
    return master_.write(kAddress, {index, uint8_t(value >> 8), uint8_t(value)}) == 4;
}

std::optional<std::vector<uint16_t>> Registers::read(uint8_t index, size_t words) {
    if (master_.write(kAddress, {index}, false) != 2) {
        master_.stop();
        return std::nullopt;
    }
    const auto bytes = master_.read(kAddress, 2 * words);
    if (!bytes) {
        return std::nullopt;
    }
    std::vector<uint16_t> values;
    for (size_t i = 0; i < words; i++) {
        values.push_back(uint16_t((*bytes)[2 * i] << 8 | (*bytes)[2 * i + 1]));
    }
    return values;
}

std::optional<uint16_t> Registers::read(uint8_t index) {
    const auto values = read(index, 1);
    return values ? std::optional<uint16_t>(values->front()) : std::nullopt;
}

Spikes::Spikes(Bridge &bridge, uint64_t seed, double per_second, uint64_t longest_ps,
               uint64_t apart_ps)
    : bridge_(bridge),
      random_(seed),
      per_second_(per_second),
      longest_ps_(longest_ps),
      apart_ps_(apart_ps) {
    plan(0);
    plan(1);
}

void Spikes::plan(int line) {
    const double uniform = double(random_.next() >> 11) * 0x1p-53;
    const double gap_ps = -std::log(1 - uniform) * 1e12 / per_second_;
    const uint64_t begin = bridge_.now() + apart_ps_ + uint64_t(gap_ps);
    const uint64_t end = begin + random_.between(1 * kNs, longest_ps_);
    const auto set = [this, line](uint8_t level) {
        (line == 0 ? bridge_.in.scl_noise : bridge_.in.sda_noise) = level;
        bridge_.drive();
    };
    bridge_.at(begin, [this, set] {
        if (running_) {
            set(1);
            count_++;
        }
    });
    bridge_.at(end, [this, set, line] {
        set(0);
        if (running_) {
            plan(line);
        }
    });
}

}  // namespace hdl
