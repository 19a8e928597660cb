// SPDX-License-Identifier: Apache-2.0
/// The daemon's settings: an INI file of lines `key = value`, where `#` starts a comment. The key
/// `rig.width` may also stand as `width` in a section `[rig]`. One table holds all keys with their
/// types, ranges, units and help; the reader, `--help-config` and the example file derive from it.
/// A profile is such a file, whose name ends in .profile, with the keys of the instrument only.
/// Keys and values in the notation of older versions are read as well.
#ifndef VERGENCE_DAEMON_SETTINGS_CONFIG_H
#define VERGENCE_DAEMON_SETTINGS_CONFIG_H

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
    CONFIG_SOCKET_BYTES = 104,  ///< of a socket's path, with its end; Linux takes 108, less ".new"
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
    int32_t reset_line, irq_line, lens_power_line, trigger_line;  ///< of that chip; CONFIG_NO_LINE
    bool reset_active_low, irq_active_low, lens_power_active_low, trigger_active_low;

    char socket[CONFIG_SOCKET_BYTES];
    uint16_t tcp_port;                       ///< 0: off
    char tcp_network[CONFIG_NETWORK_BYTES];  ///< of its clients, "192.0.2.0/24"; "": this machine
    char tcp_token[CONFIG_TEXT_BYTES];       ///< file; "": the default one of daemon/files/token.h
    char console[CONFIG_TEXT_BYTES];         ///< a terminal's device, or "stdio"
    uint32_t console_baud;
    uint32_t clients, queue;
    uint32_t reader_timeout_s;

    char files[CONFIG_TEXT_BYTES], store[CONFIG_TEXT_BYTES];
    uint32_t files_limit_mb;  ///< 0: none
    bool restore;
    char board[CONFIG_SLOT_BYTES];  ///< for which an image must be made
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

/// Sets every key to its default.
void config_defaults(struct config *config);

/// Sets all keys: from the defaults, a file (NULL: none) and `count` arguments KEY=VALUE of a
/// command line. An argument replaces the file's line of the same key. The order of lines does not
/// matter: a profile is set before what changes it. A `path` that ends in .profile is a profile, of
/// otherwise default settings. Lines in the notation of older versions are added to `old`. 0;
/// ERROR_IO, ERROR_SYNTAX, ERROR_RANGE, ERROR_MISSING, ERROR_DUPLICATE, ERROR_ARGUMENT or
/// ERROR_MEMORY with a message, which starts with FILE:LINE where a line is wrong.
int config_load(struct config *config, const char *path, const char *const *words, int count,
                struct config_old_lines *old, struct message *message);

/// The same for the `length` bytes of the text of a file `name`; opens no file: `profile` must be a
/// built-in one.
int config_parse(struct config *config, const char *name, const char *text, size_t length,
                 struct message *message);

/// Sets one key as a line `key = value` of a file does, but opens no file: `profile` must be a
/// built-in one. 0, or an error with a message without the line.
int config_set(struct config *config, const char *key, const char *value, struct message *message);

/// Parses the setting `tcp_network`: an IPv4 network of 8 to 32 bits, without bits behind them.
/// Both in the host's byte order. False: something else.
bool config_parse_network(const char *text, uint32_t *address, uint32_t *mask);

/// Whether the settings are consistent: the profile, and the devices that it needs. 0, or an error
/// with a message that names the key.
int config_check(const struct config *config, struct message *message);

/// The key that selects a profile; it sets all keys of the instrument.
#define CONFIG_PROFILE_KEY "profile"

/// Number of keys; name of a key; whether a profile sets it; its value as a file has it, in `text`
/// (CONFIG_TEXT_BYTES + 16 bytes).
size_t config_key_count(void);
const char *config_key_name(size_t index);
bool config_key_is_of_rig(size_t index);
void config_key_print(const struct config *config, size_t index, char *text, size_t bytes);

/// Prints the page of `--help-config`, which is a file of all defaults with comments.
void config_help_print(FILE *file);

/// Prints a built-in profile as a file, with comments. ERROR_ARGUMENT with a message for an unknown
/// name.
int config_profile_print(FILE *file, const char *name, struct message *message);

/// Prints the values of the key `lenses`: each lens controller with its port and its ranges.
void config_lenses_print(FILE *file);

#ifdef __cplusplus
}
#endif

#endif
