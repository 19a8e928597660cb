// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/fit.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "core/error.h"
#include "core/utf8.h"
#include "daemon/system/sha256.h"

// The format: Devicetree Specification 0.4, chapter 5.
enum {
    MAGIC = 0xd00dfeed,
    VERSION = 17,
    BEGIN_NODE = 1,
    END_NODE = 2,
    PROPERTY = 3,
    NOP = 4,
    END = 9,
    WORD = 4,
    NAME_BYTES = 32,
    DEPTH_MAX = 16,
    // Depths of nodes: the root, /images, a part, its sum.
    ROOT = 1,
    FOLDER,
    PART,
    SUM
};

/// Words of the header.
enum { TOTAL = 1, STRUCTURE, STRINGS, COMPATIBLE = 6, STRINGS_SIZE = 8, STRUCTURE_SIZE };

struct bytes {
    const uint8_t *data;  ///< NULL: none
    size_t count;
};

struct reader {
    struct bytes structure, strings;
    size_t at;
    unsigned depth;  ///< depth of the current node
    bool in_images, in_configurations;
    char part[NAME_BYTES];
    struct bytes data, algorithm, value;  ///< properties of the current part and sum
    bool summed;                          ///< the current part has a SHA-256 sum
    uint8_t expected[SHA256_BYTES];
    bool dated;
    unsigned configurations;
    struct fit *fit;
    struct message *message;
};

static uint32_t read_word(const uint8_t *at) {
    return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
}

static int damaged(struct reader *self) {
    return message_set(self->message, ERROR_SYNTAX, "damaged: invalid tree at offset %zu",
                       self->at);
}

/// Takes a word. False: the end.
static bool take_word(struct reader *self, uint32_t *word) {
    if (self->structure.count - self->at < WORD) {
        return false;
    }
    *word = read_word(self->structure.data + self->at);
    self->at += WORD;
    return true;
}

/// Takes `count` bytes and what fills them up to a word. False: they are not there.
static bool take_bytes(struct reader *self, size_t count, struct bytes *bytes) {
    const size_t left = self->structure.count - self->at;
    const size_t fill = (WORD - count % WORD) % WORD;
    if (count > left || fill > left - count) {
        return false;
    }
    *bytes = (struct bytes){self->structure.data + self->at, count};
    self->at += count + fill;
    return true;
}

/// A text that ends within `bytes`, or NULL.
static const char *text_in(struct bytes bytes) {
    return bytes.data != NULL && memchr(bytes.data, '\0', bytes.count) != NULL
               ? (const char *)bytes.data
               : NULL;
}

// ---- nodes

static int begin_node(struct reader *self) {
    const struct bytes rest = {self->structure.data + self->at, self->structure.count - self->at};
    const char *name = text_in(rest);
    struct bytes taken;
    if (name == NULL || self->depth == DEPTH_MAX || !take_bytes(self, strlen(name) + 1, &taken)) {
        return damaged(self);
    }
    self->depth++;
    if (self->depth == FOLDER) {
        self->in_images = strcmp(name, "images") == 0;
        self->in_configurations = strcmp(name, "configurations") == 0;
    } else if (self->depth == PART) {
        utf8_copy_printable(name, self->part, sizeof self->part);
        self->data = (struct bytes){NULL, 0};
        self->summed = false;
        self->configurations += self->in_configurations ? 1 : 0;
    } else if (self->depth == SUM) {
        self->algorithm = self->value = (struct bytes){NULL, 0};
    }
    return 0;
}

/// Compares a part with its sum.
static int end_part(struct reader *self) {
    uint8_t sum[SHA256_BYTES];
    if (self->data.data == NULL || self->data.count == 0) {
        return message_set(self->message, ERROR_MISSING,
                           "%s: no data inside the image (mkimage without -E puts it there)",
                           self->part);
    }
    if (!self->summed) {
        return message_set(self->message, ERROR_MISSING, "%s: no sha256 sum", self->part);
    }
    sha256(self->data.data, self->data.count, sum);
    if (memcmp(sum, self->expected, sizeof sum) != 0) {
        return message_set(self->message, ERROR_CRC, "damaged: the sha256 sum of %s differs",
                           self->part);
    }
    self->fit->parts++;
    return ERROR_OK;
}

static int end_node(struct reader *self) {
    int error = 0;
    if (self->depth == 0) {
        return damaged(self);
    }
    if (self->depth == SUM && self->in_images) {
        const char *algorithm = text_in(self->algorithm);
        if (algorithm != NULL && strcmp(algorithm, "sha256") == 0 &&
            self->value.count == SHA256_BYTES) {
            memcpy(self->expected, self->value.data, SHA256_BYTES);
            self->summed = true;
        }
    } else if (self->depth == PART && self->in_images) {
        error = end_part(self);
    }
    self->depth--;
    return error;
}

// ---- properties

