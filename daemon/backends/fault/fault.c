// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/fault/fault.h"

#include "core/error.h"
#include "core/invariant.h"

static struct fault_plan_effect next_effect(const struct fault_common *common,
                                            const char *operation) {
    return fault_plan_next(common->plan, common->part, operation);
}

/// Whether the call fails without being made.
static bool fails_before(const struct fault_plan_effect *effect) {
    return effect->error != ERROR_OK && !effect->after;
}

/// Injects the error of a call with a deadline.
static int fail_by(const struct fault_common *common, int error, uint64_t deadline_us) {
    if (error == ERROR_TIMEOUT) {
        common->clock->operations->wait_until_us(common->clock->self, deadline_us);
    }
    return error;
}

/// The result of a call that was made.
static int result_of(const struct fault_plan_effect *effect, int error) {
    return error == ERROR_OK ? effect->error : error;
}

/// Inverts every bit, so that no check can miss it by chance.
static void garble(void *data, size_t bytes) {
    unsigned char *byte = data;
    for (size_t i = 0; i < bytes; i++) {
        byte[i] = (unsigned char)~byte[i];
    }
}

static int i2c_transfer(void *opaque, const struct hal_i2c_message *messages, size_t count,
                        uint64_t deadline_us, size_t *begun) {
    const struct fault_i2c *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "transfer");
    if (fails_before(&effect)) {
        const bool addressed =
            effect.error == ERROR_I2C_NACK || effect.error == ERROR_I2C_ARBITRATION;
        *begun = addressed ? 1 : 0;
        return fail_by(&self->common, effect.error, deadline_us);
    }
    const int error =
        self->real->operations->transfer(self->real->self, messages, count, deadline_us, begun);
    for (size_t i = 0; effect.corrupt && error == ERROR_OK && i < count; i++) {
        if (messages[i].read) {
            garble(messages[i].data, messages[i].bytes);
        }
    }
    return result_of(&effect, error);
}

static int i2c_lines(void *opaque, unsigned pulled, unsigned *high) {
    const struct fault_i2c *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "lines");
    return fails_before(&effect)
               ? effect.error
               : result_of(&effect, self->real->operations->lines(self->real->self, pulled, high));
}

void fault_i2c_wrap(struct fault_i2c *self, const struct fault_common *common,
                    const struct hal_i2c *real) {
    INVARIANT(common->plan != NULL && common->clock != NULL && common->part != NULL);
    *self = (struct fault_i2c){.common = *common, .real = real};
    self->operations.transfer = i2c_transfer;
    self->operations.lines = real->operations->lines == NULL ? NULL : i2c_lines;
    self->hal = (struct hal_i2c){&self->operations, self};
}

static int camera_start(void *opaque, const struct hal_camera_format *format) {
    const struct fault_camera *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "start");
    return fails_before(&effect)
               ? effect.error
               : result_of(&effect, self->real->operations->start(self->real->self, format));
}

/// Stops the stream in any case: an error models a camera that is gone.
static int camera_stop(void *opaque) {
    const struct fault_camera *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "stop");
    return result_of(&effect, self->real->operations->stop(self->real->self));
}

static int camera_take(void *opaque, uint64_t not_before_us, uint64_t deadline_us,
                       struct hal_camera_frame *frame) {
    const struct fault_camera *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "take");
    if (fails_before(&effect)) {
        return fail_by(&self->common, effect.error, deadline_us);
    }
    struct hal_camera_frame got;
    const int error =
        self->real->operations->take(self->real->self, not_before_us, deadline_us, &got);
    if (error == ERROR_OK && effect.error != ERROR_OK) {
        // The caller never gets the frame.
        raw_image_release(&got.image);
        return effect.error;
    }
    if (error == ERROR_OK) {
        got.faults |= effect.corrupt ? HAL_CAMERA_DAMAGED : 0;
        *frame = got;
    }
    return error;
}

static int camera_control(void *opaque, enum hal_camera_control control, int32_t value,
                          int32_t *applied) {
    const struct fault_camera *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "control");
    return fails_before(&effect)
               ? effect.error
               : result_of(&effect, self->real->operations->control(self->real->self, control,
                                                                    value, applied));
}

static void camera_counts(void *opaque, struct hal_camera_counts *counts) {
    const struct fault_camera *self = opaque;
    self->real->operations->counts(self->real->self, counts);
}

void fault_camera_wrap(struct fault_camera *self, const struct fault_common *common,
                       const struct hal_camera *real) {
    INVARIANT(common->plan != NULL && common->clock != NULL && common->part != NULL);
    *self = (struct fault_camera){.common = *common, .real = real};
    self->operations = (struct hal_camera_operations){
        .start = camera_start,
        .stop = camera_stop,
        .take = camera_take,
        .control = real->operations->control == NULL ? NULL : camera_control,
        .counts = camera_counts};
    self->hal = (struct hal_camera){&self->operations, self};
}

