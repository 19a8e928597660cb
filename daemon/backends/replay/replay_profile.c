// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/replay/replay_profile.h"

#include <stdlib.h>
#include <string.h>

#include "core/error.h"
#include "daemon/session/session_read.h"

/// The reader's state. Large: allocated.
struct reading {
    struct session_reader session;
    struct session_event event;
    struct config config;
    char name[SESSION_NAME_MAX + 1];
};

static bool is_of_rig(const char *key) {
    for (size_t i = 0; i < config_key_count(); i++) {
        if (strcmp(key, config_key_name(i)) == 0) {
            return config_key_is_of_rig(i) || strcmp(key, CONFIG_PROFILE_KEY) == 0;
        }
    }
    return true;  // config_set reports the error
}

static int apply(struct reading *self, struct message *message) {
    char *key = self->event.text;
    char *equals = strstr(key, " = ");
    if (equals != NULL) {
        *equals = '\0';
    }
    if (equals == NULL || !is_of_rig(key)) {
        return message_set(message, ERROR_SYNTAX, "%s: \"%.200s\" is not an instrument setting",
                           self->session.path, key);
    }
    struct message why;
    const int error = config_set(&self->config, key, equals + strlen(" = "), &why);
    return error == 0 ? 0 : message_set(message, error, "%s: %.900s", self->session.path, why.text);
}

static int read_all(struct reading *self, int parent, const char *path, struct message *message) {
    struct message why;
    int error = session_reader_open(&self->session, parent, path, &self->event, message);
    if (error != 0) {
        return error;
    }
    memcpy(self->name, self->event.profile, sizeof self->name);
    config_defaults(&self->config);
    // A custom name defines nothing: the settings do.
    (void)config_set(&self->config, CONFIG_PROFILE_KEY, self->name, &why);
    int got = 1;
    while (error == 0 && (got = session_reader_next(&self->session, &self->event, message)) == 1 &&
           self->event.kind != SESSION_COMMAND && self->event.kind != SESSION_PAIR) {
        error = self->event.kind == SESSION_SETTING ? apply(self, message) : 0;
    }
    if (error != 0 || got < 0) {
        return error != 0 ? error : got;
    }
    return strcmp(self->name, self->config.profile.name) == 0
               ? 0
               : message_set(message, ERROR_MISSING,
                             "%s: recorded with the profile %s, which it does not define", path,
                             self->name);
}

int replay_profile(int parent, const char *path, struct config *config, struct message *message) {
    struct reading *self = calloc(1, sizeof *self);
    if (self == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", path);
    }
    self->session.directory = -1;
    const int error = read_all(self, parent, path, message);
    if (error == 0) {
        config->profile = self->config.profile;
        memcpy(config->like, self->config.like, sizeof config->like);
        config->profile_file[0] = '\0';
    }
    session_reader_close(&self->session);
    free(self);
    return error;
}
