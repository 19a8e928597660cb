// SPDX-License-Identifier: Apache-2.0
#include "daemon/backend_linux.h"

#include <stdio.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/linux/monotonic_clock.h"

// ---- opening each device: 0 if it is open now, else an error with a message

static int open_i2c(struct backend_linux *self, struct message *message) {
    if (i2c_dev_is_current(&self->i2c, self->config->i2c)) {
        return ERROR_OK;
    }
    i2c_dev_close(&self->i2c);
    return i2c_dev_open(&self->i2c, self->config->i2c, message);
}

static int open_uart(struct backend_linux *self, struct message *message) {
    if (termios_uart_is_current(&self->uart, self->config->lens_uart)) {
        return ERROR_OK;
    }
    termios_uart_close(&self->uart);
    return termios_uart_open(&self->uart, self->config->lens_uart,
                             self->config->profile.lens.bits_per_s, message);
}

static int open_gpio(struct backend_linux *self, struct message *message) {
    if (gpiod_lines_are_current(&self->lines, self->locations)) {
        return ERROR_OK;
    }
    gpiod_lines_close(&self->lines);
    return gpiod_lines_open(&self->lines, self->locations, message);
}

static int open_device(struct backend_linux *self, enum backend_linux_device device,
                       struct message *message) {
    switch (device) {
        case BACKEND_LINUX_I2C:
            return open_i2c(self, message);
        case BACKEND_LINUX_LEFT_CAMERA:
        case BACKEND_LINUX_RIGHT_CAMERA:
            return v4l2_camera_renew(&self->camera[device - BACKEND_LINUX_LEFT_CAMERA], message);
        case BACKEND_LINUX_LENS_UART:
            return open_uart(self, message);
        default:
            return open_gpio(self, message);
    }
}

/// Prefixes the setting: "left_camera = /dev/video0: No such file or directory; ...", followed by
/// the backend's message from the device's path on.
static void name_setting(const struct backend_linux *self, enum backend_linux_device device,
                         struct message *message) {
    const struct config *config = self->config;
    const struct {
        const char *key, *value;
    } settings[BACKEND_LINUX_DEVICES] = {
        [BACKEND_LINUX_I2C] = {"i2c", config->i2c},
        [BACKEND_LINUX_LEFT_CAMERA] = {"left_camera", config->camera[RIG_LEFT]},
        [BACKEND_LINUX_RIGHT_CAMERA] = {"right_camera", config->camera[RIG_RIGHT]},
        [BACKEND_LINUX_LENS_UART] = {"lens_uart", config->lens_uart},
        [BACKEND_LINUX_GPIO] = {"gpio_chip", config->gpio_chip},
    };
    const struct message reason = *message;
    const char *at =
        device == BACKEND_LINUX_GPIO ? NULL : strstr(reason.text, settings[device].value);
    message_set(message, 0, "%s = %s%s%s", settings[device].key, at != NULL ? at : "",
                at != NULL ? "" : settings[device].value, at != NULL ? "" : ": ");
    if (at == NULL) {
        const size_t used = strlen(message->text);
        snprintf(message->text + used, sizeof message->text - used, "%s", reason.text);
    }
}

static void open_all(void *opaque, const struct rig_observer *observer) {
    struct backend_linux *self = opaque;
    (void)observer;
    for (int i = 0; i < BACKEND_LINUX_DEVICES; i++) {
        const enum backend_linux_device device = (enum backend_linux_device)i;
        struct message *missing = &self->missing[i];
        missing->text[0] = '\0';
        if (self->needed[i] && open_device(self, device, missing) != ERROR_OK) {
            name_setting(self, device, missing);
        } else {
            missing->text[0] = '\0';
        }
    }
}

/// "left_camera = /dev/video0: in use by another program; ..."; NULL: the camera starts.
static const char *refused(struct backend_linux *self, enum backend_linux_device device) {
    const bool right = device == BACKEND_LINUX_RIGHT_CAMERA;
    const struct v4l2_camera *camera = &self->camera[right ? RIG_RIGHT : RIG_LEFT];
    if (camera->refused.text[0] == '\0') {
        return NULL;
    }
    message_set(&self->refused, 0, "%s = %s: %.400s", right ? "right_camera" : "left_camera",
                camera->path, camera->refused.text);
    return self->refused.text;
}

/// The device that a part of the rig depends on. Both sensors of a bridge share the left camera's.
static enum backend_linux_device device_of(enum rig_part part, const struct rig_profile *profile) {
    switch (part) {
        case RIG_PART_LEFT_CAMERA:
            return BACKEND_LINUX_LEFT_CAMERA;
        case RIG_PART_RIGHT_CAMERA:
            return profile->bridge ? BACKEND_LINUX_LEFT_CAMERA : BACKEND_LINUX_RIGHT_CAMERA;
        case RIG_PART_LEFT_LENS:
        case RIG_PART_RIGHT_LENS:
            return rig_needs_lens_uart(profile) ? BACKEND_LINUX_LENS_UART : BACKEND_LINUX_I2C;
        case RIG_PART_RESET_LINE:
        case RIG_PART_IRQ_LINE:
        case RIG_PART_TRIGGER_LINE:
            return BACKEND_LINUX_GPIO;
        default:
            return BACKEND_LINUX_I2C;
    }
}