static int gpio_set(void *opaque, enum hal_gpio_line line, bool active) {
    const struct fault_gpio *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "set");
    return fails_before(&effect)
               ? effect.error
               : result_of(&effect, self->real->operations->set(self->real->self, line, active));
}

static int gpio_get(void *opaque, enum hal_gpio_line line, bool *active) {
    const struct fault_gpio *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "get");
    if (fails_before(&effect)) {
        return effect.error;
    }
    bool level = false;
    const int error = self->real->operations->get(self->real->self, line, &level);
    if (error == ERROR_OK && effect.error == ERROR_OK) {
        *active = level != effect.corrupt;
    }
    return result_of(&effect, error);
}

void fault_gpio_wrap(struct fault_gpio *self, const struct fault_common *common,
                     const struct hal_gpio *real) {
    static const struct hal_gpio_operations operations = {gpio_set, gpio_get};
    INVARIANT(common->plan != NULL && common->clock != NULL && common->part != NULL);
    *self = (struct fault_gpio){{&operations, self}, *common, real};
}

static int uart_write(void *opaque, const void *data, size_t bytes, uint64_t deadline_us) {
    const struct fault_uart *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "write");
    return fails_before(&effect)
               ? fail_by(&self->common, effect.error, deadline_us)
               : result_of(&effect, self->real->operations->write(self->real->self, data, bytes,
                                                                  deadline_us));
}

static int uart_read(void *opaque, void *data, size_t capacity, uint64_t deadline_us,
                     size_t *bytes) {
    const struct fault_uart *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "read");
    if (fails_before(&effect)) {
        return fail_by(&self->common, effect.error, deadline_us);
    }
    size_t got = 0;
    const int error =
        self->real->operations->read(self->real->self, data, capacity, deadline_us, &got);
    if (error == ERROR_OK && effect.corrupt) {
        garble(data, got);
    }
    if (error == ERROR_OK && effect.error == ERROR_OK) {
        *bytes = got;
    }
    return result_of(&effect, error);
}

static int uart_discard(void *opaque) {
    const struct fault_uart *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "discard");
    return fails_before(&effect)
               ? effect.error
               : result_of(&effect, self->real->operations->discard(self->real->self));
}

void fault_uart_wrap(struct fault_uart *self, const struct fault_common *common,
                     const struct hal_uart *real) {
    static const struct hal_uart_operations operations = {uart_write, uart_read, uart_discard};
    INVARIANT(common->plan != NULL && common->clock != NULL && common->part != NULL);
    *self = (struct fault_uart){{&operations, self}, *common, real};
}

static int store_load(void *opaque, const char *name, void *data, size_t capacity, size_t *bytes) {
    const struct fault_store *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "load");
    if (fails_before(&effect)) {
        return effect.error;
    }
    size_t got = 0;
    const int error = self->real->operations->load(self->real->self, name, data, capacity, &got);
    if (error == ERROR_OK && effect.error == ERROR_OK) {
        *bytes = got;
    }
    return result_of(&effect, error);
}

static int store_save(void *opaque, const char *name, const void *data, size_t bytes) {
    const struct fault_store *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "save");
    return fails_before(&effect) ? effect.error
                                 : result_of(&effect, self->real->operations->save(
                                                          self->real->self, name, data, bytes));
}

static int store_remove(void *opaque, const char *name) {
    const struct fault_store *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "remove");
    return fails_before(&effect)
               ? effect.error
               : result_of(&effect, self->real->operations->remove(self->real->self, name));
}

void fault_store_wrap(struct fault_store *self, const struct fault_common *common,
                      const struct hal_store *real) {
    static const struct hal_store_operations operations = {store_load, store_save, store_remove};
    INVARIANT(common->plan != NULL && common->clock != NULL && common->part != NULL);
    *self = (struct fault_store){{&operations, self}, *common, real};
}

static int watchdog_feed(void *opaque) {
    const struct fault_watchdog *self = opaque;
    const struct fault_plan_effect effect = next_effect(&self->common, "feed");
    return fails_before(&effect)
               ? effect.error
               : result_of(&effect, self->real->operations->feed(self->real->self));
}

static uint64_t watchdog_period_us(void *opaque) {
    const struct fault_watchdog *self = opaque;
    return self->real->operations->period_us(self->real->self);
}

void fault_watchdog_wrap(struct fault_watchdog *self, const struct fault_common *common,
                         const struct hal_watchdog *real) {
    static const struct hal_watchdog_operations operations = {watchdog_feed, watchdog_period_us};
    INVARIANT(common->plan != NULL && common->clock != NULL && common->part != NULL);
    *self = (struct fault_watchdog){{&operations, self}, *common, real};
}
