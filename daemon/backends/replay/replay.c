// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/replay/replay.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "core/error.h"
#include "core/invariant.h"

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
    if (code == 0 && has_calls(self) && begin->version != SESSION_VERSION) {
        code =
            message_set(message, ERROR_VERSION,
                        "%s: recorded in version %d of the format, but this build replays version "
                        "%d (record it again, or replay it with build %s)",
                        path, begin->version, SESSION_VERSION, begin->build);
    }
    free(begin);
    if (code != 0) {
        replay_close(self);
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

bool replay_is_over(const struct replay *self) {
    return self->log != NULL ? self->calls == 0 : self->next_pair >= self->pair_count;
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
