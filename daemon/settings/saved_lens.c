// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/saved_lens.h"

#include <string.h>

#include "console/lens_table_text.h"
#include "core/invariant.h"

#define OBJECT_KEY "object"

static const struct {
    const char *key;     ///< key in the text of the settings
    const char *option;  ///< option of the command lens
    enum lens_table_kind kind;
} tables[] = {{"zoom_to_focus", "focus", LENS_TABLE_FOCUS},
              {"iris_to_f_number", "iris", LENS_TABLE_IRIS}};

enum { TABLES = sizeof tables / sizeof tables[0] };

static const struct lens_table *table_of(const struct lens_learned *learned, int table) {
    return tables[table].kind == LENS_TABLE_FOCUS ? &learned->focus : &learned->iris;
}

static const char *object_text(const struct lens_object *object, char text[LENS_TABLE_TEXT_BYTES]) {
    struct command_text to = command_text_begin(text, LENS_TABLE_TEXT_BYTES);
    lens_object_print(object, &to);
    return text;
}

static const char *table_text(int table, const struct lens_table *values,
                              char text[LENS_TABLE_TEXT_BYTES]) {
    struct command_text to = command_text_begin(text, LENS_TABLE_TEXT_BYTES);
    lens_table_print(tables[table].kind, values, &to);
    return text;
}

void saved_lens_take(const struct rig *rig, struct saved_lenses *saved) {
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        saved->learned[side] = rig->camera[side].lens.learned;
    }
    saved->object = rig->object;
}

// ---- the text

void saved_lens_print_object(const struct saved_lenses *saved, FILE *file) {
    char text[LENS_TABLE_TEXT_BYTES];
    if (saved->object.known) {
        fprintf(file, OBJECT_KEY " = %s\n", object_text(&saved->object, text));
    }
}

void saved_lens_print(const struct saved_lenses *saved, unsigned side, FILE *file) {
    char text[LENS_TABLE_TEXT_BYTES];
    for (int i = 0; i < TABLES; i++) {
        const struct lens_table *values = table_of(&saved->learned[side], i);
        for (uint32_t k = 0; k < values->count; k++) {
            const struct lens_table one = {.point = {values->point[k]}, .count = 1};
            fprintf(file, "%s = %s\n", tables[i].key, table_text(i, &one, text));
        }
    }
}

// Appends an entry, which must be above those before.
static bool append(struct lens_table *table, const struct lens_table *read) {
    if (read->count != 1 || table->count == LENS_POINTS_MAX ||
        (table->count > 0 && read->point[0].at <= table->point[table->count - 1].at)) {
        return false;
    }
    table->point[table->count] = read->point[0];
    table->count++;
    return true;
}

bool saved_lens_read(struct saved_lenses *saved, const char *key, const char *text) {
    struct lens_table read;
    if (strcmp(key, OBJECT_KEY) == 0) {
        return lens_object_parse(text, &saved->object);
    }
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        const size_t bytes = strlen(rig_side_names[side]);
        if (strncmp(key, rig_side_names[side], bytes) != 0 || key[bytes] != '.') {
            continue;
        }
        for (int i = 0; i < TABLES; i++) {
            struct lens_learned *learned = &saved->learned[side];
            if (strcmp(key + bytes + 1, tables[i].key) == 0) {
                return lens_table_parse(tables[i].kind, text, &read) &&
                       append(tables[i].kind == LENS_TABLE_FOCUS ? &learned->focus : &learned->iris,
                              &read);
            }
        }
    }
    return false;
}

// ---- commands

static bool are_equal(const struct lens_table *a, const struct lens_table *b) {
    for (uint32_t i = 0; a->count == b->count && i < a->count; i++) {
        const struct lens_point *left = &a->point[i], *right = &b->point[i];
        if (left->at != right->at || left->value != right->value || left->sigma != right->sigma ||
            left->count != right->count) {
            return false;
        }
    }
    return a->count == b->count;
}

size_t saved_lens_commands(const struct saved_lenses *saved, const struct rig *rig, bool missing,
                           char (*lines)[SAVED_LENS_LINE_BYTES], size_t count) {
    char text[LENS_TABLE_TEXT_BYTES];
    for (unsigned side = 0; side < RIG_SIDES; side++) {
        for (int i = 0; i < TABLES; i++) {
            const struct lens_table *values = table_of(&saved->learned[side], i);
            const struct lens_table *now = table_of(&rig->camera[side].lens.learned, i);
            if (values->count == 0 || are_equal(values, now) || (now->count == 0) != missing) {
                continue;
            }
            snprintf(lines[count++], sizeof lines[0], "lens learned side=%s %s=%s",
                     rig_side_names[side], tables[i].option, table_text(i, values, text));
        }
    }
    const struct lens_object *now = &rig->object;
    if (saved->object.known && !now->known == missing) {
        snprintf(lines[count++], sizeof lines[0], "lens learned object=%s",
                 object_text(&saved->object, text));
    }
    return count;
}
