// SPDX-License-Identifier: Apache-2.0
/// The daemon's settings: lines `key = value`, `#` begins a comment. One table has all keys with
/// types, ranges, units, defaults and help; the reader, `--help-config` and the example file derive
/// from it.
#ifndef VERGENCE_DAEMON_SETTINGS_CONFIG_H
#define VERGENCE_DAEMON_SETTINGS_CONFIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "daemon/base/message.h"
#include "rig/profile.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    CONFIG_TEXT_BYTES = 256,
    CONFIG_NO_LINE = -1,
    CONFIG_SOCKET_BYTES = 104,  ///< of a socket's path, with its end; Linux takes 108, less ".new"
    CONFIG_CLIENTS_MAX = 32,
    CONFIG_QUEUE_MAX = 64,  ///< commands that wait
    /// The system's watchdog is fed each second, and not while the instrument is made safe at the
    /// end, which takes up to two.
    CONFIG_WATCHDOG_LEAST_S = 4
};

enum config_backend { CONFIG_BACKEND_SIM, CONFIG_BACKEND_LINUX, CONFIG_BACKEND_REPLAY };

/// Texts are "" where there is none.
struct config {
    struct rig_profile profile;
    struct rig_profile base;  ///< as `profile` set it, before keys of its own changed it
    char like[sizeof((struct rig_profile *)0)->name];  ///< the built-in one that it began with
    char profile_file[CONFIG_TEXT_BYTES];              ///< where `base` stands; "": it is built in

    enum config_backend backend;
    char backend_place[CONFIG_TEXT_BYTES];  ///< address of the simulated rig, or directory
    char i2c[CONFIG_TEXT_BYTES];            ///< devices of the Linux backends
    char camera[RIG_SIDES][CONFIG_TEXT_BYTES];
    char lens_uart[CONFIG_TEXT_BYTES];
    char gpio_chip[CONFIG_TEXT_BYTES];
    int32_t reset_line, irq_line, lens_power_line, trigger_line;  ///< of that chip; CONFIG_NO_LINE
    bool reset_active_low, irq_active_low, lens_power_active_low, trigger_active_low;

    char socket[CONFIG_SOCKET_BYTES];
    uint16_t tcp_port;                  ///< 0: none
    char tcp_token[CONFIG_TEXT_BYTES];  ///< file; "": the default one of daemon/files/token.h
    char console[CONFIG_TEXT_BYTES];    ///< a terminal's device, or "stdio"
    uint32_t console_baud;
    uint32_t clients, queue;
    uint32_t reader_timeout_s;

    char files[CONFIG_TEXT_BYTES], store[CONFIG_TEXT_BYTES];
    bool restore;
    char log_file[CONFIG_TEXT_BYTES];
    int log_level;                     ///< enum hal_log_level
    char watchdog[CONFIG_TEXT_BYTES];  ///< device
    uint32_t watchdog_s;               ///< CONFIG_WATCHDOG_LEAST_S or more
    uint32_t stuck_s;
    bool confine;
    char faults[CONFIG_TEXT_BYTES];  ///< script of fault_plan.h
};

/// What every key has before a file says otherwise.
void config_defaults(struct config *config);

/// Sets all keys anew from a file (NULL: none is read) and from `count` words KEY=VALUE of a
/// command line. A word stands for the file's line with its key, or for one more: whatever else the
/// file sets stays, also what a profile would set. Among themselves the words follow the rules of
/// lines. 0; ERROR_IO, ERROR_SYNTAX, ERROR_RANGE, ERROR_MISSING, ERROR_DUPLICATE or ERROR_ARGUMENT
/// with a message, which begins with FILE:LINE where a line is wrong.
int config_load(struct config *config, const char *path, const char *const *words, int count,
                struct message *message);

/// Reads the `length` bytes of a file's text over what is there; `name` stands for it in messages,
/// which are as of config_load. Opens no file: `profile` is a built-in one here.
int config_parse(struct config *config, const char *name, const char *text, size_t length,
                 struct message *message);

/// Sets one key as a line `key = value` of a file does, but opens none: `profile` is a built-in one
/// here. 0, or an error with a message that does not say where the line was.
int config_set(struct config *config, const char *key, const char *value, struct message *message);

/// Takes over the profile that another one was set to by `profile`, without what its own keys
/// changed.
void config_take_profile(struct config *config, const struct config *from);

/// Whether what is set makes sense together: a profile, and the devices that it needs. 0, or an
/// error with a message that names the key.
int config_check(const struct config *config, struct message *message);

/// The key whose value is a profile; it sets all of the instrument.
#define CONFIG_PROFILE_KEY "profile"

/// Number of keys; name of one; whether it is of the instrument, and a profile sets it; its value
/// as the file would say it, in `text` (CONFIG_TEXT_BYTES + 16).
size_t config_key_count(void);
const char *config_key_name(size_t index);
bool config_key_is_of_rig(size_t index);
void config_key_print(const struct config *config, size_t index, char *text, size_t bytes);

/// What `--help-config` prints, which is also a file of all defaults, each explained.
void config_help_print(FILE *file);

#ifdef __cplusplus
}
#endif

#endif
