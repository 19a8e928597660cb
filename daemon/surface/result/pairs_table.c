// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/result/pairs_table.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "daemon/base/json.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/file_io.h"
#include "daemon/files/input_file.h"
#include "daemon/files/own_listing.h"

enum { TABLE_VERSION = 1, TABLE_MAX_BYTES = 64 << 20 };

struct pairs_row *pairs_table_add(struct pairs_table *self) {
    if (self->count == self->room) {
        const int room = self->room > 0 ? 2 * self->room : 16;
        struct pairs_row *rows = realloc(self->rows, (size_t)room * sizeof *rows);
        if (rows == NULL) {
            return NULL;
        }
        self->rows = rows;
        self->room = room;
    }
    struct pairs_row *row = &self->rows[self->count++];
    *row = (struct pairs_row){.depth_mm = NAN, .sigma_mm = NAN};
    return row;
}

void pairs_table_free(struct pairs_table *self) {
    free(self->settings);
    free(self->rows);
    *self = (struct pairs_table){0};
}

static void print_row(struct json *json, const struct pairs_row *row) {
    json_open_object(json, NULL);
    json_text(json, "session", row->session);
    json_integer(json, "pair", row->number);
    json_text(json, "result", row->done ? row->name : NULL);
    if (row->done) {
        json_text(json, "made_of", row->made_of);
        json_bool(json, "kept", row->kept);
        json_integer(json, "points", row->points);
        json_real(json, "depth_mm", row->depth_mm, 9);
        json_real(json, "sigma_mm", row->sigma_mm, 6);
        json_integer(json, "notes", row->notes);
        json_fixed(json, "seconds", row->seconds, 3);
    } else {
        json_text(json, "error", row->error != ERROR_OK ? row->message.text : NULL);
    }
    json_close_object(json);
}

void pairs_table_print(const struct pairs_table *self, FILE *stream) {
    struct json json;
    json_begin(&json, stream);
    json_open_object(&json, NULL);
    json_integer(&json, "version", TABLE_VERSION);
    json_text(&json, "settings", self->settings);
    json_open_array(&json, "pairs");
    for (int i = 0; i < self->count; i++) {
        print_row(&json, &self->rows[i]);
    }
    json_close_array(&json);
    json_close_object(&json);
    json_end(&json);
}

/// Whether the table in the open directory may be replaced, as one of ours or a new one.
static bool claim_table(int directory) {
    struct own_listing listing;
    own_listing_read(directory, &listing);
    bool ours = own_listing_has(&listing, PAIRS_TABLE_NAME);
    if (!ours && faccessat(directory, PAIRS_TABLE_NAME, F_OK, AT_SYMLINK_NOFOLLOW) == 0) {
        errno = EEXIST;
    } else if (!ours) {
        ours = own_listing_set(&listing, PAIRS_TABLE_NAME, true) &&
               own_listing_write(directory, &listing);
    }
    own_listing_free(&listing);
    return ours;
}

int pairs_table_save(const struct pairs_table *self, const char *out, struct message *message) {
    char *text = NULL;
    size_t length = 0;
    const int directory = open(out, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (directory < 0 && errno == ENOENT) {
        return ERROR_OK;
    }
    FILE *stream = directory >= 0 ? open_memstream(&text, &length) : NULL;
    bool written = stream != NULL;
    if (written) {
        pairs_table_print(self, stream);
        written = ferror(stream) == 0;
        written = fclose(stream) == 0 && written;
    }
    written = written && claim_table(directory) &&
              atomic_file_write(directory, PAIRS_TABLE_NAME, 0666, text, length);
    const int number = errno;
    free(text);
    if (directory >= 0) {
        close(directory);
    }
    if (written) {
        return ERROR_OK;
    }
    return message_set(message, file_error_is_full(number) ? ERROR_FULL : ERROR_BUFFER,
                       "writing %s/" PAIRS_TABLE_NAME " failed: %s", out,
                       number == EEXIST ? "it exists and was not written by vergence "
                                          "(move it, or give another directory)"
                                        : strerror(number));
}

static cJSON *read_table(const char *out) {
    char path[SESSION_READ_PATH_BYTES];
    struct message message;
    struct stat status;
    cJSON *table = NULL;
    const int length = snprintf(path, sizeof path, "%s/" PAIRS_TABLE_NAME, out);
    if (length >= (int)sizeof path || stat(path, &status) != 0 ||
        status.st_size > TABLE_MAX_BYTES) {
        return NULL;
    }
    char *text = calloc(1, (size_t)status.st_size + 1);
    size_t got = 0;
    if (text != NULL &&
        input_file_read(path, text, (size_t)status.st_size, &got, &message) == ERROR_OK) {
        table = json_parse(text);
    }
    free(text);
    return table;
}

static double number_of(const cJSON *object, const char *name) {
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    return cJSON_IsNumber(item) ? item->valuedouble : NAN;
}

/// Whether the row of an earlier table is of the same images, and its results are there.
static bool is_same(const struct pairs_row *row, const cJSON *earlier, const char *out) {
    char text[PAIRS_NAME_BYTES], path[SESSION_READ_PATH_BYTES];
    const int length = snprintf(path, sizeof path, "%s/%s/" OWN_LISTING_NAME, out, row->name);
    return json_member_text(earlier, "made_of", text, sizeof text) &&
           strcmp(text, row->made_of) == 0 && length < (int)sizeof path && access(path, R_OK) == 0;
}

/// Takes over what an earlier run wrote for this pair.
static void keep(struct pairs_row *row, const cJSON *earlier) {
    int64_t points = 0, notes = 0;
    if (!json_member_integer(earlier, "points", &points) || points < 0 || points > UINT32_MAX ||
        !json_member_integer(earlier, "notes", &notes) || notes < 0 || notes > INT_MAX) {
        return;
    }
    row->points = (uint32_t)points;
    row->notes = (int)notes;
    row->depth_mm = number_of(earlier, "depth_mm");
    row->sigma_mm = number_of(earlier, "sigma_mm");
    row->seconds = number_of(earlier, "seconds");
    row->kept = row->done = true;
}

/// Keeps the earlier row `name`, looking from `at` on, as both tables are in the same order.
/// Returns where to look for the next.
static int keep_row(struct pairs_table *self, int at, const cJSON *earlier, const char *name,
                    const char *out) {
    for (int i = 0; i < self->count; i++) {
        const int index = (at + i) % self->count;
        struct pairs_row *row = &self->rows[index];
        if (row->number > 0 && strcmp(row->name, name) == 0) {
            if (is_same(row, earlier, out)) {
                keep(row, earlier);
            }
            return index + 1;
        }
    }
    return at;
}

void pairs_table_keep(struct pairs_table *self, const char *out) {
    cJSON *table = read_table(out);
    const cJSON *settings = cJSON_GetObjectItemCaseSensitive(table, "settings");
    const cJSON *item;
    int at = 0;
    if (cJSON_IsString(settings) && strcmp(settings->valuestring, self->settings) == 0) {
        cJSON_ArrayForEach(item, cJSON_GetObjectItemCaseSensitive(table, "pairs")) {
            char name[PAIRS_NAME_BYTES];
            if (json_member_text(item, "result", name, sizeof name)) {
                at = keep_row(self, at, item, name, out);
            }
        }
    }
    cJSON_Delete(table);
}
