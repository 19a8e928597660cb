// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends.h"

#include <fcntl.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"

/// A simulated rig that has just been started does not listen yet, or still prepares its scene. The
/// daemon serves meanwhile, and bringup waits for the rig.
static int open_sim(struct backends *self, const struct config *config, struct rig_ports *ports,
                    struct message *message) {
    const int error = sim_backend_open(&self->sim, config->backend_address, SIM_STARTING_MS);
    self->sim.connection.timeout_ms = SIM_CONNECTION_TIMEOUT_MS;
    self->awaited = error == ERROR_MISSING || error == ERROR_TIMEOUT;
    if (error != ERROR_OK && !self->awaited) {
        return message_set(message, error, "backend = sim %s: %s", config->backend_address,
                           self->sim.connection.text);
    }
    self->has_sim = true;
    *ports = sim_backend_ports(&self->sim);
    return ERROR_OK;
}

void backends_report_mismatch(struct backends *self) {
    const char *why = self->replay.last_error.text;
    if (self->has_replay && why[0] != '\0' && !self->mismatch_reported) {
        self->mismatch_reported = true;
        self->log->operations->write(self->log->self, HAL_LOG_WARNING, why);
    }
}

static void open_nothing(void *opaque, const struct rig_observer *observer) {
    (void)opaque;
    (void)observer;
}

/// After the first call that does not match all parts fail, and none of them is the cause.
static const char *why_played_part_fails(void *opaque, enum rig_part part) {
    struct backends *self = opaque;
    (void)part;
    backends_report_mismatch(self);
    if (self->replay.ran_out) {
        return "the replayed recording ends here: restart the daemon to replay it again";
    }
    if (self->replay.last_error.text[0] != '\0') {
        return "mismatch with the recording (see \"log\"): restart the daemon and give the "
               "recorded commands in order";
    }
    return NULL;
}

static int open_replay(struct backends *self, struct config *config, struct rig_ports *ports,
                       struct message *message) {
    // With calls, the instrument is the recorded one, whatever the settings say. Pairs alone can be
    // replayed for any profile of two cameras.
    const int error =
        replay_open(&self->replay, AT_FDCWD, config->backend_address, config, message);
    self->has_replay = error == ERROR_OK;
    if (error != ERROR_OK) {
        const struct message why = *message;
        return message_set(message, error, "backend = replay: %.900s", why.text);
    }
    config->restore = false;  // a recording contains the commands that restored the settings
    const bool calls = self->replay.has_calls;
    *ports = self->replay.ports;
    self->replay_devices =
        (struct rig_devices){.open = open_nothing, .missing = why_played_part_fails, .self = self};
    ports->devices = &self->replay_devices;
    const char *missing = rig_ports_missing(&config->profile, ports);
    if (missing != NULL && calls) {
        return message_set(
            message, ERROR_ARGUMENT,
            "backend = replay %s: the recording does not contain %s, which its profile "
            "requires",
            config->backend_address, missing);
    }
    if (missing != NULL) {
        return message_set(message, ERROR_ARGUMENT,
                           "backend = replay %s: pairs without recorded calls replay as two "
                           "cameras only (set profile = two-cameras, rig.trigger = no, and "
                           "rig.width and rig.height to the size of its frames)",
                           config->backend_address);
    }
    return ERROR_OK;
}

/// Wraps the ports in a test's faults.
static int wrap_faults(struct backends *self, const char *script, struct rig_ports *ports,
                       struct message *message) {
    if (script[0] == '\0') {
        return ERROR_OK;
    }
    const int error = fault_plan_parse(&self->plan, script, message);
    if (error != ERROR_OK) {
        return error;
    }
    self->faults_clock = ports->clock;
    struct fault_common common = {.plan = &self->plan, .clock = ports->clock};
    if (ports->i2c != NULL) {
        common.part = "i2c";
        fault_i2c_wrap(&self->fault_i2c, &common, ports->i2c);
        ports->i2c = &self->fault_i2c.hal;
    }
    if (ports->gpio != NULL) {
        common.part = "gpio";
        fault_gpio_wrap(&self->fault_gpio, &common, ports->gpio);
        ports->gpio = &self->fault_gpio.hal;
    }
    if (ports->lens_uart != NULL) {
        common.part = "uart";
        fault_uart_wrap(&self->fault_uart, &common, ports->lens_uart);
        ports->lens_uart = &self->fault_uart.hal;
    }
    const bool shared = ports->camera[RIG_LEFT] == ports->camera[RIG_RIGHT];
    for (int side = 0; side < RIG_SIDES; side++) {
        if (ports->camera[side] != NULL && (side == RIG_LEFT || !shared)) {
            common.part = rig_side_names[side];
            fault_camera_wrap(&self->fault_camera[side], &common, ports->camera[side]);
            ports->camera[side] = &self->fault_camera[side].hal;
        }
    }
    if (shared) {
        ports->camera[RIG_RIGHT] = ports->camera[RIG_LEFT];
    }
    return ERROR_OK;
}

int backends_open(struct backends *self, struct config *config, const struct hal_log *log,
                  struct rig_ports *ports, struct message *message) {
    int error = 0;
    self->log = log;
    *ports = (struct rig_ports){0};
    switch (config->backend) {
        case CONFIG_BACKEND_SIM:
            error = open_sim(self, config, ports, message);
            break;
        case CONFIG_BACKEND_REPLAY:
            error = open_replay(self, config, ports, message);
            break;
        case CONFIG_BACKEND_LINUX:
            backend_linux_open(&self->devices, config, log, ports);
            break;
    }
    if (error == ERROR_OK) {
        error = wrap_faults(self, config->faults, ports, message);
    }
    if (error != ERROR_OK) {
        return error;
    }
    INVARIANT(ports->clock != NULL);
    return ERROR_OK;
}

const struct hal_store *backends_store(struct backends *self, const struct hal_store *real) {
    if (real == NULL || self->faults_clock == NULL) {
        return real;
    }
    const struct fault_common common = {&self->plan, self->faults_clock, "store"};
    fault_store_wrap(&self->fault_store, &common, real);
    return &self->fault_store.hal;
}

const struct hal_watchdog *backends_watchdog(struct backends *self,
                                             const struct hal_watchdog *real) {
    if (real == NULL || self->faults_clock == NULL) {
        return real;
    }
    const struct fault_common common = {&self->plan, self->faults_clock, "watchdog"};
    fault_watchdog_wrap(&self->fault_watchdog, &common, real);
    return &self->fault_watchdog.hal;
}

void backends_close(struct backends *self) {
    if (self->has_sim) {
        sim_backend_close(&self->sim);
    }
    if (self->has_replay) {
        replay_close(&self->replay);
    }
    backend_linux_close(&self->devices);
}
