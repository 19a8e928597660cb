// SPDX-License-Identifier: Apache-2.0
/// The types of config.h.
#ifndef VERGENCE_DAEMON_SETTINGS_CONFIG_TYPES_H
#define VERGENCE_DAEMON_SETTINGS_CONFIG_TYPES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "daemon/base/message.h"
#include "rig/base/profile.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    CONFIG_TEXT_BYTES = 256,
    CONFIG_NO_LINE = -1,
    CONFIG_SOCKET_BYTES = 104,  ///< size of a path with its end; Linux takes 108, less ".new"
    CONFIG_NETWORK_BYTES = 20,  ///< "255.255.255.255/32"
    CONFIG_SLOT_BYTES = 64,
    CONFIG_CLIENTS_MAX = 32,
    CONFIG_QUEUE_MAX = 64,  ///< waiting commands
    /// The system's watchdog is fed every second, but not while the instrument goes to its safe
    /// state at the end, which takes up to two.
    CONFIG_WATCHDOG_MIN_S = 4
};

enum config_backend { CONFIG_BACKEND_SIM, CONFIG_BACKEND_LINUX, CONFIG_BACKEND_REPLAY };

/// A text that is not set is "".
struct config {
    struct rig_profile profile;
    char like[sizeof((struct rig_profile *)0)->name];  ///< the built-in profile that it starts from
    char profile_file[CONFIG_TEXT_BYTES];              ///< the key `profile`; "": built in

    enum config_backend backend;
    char backend_address[CONFIG_TEXT_BYTES];  ///< address of the simulated rig, or directory
    char i2c[CONFIG_TEXT_BYTES];              ///< devices of the Linux backends
    char camera[RIG_SIDES][CONFIG_TEXT_BYTES];
    char lens_uart[CONFIG_TEXT_BYTES];
    char gpio_chip[CONFIG_TEXT_BYTES];
    /// Line numbers of `gpio_chip`, or CONFIG_NO_LINE.
    int32_t reset_line, irq_line, lens_power_line, trigger_line;
    bool reset_active_low, irq_active_low, lens_power_active_low, trigger_active_low;

    char socket[CONFIG_SOCKET_BYTES];
    uint16_t tcp_port;                       ///< 0: off
    char tcp_network[CONFIG_NETWORK_BYTES];  ///< allowed clients, "192.0.2.0/24"; "": this machine
    char tcp_token[CONFIG_TEXT_BYTES];       ///< file; "": the default one of daemon/files/token.h
    char console[CONFIG_TEXT_BYTES];         ///< a terminal's device, or "stdio"
    uint32_t console_baud;
    uint32_t clients, queue;
    uint32_t reader_timeout_s;

    char files[CONFIG_TEXT_BYTES], store[CONFIG_TEXT_BYTES];
    uint32_t files_limit_mb;  ///< 0: none
    bool restore;
    char board[CONFIG_SLOT_BYTES];  ///< board that an image must be made for
    char image_slot[CONFIG_SLOT_BYTES], image_slot_2[CONFIG_SLOT_BYTES];  ///< names of partitions
    char log_file[CONFIG_TEXT_BYTES];
    int log_level;                     ///< enum hal_log_level
    char watchdog[CONFIG_TEXT_BYTES];  ///< device
    uint32_t watchdog_s;               ///< CONFIG_WATCHDOG_MIN_S or more
    uint32_t stuck_s;
    bool confine;
    char faults[CONFIG_TEXT_BYTES];  ///< script of fault_plan.h
};

/// Lines in the notation of older versions.
struct config_old_lines {
    FILE *report;  ///< gets a line for each, with the current notation; NULL: none
    unsigned count;
};

/// The key that selects a profile; it sets all keys of the instrument.
#define CONFIG_PROFILE_KEY "profile"

#ifdef __cplusplus
}
#endif

#endif
