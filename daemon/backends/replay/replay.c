// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/replay/replay.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "core/error.h"

/// The settings of a recording, as a file of them; the caller frees it.
struct settings {
    char *text;
    size_t length;
    bool has_profile;
};

static bool add_setting(struct settings *self, const char *line) {
    const size_t more = strlen(line) + 1;
    char *text = realloc(self->text, self->length + more);
    if (text == NULL || strchr(line, '\n') != NULL) {
        self->text = text != NULL ? text : self->text;
        return false;
    }
    memcpy(text + self->length, line, more - 1);
    text[self->length + more - 1] = '\n';
    self->text = text;
    self->length += more;
    self->has_profile |= strncmp(line, CONFIG_PROFILE_KEY " ", sizeof CONFIG_PROFILE_KEY) == 0;
    return true;
}

/// Sets the instrument of `config` to the recorded one. The index describes it completely: no other
/// file is opened.
static int take_settings(const struct replay *self, struct settings *settings,
                         struct config *config, struct message *message) {
    char line[sizeof CONFIG_PROFILE_KEY + SESSION_NAME_MAX + 4];
    struct message why;
    struct config *taken = malloc(sizeof *taken);
    snprintf(line, sizeof line, CONFIG_PROFILE_KEY " = %s", self->profile);
    // Nothing is needed of the system.
    if (taken == NULL || !add_setting(settings, "backend = replay recording") ||
        (!settings->has_profile && !add_setting(settings, line))) {
        free(taken);
        return message_set(message, ERROR_MEMORY, "%s: out of memory", self->session.path);
    }
    int error = config_parse(taken, "settings", settings->text, settings->length, &why);
    if (error == ERROR_OK && strcmp(self->profile, taken->profile.name) != 0) {
        error =
            message_set(&why, ERROR_MISSING,
                        "recorded with the profile %s, which it does not define", self->profile);
    }
    if (error == ERROR_OK) {
        config->profile = taken->profile;
        memcpy(config->like, taken->like, sizeof config->like);
        config->profile_file[0] = '\0';
    }
    free(taken);
    return error == ERROR_OK
               ? 0
               : message_set(message, error, "%s: %.900s", self->session.path, why.text);
}

/// Reads the whole index before anything is replayed.
static int read_index(struct replay *self, struct settings *settings, struct message *message) {
    struct session_event *event = &self->event;
    int code = 1;
    while (code == 1 && (code = session_reader_next(&self->session, event, message)) == 1) {
        if (event->kind == SESSION_SETTING &&
            (self->commands > 0 || !add_setting(settings, event->text))) {
            code = message_set(message, ERROR_SYNTAX, "%s: invalid setting \"%.200s\"",
                               self->session.path, event->text);
        } else if (event->kind == SESSION_PAIR && !self->has_calls) {
            const int error = replay_add_pair(self, message);
            code = error != ERROR_OK ? error : 1;
        }
        self->commands += event->kind == SESSION_COMMAND;
    }
    self->cut = self->session.cut;
    session_reader_rewind(&self->session);
    return code;
}

static int open_all(struct replay *self, int parent, const char *path, struct config *config,
                    struct message *message) {
    struct session_event *event = &self->event;
    struct settings settings = {.text = NULL};
    struct stat status;
    int error = session_reader_open(&self->session, parent, path, event, message);
    if (error != ERROR_OK) {
        return error;
    }
    memcpy(self->build, event->build, sizeof self->build);
    memcpy(self->profile, event->profile, sizeof self->profile);
    self->has_calls = fstatat(self->session.directory, SESSION_CALLS_NAME, &status, 0) == 0;
    if (self->has_calls && event->version < SESSION_VERSION_REPLAYED) {
        return message_set(message, ERROR_VERSION,
                           "%s: recorded in version %d of the format, but this build replays "
                           "versions from %d on (record it again, or replay it with build %s)",
                           path, event->version, SESSION_VERSION_REPLAYED, self->build);
    }
    error = read_index(self, &settings, message);
    if (error == ERROR_OK && self->has_calls && config != NULL) {
        error = take_settings(self, &settings, config, message);
    }
    free(settings.text);
    if (error != ERROR_OK) {
        return error;
    }
    return self->has_calls ? replay_calls_open(self, message) : replay_pairs_open(self, message);
}

int replay_open(struct replay *self, int parent, const char *path, struct config *config,
                struct message *message) {
    memset(self, 0, sizeof *self);
    self->session.directory = -1;
    for (int i = 0; i < RIG_SIDES; i++) {
        self->camera_state[i] = (struct replay_camera){.replay = self, .number = i};
        self->camera[i].self = &self->camera_state[i];
        self->camera[i].operations = &self->camera_operations[i];
    }
    const int error = open_all(self, parent, path, config, message);
    if (error != ERROR_OK) {
        replay_close(self);
    }
    return error;
}

bool replay_is_over(const struct replay *self) {
    return self->has_calls ? self->calls == 0 : self->next_pair >= self->pair_count;
}

void replay_close(struct replay *self) {
    if (self->log != NULL) {
        fclose(self->log);
        self->log = NULL;
    }
    free(self->pairs);
    self->pairs = NULL;
    session_reader_close(&self->session);
}

int replay_frame(struct replay_camera *camera, const struct pair_frame *form, uint32_t crc32,
                 struct hal_camera_frame *frame) {
    struct replay *self = camera->replay;
    struct raw_image image = form->image;
    const int code = session_reader_load(&self->session, &image, crc32, &self->last_error);
    if (code == 0) {
        *frame = (struct hal_camera_frame){.image = image,
                                           .sequence = form->sequence,
                                           .begin_us = form->begin_us,
                                           .end_us = form->end_us};
    }
    return code;
}
