// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/session_files.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/crc.h"
#include "core/invariant.h"
#include "daemon/files/directory_names.h"
#include "daemon/files/own_remove.h"
#include "daemon/session/session_read.h"

static bool add(struct session_files *self, uint32_t crc) {
    enum { STEP = 256 };
    if (self->count % STEP == 0) {
        uint32_t *more = realloc(self->crc, (self->count + STEP) * sizeof *more);
        if (more == NULL) {
            return false;  // the contents prove the rest
        }
        self->crc = more;
    }
    self->crc[self->count++] = crc;
    return true;
}

bool session_files_read(struct session_files *self, int directory) {
    struct message ignored;
    struct session_reader reader;
    struct session_event *event = malloc(sizeof *event);
    *self = (struct session_files){.directory = directory};
    if (event == NULL || session_reader_open(&reader, directory, ".", event, &ignored) != 0) {
        free(event);
        return false;
    }
    for (bool more = true; more && session_reader_next(&reader, event, &ignored) == 1;) {
        if (event->kind == SESSION_CALIBRATION || event->kind == SESSION_ZOOM_CALIBRATION) {
            more = add(self, event->crc32);
        } else if (event->kind == SESSION_PAIR) {
            more = add(self, event->frame_crc[0]) && add(self, event->frame_crc[1]);
        }
    }
    session_reader_close(&reader);
    free(event);
    return true;
}

/// Parses the name of a frame or a calibration.
static bool read_name(const char *name, uint32_t *crc) {
    char frame[SESSION_NAME_MAX + 1], calibration[SESSION_NAME_MAX + 1];
    char zoom_calibration[SESSION_NAME_MAX + 1];
    const char *digits = strchr(name, '-');
    if (digits == NULL) {
        return false;
    }
    *crc = (uint32_t)strtoul(digits + 1, NULL, 16);
    session_frame_name(*crc, frame);
    session_calibration_name(*crc, calibration);
    session_zoom_calibration_name(*crc, zoom_calibration);
    return strcmp(name, frame) == 0 || strcmp(name, calibration) == 0 ||
           strcmp(name, zoom_calibration) == 0;
}

static bool contents_have_crc(int directory, const char *name, uint32_t crc) {
    char data[4096];
    ssize_t bytes = 0;
    uint32_t sum = 0;
    const int fd = openat(directory, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) {
        return false;
    }
    while ((bytes = read(fd, data, sizeof data)) > 0) {
        sum = crc_update(sum, data, (size_t)bytes);
    }
    close(fd);
    return bytes == 0 && sum == crc;
}

bool session_files_has(const struct session_files *self, const char *name) {
    uint32_t crc = 0;
    if (strcmp(name, SESSION_INDEX_NAME) == 0 || strcmp(name, SESSION_CALLS_NAME) == 0) {
        return true;
    }
    if (!read_name(name, &crc)) {
        return false;
    }
    for (size_t i = 0; i < self->count; i++) {
        if (self->crc[i] == crc) {
            return true;
        }
    }
    return contents_have_crc(self->directory, name, crc);
}

static bool lists(const void *listing, const char *name) {
    return session_files_has(listing, name);
}

void session_files_remove(const struct session_files *self) {
    const struct own_proof proof = {.kind = OWN_LISTED, .lists = lists, .listing = self};
    DIR *stream =
        directory_stream(openat(self->directory, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (stream == NULL) {
        return;
    }
    for (const struct dirent *entry; (entry = readdir(stream)) != NULL;) {
        if (strcmp(entry->d_name, SESSION_INDEX_NAME) != 0) {
            own_remove(self->directory, entry->d_name, &proof);
        }
    }
    closedir(stream);
    own_remove_abandoned(self->directory, false);
    own_remove(self->directory, SESSION_INDEX_NAME, &proof);
}

void session_files_free(struct session_files *self) {
    free(self->crc);
    self->crc = NULL;
}