static const char *missing(void *opaque, enum rig_part part) {
    struct backend_linux *self = opaque;
    const enum backend_linux_device device = device_of(part, &self->config->profile);
    const char *text = self->missing[device].text;
    if (text[0] == '\0' && (part == RIG_PART_LEFT_LENS || part == RIG_PART_RIGHT_LENS)) {
        // A GPIO line may switch the controller's power.
        text = self->missing[BACKEND_LINUX_GPIO].text;
    }
    if (text[0] != '\0') {
        return text;
    }
    const bool camera = device == BACKEND_LINUX_LEFT_CAMERA || device == BACKEND_LINUX_RIGHT_CAMERA;
    return camera ? refused(self, device) : NULL;
}

/// Its name and its USB port: the port distinguishes two cameras of a kind.
static const char *identity(void *opaque, enum rig_part part) {
    struct backend_linux *self = opaque;
    // Both sensors of a bridge share one device.
    if (self->config->profile.bridge ||
        (part != RIG_PART_LEFT_CAMERA && part != RIG_PART_RIGHT_CAMERA)) {
        return NULL;
    }
    const struct v4l2_stream *stream =
        &self->camera[part == RIG_PART_RIGHT_CAMERA ? RIG_RIGHT : RIG_LEFT].stream;
    if (stream->fd < 0 || stream->bus[0] == '\0') {
        return NULL;
    }
    message_set(&self->identity, 0, "%.30s at %.28s", stream->card, stream->bus);
    return self->identity.text;
}

/// Finds the locations of the lines; whether there is any.
static bool find_places(struct backend_linux *self) {
    const struct config *config = self->config;
    const struct {
        int32_t line;
        bool low;
    } lines[HAL_GPIO_LINES] = {
        [HAL_GPIO_BRIDGE_RESET] = {config->reset_line, config->reset_active_low},
        [HAL_GPIO_BRIDGE_IRQ] = {config->irq_line, config->irq_active_low},
        [HAL_GPIO_LENS_POWER] = {config->lens_power_line, config->lens_power_active_low},
        [HAL_GPIO_TRIGGER] = {config->trigger_line, config->trigger_active_low},
    };
    bool any = false;
    for (int i = 0; i < HAL_GPIO_LINES; i++) {
        if (lines[i].line != CONFIG_NO_LINE) {
            any = true;
            self->locations[i] =
                (struct gpiod_line_location){.chip = config->gpio_chip,
                                             .offset = (unsigned)lines[i].line,
                                             .active_low = lines[i].low,
                                             .active_at_start = i == HAL_GPIO_LENS_POWER};
        }
    }
    return any;
}

void backend_linux_open(struct backend_linux *self, const struct config *config,
                        const struct hal_log *log, struct rig_ports *ports) {
    const struct rig_profile *profile = &config->profile;
    *self = (struct backend_linux){
        .config = config,
        .devices = {.open = open_all, .missing = missing, .identity = identity, .self = self}};
    self->needed[BACKEND_LINUX_I2C] = rig_needs_i2c(profile);
    self->needed[BACKEND_LINUX_LEFT_CAMERA] = true;
    self->needed[BACKEND_LINUX_RIGHT_CAMERA] = !profile->bridge;
    self->needed[BACKEND_LINUX_LENS_UART] = rig_needs_lens_uart(profile);
    self->needed[BACKEND_LINUX_GPIO] = find_places(self);
    i2c_dev_init(&self->i2c);
    termios_uart_init(&self->uart);
    gpiod_lines_init(&self->lines);
    for (int side = 0; side < RIG_SIDES; side++) {
        v4l2_camera_init(&self->camera[side], config->camera[side], profile->frame_us, log);
        self->camera[side].triggered = profile->trigger;
    }
    ports->clock = &monotonic_clock;
    ports->i2c = rig_needs_i2c(profile) ? &self->i2c.hal : NULL;
    ports->camera[RIG_LEFT] = &self->camera[RIG_LEFT].hal;
    ports->camera[RIG_RIGHT] = &self->camera[profile->bridge ? RIG_LEFT : RIG_RIGHT].hal;
    ports->lens_uart = rig_needs_lens_uart(profile) ? &self->uart.hal : NULL;
    ports->gpio = self->needed[BACKEND_LINUX_GPIO] ? &self->lines.hal : NULL;
    ports->devices = &self->devices;
    open_all(self, NULL);
    for (int i = 0; i < BACKEND_LINUX_DEVICES; i++) {
        if (self->missing[i].text[0] != '\0') {
            log->operations->write(log->self, HAL_LOG_WARNING, self->missing[i].text);
        }
    }
}

const struct v4l2_camera *backend_linux_camera(const struct backend_linux *self, int side) {
    return self->needed[BACKEND_LINUX_LEFT_CAMERA + side] ? &self->camera[side] : NULL;
}

void backend_linux_close(struct backend_linux *self) {
    if (self->config == NULL) {
        return;
    }
    for (int side = 0; side < RIG_SIDES; side++) {
        v4l2_camera_close(&self->camera[side]);
    }
    termios_uart_close(&self->uart);
    gpiod_lines_close(&self->lines);
    i2c_dev_close(&self->i2c);
    self->config = NULL;
}
