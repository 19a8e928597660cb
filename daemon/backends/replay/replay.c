// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/replay/replay.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/replay/replay_calls.h"

static bool has_calls(const struct replay *self) {
    struct stat status;
    return fstatat(self->session.directory, SESSION_CALLS_NAME, &status, 0) == 0;
}

int replay_open(struct replay *self, int parent, const char *path, char *profile,
                struct message *message) {
    memset(self, 0, sizeof *self);
    self->session.directory = -1;
    struct session_event *begin = malloc(sizeof *begin);
    if (begin == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", path);
    }
    int code = session_reader_open(&self->session, parent, path, begin, message);
    if (code == 0 && profile != NULL) {
        memcpy(profile, begin->profile, SESSION_NAME_MAX + 1);
    }
    free(begin);
    if (code != 0) {
        return code;
    }
    for (int i = 0; i < RIG_SIDES; i++) {
        self->camera_state[i] = (struct replay_camera){.replay = self, .number = i};
        self->camera[i].self = &self->camera_state[i];
        self->camera[i].operations = &self->camera_operations[i];
    }
    code = has_calls(self) ? replay_calls_open(self, message) : replay_pairs_open(self, message);
    if (code != 0) {
        replay_close(self);
    }
    return code;
}

bool replay_idle_is_next(struct replay *self) {
    return self->log != NULL && replay_calls_take_mark(self, trace_idle);
}

bool replay_cancel_is_next(struct replay *self) {
    return self->log != NULL && replay_calls_take_mark(self, trace_cancel);
}

bool replay_is_over(const struct replay *self) {
    if (self->log != NULL) {
        return self->calls == 0;
    }
    return self->next_pair >= self->pair_count;
}

void replay_next_pair(struct replay *self) {
    if (self->log == NULL && self->next_pair < self->pair_count) {
        self->next_pair++;
    }
}

void replay_close(struct replay *self) {
    for (int i = 0; i < RIG_SIDES; i++) {
        for (int place = 0; place < REPLAY_FRAMES_LENT; place++) {
            free(self->camera_state[i].pixels[place]);
            self->camera_state[i].pixels[place] = NULL;
        }
    }
    if (self->log != NULL) {
        fclose(self->log);
        self->log = NULL;
    }
    free(self->pairs);
    self->pairs = NULL;
    session_reader_close(&self->session);
}