static void take_root(struct reader *self, const char *name, struct bytes value) {
    const char *text = text_in(value);
    if (strcmp(name, "timestamp") == 0 && value.count == WORD) {
        self->fit->timestamp = read_word(value.data);
        self->dated = true;
    } else if (strcmp(name, "board") == 0 && text != NULL) {
        utf8_copy_printable(text, self->fit->board, sizeof self->fit->board);
    }
}

/// Keeps a property that is needed, if the node has not had it before.
static void keep(struct bytes *kept, struct bytes value) {
    if (kept->data == NULL) {
        *kept = value;
    }
}

static void take_value(struct reader *self, const char *name, struct bytes value) {
    if (self->depth == ROOT) {
        take_root(self, name, value);
    } else if (self->depth == PART && strcmp(name, "data") == 0) {
        keep(&self->data, value);
    } else if (self->depth == SUM && strcmp(name, "algo") == 0) {
        keep(&self->algorithm, value);
    } else if (self->depth == SUM && strcmp(name, "value") == 0) {
        keep(&self->value, value);
    }
}

static int take_property(struct reader *self) {
    uint32_t count = 0, offset = 0;
    struct bytes value;
    if (!take_word(self, &count) || !take_word(self, &offset) || !take_bytes(self, count, &value) ||
        offset >= self->strings.count || self->depth == 0) {
        return damaged(self);
    }
    const struct bytes rest = {self->strings.data + offset, self->strings.count - offset};
    const char *name = text_in(rest);
    if (name == NULL) {
        return damaged(self);
    }
    take_value(self, name, value);
    return 0;
}

/// Reads the whole tree.
static int read_tree(struct reader *self) {
    uint32_t token = 0;
    int error = 0;
    while (error == ERROR_OK) {
        if (!take_word(self, &token)) {
            return damaged(self);
        }
        switch (token) {
            case BEGIN_NODE:
                error = begin_node(self);
                break;
            case END_NODE:
                error = end_node(self);
                break;
            case PROPERTY:
                error = take_property(self);
                break;
            case NOP:
                break;
            case END:
                return self->depth == 0 ? 0 : damaged(self);
            default:
                return damaged(self);
        }
    }
    return error;
}

// ---- the image

bool fit_begins(const uint8_t header[FIT_HEADER_BYTES], size_t *bytes) {
    *bytes = read_word(header + (size_t)WORD * TOTAL);
    return read_word(header) == (uint32_t)MAGIC && *bytes >= FIT_HEADER_BYTES;
}

/// A part of the image by its offset and size, which are words of the header. False: not inside.
static bool find(const uint8_t *data, size_t total, int offset, int size, struct bytes *part) {
    const size_t at = read_word(data + (size_t)WORD * (size_t)offset);
    const size_t count = read_word(data + (size_t)WORD * (size_t)size);
    *part = (struct bytes){data + (at <= total ? at : 0), count};
    return at <= total && count <= total - at;
}

/// What is needed and was not there; NULL: nothing.
static const char *find_missing(const struct reader *self) {
    if (self->fit->parts == 0) {
        return "parts in /images";
    }
    if (self->configurations == 0) {
        return "configurations";
    }
    if (!self->dated) {
        return "timestamp";
    }
    return self->fit->board[0] == '\0' ? "property \"board\" in its root" : NULL;
}

static int check_parts(const struct reader *self) {
    const char *missing = find_missing(self);
    if (missing == NULL) {
        return 0;
    }
    return message_set(self->message, ERROR_MISSING, "the image has no %s", missing);
}

int fit_check(const uint8_t *data, size_t capacity, struct fit *fit, struct message *message) {
    struct reader self = {.fit = fit, .message = message};
    size_t total = 0;
    *fit = (struct fit){0};
    if (capacity < FIT_HEADER_BYTES || !fit_begins(data, &total)) {
        return message_set(message, ERROR_SYNTAX, "not an image (FIT) of U-Boot");
    }
    if (total > capacity) {
        return message_set(message, ERROR_SYNTAX, "incomplete: %zu of %zu bytes", capacity, total);
    }
    if (read_word(data + (size_t)WORD * COMPATIBLE) > VERSION ||
        !find(data, total, STRUCTURE, STRUCTURE_SIZE, &self.structure) ||
        !find(data, total, STRINGS, STRINGS_SIZE, &self.strings)) {
        return message_set(message, ERROR_SYNTAX, "damaged: invalid header");
    }
    const int error = read_tree(&self);
    fit->bytes = total;
    return error != ERROR_OK ? error : check_parts(&self);
}

void fit_time_text(uint32_t timestamp, char text[FIT_TIME_BYTES]) {
    const time_t time = (time_t)timestamp;
    struct tm parts;
    if (gmtime_r(&time, &parts) == NULL ||
        strftime(text, FIT_TIME_BYTES, "%Y-%m-%d %H:%M:%S UTC", &parts) == 0) {
        snprintf(text, FIT_TIME_BYTES, "%u", (unsigned)timestamp);
    }
}
