// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/own_listing.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/invariant.h"
#include "daemon/files/atomic_file.h"

#define HEAD "# Written by vergence, which replaces or removes only these files here.\n"
enum { TEXT_MAX = 4 << 20 };

static bool read_text(int fd, char *text, size_t bytes) {
    size_t got = 0;
    while (got < bytes) {
        const ssize_t more = read(fd, text + got, bytes - got);
        if (more <= 0) {
            return false;
        }
        got += (size_t)more;
    }
    return true;
}

void own_listing_read(int directory, struct own_listing *self) {
    struct stat status;
    const int fd =
        openat(directory, OWN_LISTING_NAME, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    *self = (struct own_listing){.text = NULL};
    if (fd < 0) {
        return;
    }
    if (fstat(fd, &status) == 0 && S_ISREG(status.st_mode) &&
        status.st_size >= (off_t)strlen(HEAD) && status.st_size <= TEXT_MAX) {
        const size_t bytes = (size_t)status.st_size;
        char *text = malloc(bytes + 1);
        if (text != NULL && read_text(fd, text, bytes) && text[bytes - 1] == '\n' &&
            strncmp(text, HEAD, strlen(HEAD)) == 0 && memchr(text, '\0', bytes) == NULL) {
            text[bytes] = '\0';
            *self = (struct own_listing){text, bytes};
        } else {
            free(text);
        }
    }
    close(fd);
}

/// Where the line with this name begins; NULL: none.
static char *find(const struct own_listing *self, const char *name) {
    const size_t length = strlen(name);
    for (char *line = self->text; line != NULL; line = strchr(line, '\n')) {
        line += line != self->text;
        if (strncmp(line, name, length) == 0 && line[length] == '\n') {
            return line;
        }
    }
    return NULL;
}

bool own_listing_has(const struct own_listing *self, const char *name) {
    return name[0] != '\0' && name[0] != '#' && find(self, name) != NULL;
}

bool own_listing_set(struct own_listing *self, const char *name, bool listed) {
    const size_t length = strlen(name);
    INVARIANT(length > 0);
    char *line = find(self, name);
    if (!listed && line != NULL) {
        char *rest = line + length + 1;
        memmove(line, rest, strlen(rest) + 1);
        self->length -= length + 1;
    }
    if (!listed || line != NULL) {
        return true;
    }
    const char *head = self->text == NULL ? HEAD : "";
    const size_t bytes = self->length + strlen(head) + length + 1;
    char *more = strchr(name, '\n') == NULL ? realloc(self->text, bytes + 1) : NULL;
    if (more == NULL) {
        return false;
    }
    snprintf(more + self->length, bytes + 1 - self->length, "%s%s\n", head, name);
    *self = (struct own_listing){more, bytes};
    return true;
}

static bool is_listing(const void *listing, const char *name) {
    (void)listing;
    return strcmp(name, OWN_LISTING_NAME) == 0;
}

void own_listing_forget(int directory) {
    own_remove(directory, OWN_LISTING_NAME,
               &(struct own_proof){.kind = OWN_LISTED, .lists = is_listing});
}

bool own_listing_write(int directory, const struct own_listing *self) {
    if (self->length <= strlen(HEAD)) {
        own_listing_forget(directory);
        return true;
    }
    return atomic_file_write(directory, OWN_LISTING_NAME, 0666, self->text, self->length);
}

static bool lists(const void *listing, const char *name) {
    return own_listing_has(listing, name);
}

struct own_proof own_listing_proof(const struct own_listing *self) {
    return (struct own_proof){.kind = OWN_LISTED, .lists = lists, .listing = self};
}

void own_listing_free(struct own_listing *self) {
    free(self->text);
    *self = (struct own_listing){.text = NULL};
}
