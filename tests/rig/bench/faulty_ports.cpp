// SPDX-License-Identifier: Apache-2.0
#include "bench/faulty_ports.hpp"

#include "core/error.h"

namespace rig_bench {

namespace {

FaultyPorts &of(void *self) {
    return *static_cast<FaultyPorts *>(self);
}

// A call that fails with a time-out takes that time.
int next_until(void *self, Port port, uint64_t deadline_us) {
    const int error = of(self).next(port);
    if (error == ERROR_TIMEOUT) {
        const hal_clock *clock = of(self).behind().clock;
        clock->operations->wait_until_us(clock->self, deadline_us);
    }
    return error;
}

int transfer(void *self, const hal_i2c_message *messages, size_t count, uint64_t deadline_us,
             size_t *begun) {
    const int error = next_until(self, Port::kI2c, deadline_us);
    if (error == ERROR_IO) {
        // A system without details does not report how far the transfer got.
        *begun = 0;
        for (size_t i = 0; i < count; i++) {
            *begun += 1 + size_t(messages[i].bytes);
        }
        if (count == 1 && !messages[0].read) {
            of(self).fail_once_only();
        }
        return error;
    }
    if (error != ERROR_OK) {
        // Nothing reached the bus: an address that was not acknowledged.
        *begun = 1;
        return error;
    }
    const hal_i2c *bus = of(self).behind().i2c;
    return bus->operations->transfer(bus->self, messages, count, deadline_us, begun);
}

int set_line(void *self, hal_gpio_line line, bool active) {
    const int error = of(self).next(Port::kGpio);
    const hal_gpio *gpio = of(self).behind().gpio;
    return error != ERROR_OK ? error : gpio->operations->set(gpio->self, line, active);
}

int get_line(void *self, hal_gpio_line line, bool *active) {
    const int error = of(self).next(Port::kGpio);
    const hal_gpio *gpio = of(self).behind().gpio;
    return error != ERROR_OK ? error : gpio->operations->get(gpio->self, line, active);
}

int start(void *self, const hal_camera_format *format) {
    const int error = of(self).next(Port::kCamera);
    const hal_camera *camera = of(self).behind().camera[0];
    return error != ERROR_OK ? error : camera->operations->start(camera->self, format);
}

int stop(void *self) {
    const int error = of(self).next(Port::kCamera);
    const hal_camera *camera = of(self).behind().camera[0];
    return error != ERROR_OK ? error : camera->operations->stop(camera->self);
}

int take(void *self, uint64_t not_before_us, uint64_t deadline_us, hal_camera_frame *frame) {
    const int error = next_until(self, Port::kCamera, deadline_us);
    const hal_camera *camera = of(self).behind().camera[0];
    return error != ERROR_OK
               ? error
               : camera->operations->take(camera->self, not_before_us, deadline_us, frame);
}

void counts(void *self, hal_camera_counts *out) {
    const hal_camera *camera = of(self).behind().camera[0];
    camera->operations->counts(camera->self, out);
}

int write_bytes(void *self, const void *data, size_t bytes, uint64_t deadline_us) {
    const int error = next_until(self, Port::kUart, deadline_us);
    const hal_uart *uart = of(self).behind().lens_uart;
    return error != ERROR_OK ? error
                             : uart->operations->write(uart->self, data, bytes, deadline_us);
}

int read_bytes(void *self, void *data, size_t capacity, uint64_t deadline_us, size_t *bytes) {
    const int error = next_until(self, Port::kUart, deadline_us);
    const hal_uart *uart = of(self).behind().lens_uart;
    return error != ERROR_OK
               ? error
               : uart->operations->read(uart->self, data, capacity, deadline_us, bytes);
}

int discard(void *self) {
    const int error = of(self).next(Port::kUart);
    const hal_uart *uart = of(self).behind().lens_uart;
    // It has no deadline, and so no time-out.
    return error != ERROR_OK && error != ERROR_TIMEOUT ? error
                                                       : uart->operations->discard(uart->self);
}

constexpr hal_i2c_operations kI2cOperations = {transfer, nullptr};
constexpr hal_gpio_operations kGpioOperations = {set_line, get_line};
constexpr hal_camera_operations kCameraOperations = {start, stop, take, nullptr, counts};
constexpr hal_uart_operations kUartOperations = {write_bytes, read_bytes, discard};

}  // namespace

FaultyPorts::FaultyPorts(const rig_ports &behind)
    : behind_(behind),
      ports_(behind),
      i2c_{&kI2cOperations, this},
      gpio_{&kGpioOperations, this},
      camera_{&kCameraOperations, this},
      uart_{&kUartOperations, this} {
    ports_.i2c = &i2c_;
    ports_.gpio = &gpio_;
    ports_.camera[0] = ports_.camera[1] = &camera_;
    ports_.lens_uart = &uart_;
}

void FaultyPorts::fail(const Fault &fault) {
    fault_ = fault;
    failed_us_ = 0;
    failed_once_only_ = false;
    for (uint64_t &calls : calls_) {
        calls = 0;
    }
}

int FaultyPorts::next(Port port) {
    const uint64_t call = calls_[int(port)]++;
    const bool fails = fault_.error != 0 && port == fault_.port &&
                       (call == fault_.call || (call > fault_.call && fault_.for_ever));
    if (fails && failed_us_ == 0) {
        failed_us_ = behind_.clock->operations->now_us(behind_.clock->self);
    }
    return fails ? fault_.error : ERROR_OK;
}

}  // namespace rig_bench
