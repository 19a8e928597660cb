// SPDX-License-Identifier: Apache-2.0
#include "driver_bus.hpp"

#include <algorithm>

#include "core/error.h"

namespace hdl {

namespace {

constexpr unsigned kBoth = HAL_I2C_SCL | HAL_I2C_SDA;
// Time after which the filters, the bridge and a sensor have responded to the last change.
constexpr uint64_t kSettled = 2 * kUs;
// Switching to and from the slow clock takes up to a microsecond each.
constexpr uint64_t kShortestIdle = 20 * kUs, kLeaveIdle = 3 * kUs;

}  // namespace

DriverBus::DriverBus(Bridge &bridge, const I2cTiming &timing)
    : bridge_(bridge), timing_(timing), bus_{&operations_, this}, clock_{&clock_operations_, this} {
    own_ = (bridge.in.scl == 0 ? unsigned(HAL_I2C_SCL) : 0) |
           (bridge.in.sda == 0 ? unsigned(HAL_I2C_SDA) : 0);
}

void DriverBus::hide_lines() {
    operations_.lines = nullptr;
}

void DriverBus::others_pull(unsigned lines, uint64_t duration_ps) {
    released_ps_ = lines == 0 && others_ != 0 ? bridge_.now() : released_ps_;
    others_ = lines;
    release_ps_ = duration_ps == UINT64_MAX ? UINT64_MAX : bridge_.now() + duration_ps;
    drive();
}

void DriverBus::pass_until(uint64_t end_ps) {
    while (bridge_.now() < end_ps) {
        const uint64_t next_ps = std::min(end_ps, release_ps_);
        const uint64_t settled_ps = moved_ps_ + kSettled;
        if (next_ps > settled_ps + kShortestIdle && next_ps > bridge_.now() + kShortestIdle) {
            bridge_.run(settled_ps > bridge_.now() ? settled_ps - bridge_.now() : 0);
            bridge_.run_idle(next_ps - kLeaveIdle - bridge_.now());
        }
        bridge_.run(next_ps - bridge_.now());
        if (bridge_.now() >= release_ps_) {
            others_pull(0);
        }
    }
}

void DriverBus::drive() {
    bridge_.in.scl = ((own_ | others_) & HAL_I2C_SCL) == 0;
    bridge_.in.sda = ((own_ | others_) & HAL_I2C_SDA) == 0;
    bridge_.drive();
    bridge_model_advance(bridge_.model(), 0);  // makes the wires readable at once
    moved_ps_ = bridge_.now();
}

void DriverBus::pull(unsigned lines) {
    if (lines != own_) {
        own_ = lines;
        drive();
    }
}

bool DriverBus::high(unsigned line) const {
    const bridge_outputs &out = bridge_.out();
    return (line == HAL_I2C_SCL ? out.scl : out.sda) != 0;
}

void DriverBus::fall() {
    pull(own_ | HAL_I2C_SCL);
    falls_++;
    if (hook_) {
        hook_(falls_);
    }
}

// Releases SCL and waits while another device stretches it.
void DriverBus::rise() {
    pull(own_ & ~unsigned(HAL_I2C_SCL));
    while (!high(HAL_I2C_SCL)) {
        if (bridge_.now() >= deadline_ps_) {
            throw Failure{ERROR_TIMEOUT};
        }
        wait(release_ps_ > bridge_.now() && others_ != 0
                 ? std::min(release_ps_, deadline_ps_) - bridge_.now()
                 : 100 * kNs);
    }
}

bool DriverBus::bit(bool level, bool own) {
    wait(timing_.data_hold);
    pull(HAL_I2C_SCL | (level ? 0 : unsigned(HAL_I2C_SDA)));
    wait(timing_.low - timing_.data_hold);
    rise();
    wait(timing_.high / 2);
    const bool seen = high(HAL_I2C_SDA) != (wrong_ && wrong_(falls_));
    if (own && level && !seen) {
        throw Failure{ERROR_I2C_ARBITRATION};
    }
    wait(timing_.high - timing_.high / 2);
    if (bridge_.now() >= deadline_ps_) {
        throw Failure{ERROR_TIMEOUT};
    }
    fall();
    return seen;
}

void DriverBus::start(bool repeated) {
    if (repeated) {
        wait(timing_.data_hold);
        pull(HAL_I2C_SCL);
        wait(timing_.low - timing_.data_hold);
        rise();
        wait(timing_.start_setup);
        if (!high(HAL_I2C_SDA)) {
            throw Failure{ERROR_I2C_ARBITRATION};
        }
    } else if (!high(HAL_I2C_SCL) || !high(HAL_I2C_SDA)) {
        throw Failure{ERROR_I2C_STUCK};
    }
    pull(HAL_I2C_SDA);
    wait(timing_.start_hold);
    fall();
}

void DriverBus::stop() {
    wait(timing_.data_hold);
    pull(kBoth);
    wait(timing_.low - timing_.data_hold);
    rise();
    wait(timing_.stop_setup);
    pull(0);
    wait(timing_.free);
    if (!high(HAL_I2C_SDA)) {
        throw Failure{ERROR_I2C_STUCK};
    }
}

bool DriverBus::write_byte(uint8_t value, size_t &begun) {
    begun++;
    for (int i = 7; i >= 0; i--) {
        bit((value >> i & 1) != 0, true);
    }
    return !bit(true, false);
}

uint8_t DriverBus::read_byte(bool acknowledge, size_t &begun) {
    begun++;
    unsigned value = 0;
    for (int i = 0; i < 8; i++) {
        value = value << 1 | unsigned(bit(true, false));
    }
    bit(!acknowledge, true);
    return uint8_t(value);
}

void DriverBus::message(const hal_i2c_message &message, size_t &begun) {
    if (!write_byte(uint8_t(message.address << 1 | (message.read ? 1 : 0)), begun)) {
        throw Failure{ERROR_I2C_NACK};
    }
    for (size_t i = 0; i < message.bytes; i++) {
        if (message.read) {
            message.data[i] = read_byte(i + 1 < message.bytes, begun);
        } else if (!write_byte(message.data[i], begun)) {
            throw Failure{ERROR_I2C_NACK};
        }
    }
}

int DriverBus::run(const hal_i2c_message *messages, size_t count, size_t &begun) {
    try {
        try {
            for (size_t i = 0; i < count; i++) {
                start(i > 0);
                message(messages[i], begun);
            }
        } catch (const Failure &failure) {
            if (failure.error != ERROR_I2C_NACK) {
                throw;
            }
            stop();
            return failure.error;
        }
        stop();
        return ERROR_OK;
    } catch (const Failure &failure) {
        pull(0);
        return failure.error;
    }
}

int DriverBus::transfer(void *self, const hal_i2c_message *messages, size_t count,
                        uint64_t deadline_us, size_t *begun) {
    auto *bus = static_cast<DriverBus *>(self);
    bus->deadline_ps_ = deadline_us * kUs;
    bus->transfers_++;
    bus->falls_ = 0;
    *begun = 0;
    return bus->run(messages, count, *begun);
}

int DriverBus::lines(void *self, unsigned pulled, unsigned *high) {
    auto *bus = static_cast<DriverBus *>(self);
    if ((pulled & ~bus->own_ & HAL_I2C_SCL) != 0 && bus->high(HAL_I2C_SCL)) {
        bus->recovery_falls_++;
    } else if (bus->others_ != 0 && bus->recovery_falls_ >= bus->release_after_) {
        bus->others_pull(0);
    }
    bus->pull(pulled);
    *high = (bus->high(HAL_I2C_SCL) ? unsigned(HAL_I2C_SCL) : 0) |
            (bus->high(HAL_I2C_SDA) ? unsigned(HAL_I2C_SDA) : 0);
    return ERROR_OK;
}

uint64_t DriverBus::now_us(void *self) {
    return static_cast<DriverBus *>(self)->bridge_.now() / kUs;
}

void DriverBus::wait_until_us(void *self, uint64_t time_us) {
    static_cast<DriverBus *>(self)->pass_until(time_us * kUs);
}

}  // namespace hdl
