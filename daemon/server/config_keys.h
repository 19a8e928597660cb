// SPDX-License-Identifier: Apache-2.0
/// The one table of settings.
#ifndef VERGENCE_DAEMON_SERVER_CONFIG_KEYS_H
#define VERGENCE_DAEMON_SERVER_CONFIG_KEYS_H

#include <stddef.h>
#include <stdint.h>

#include "daemon/server/config.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { CONFIG_KEYS_MAX = 128 };  ///< more than there are

enum config_kind {
    CONFIG_PROFILE,  ///< a name of rig_profile_named; sets all keys that begin with "rig."
    CONFIG_BACKEND,  ///< "linux", "sim ADDRESS", "replay DIRECTORY"
    CONFIG_TEXT,     ///< `bytes` of it, CONFIG_TEXT_BYTES at most; "none" is ""
    CONFIG_LENSES,   ///< a word of `choices`, in the order of enum rig_profile_lenses
    CONFIG_CHOICE,   ///< a word of `choices`; its place into an int, or as `bytes` says
    CONFIG_NUMBER,   ///< a whole number of `bytes` bytes; signed when `least` < 0
};

struct config_key {
    const char *name;
    enum config_kind kind;
    size_t offset;  ///< in struct config
    size_t bytes;
    double least, most;
    const char *unit;
    const char *choices;
    const char *none;  ///< the word for `least`, such as "off"; NULL: none
    const char *sets;  ///< keys that begin so get new values with this one; NULL: none
    const char *help;
};

/// All keys, in the order in which people read them; `*count` of them.
const struct config_key *config_keys(size_t *count);

#ifdef __cplusplus
}
#endif

#endif
