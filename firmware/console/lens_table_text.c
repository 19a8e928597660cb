// SPDX-License-Identifier: Apache-2.0
#include "console/lens_table_text.h"

#include <string.h>

#include "console/command_words.h"
#include "core/invariant.h"

enum {
    NUMBER_BYTES = 24,
    AT_MAX = 65535,
    VALUE_MAX = 1 << 24,
    SIGMA_MAX = UINT16_MAX,
    TIMES_MAX = 999,
};

#define NONE "none"

// Integer steps in one unit of the text, and the decimals that show each step.
static const struct {
    double scale;
    int decimals;
} kinds[] = {[LENS_TABLE_FOCUS] = {16, 4}, [LENS_TABLE_IRIS] = {LENS_RATIO_ONE, 3}};

void lens_table_print(enum lens_table_kind kind, const struct lens_table *table,
                      struct command_text *text) {
    const double scale = kinds[kind].scale;
    const int decimals = kinds[kind].decimals;
    INVARIANT(lens_table_is_valid(table));
    if (table->count == 0) {
        command_text_add(text, NONE);
    }
    for (uint32_t i = 0; i < table->count; i++) {
        const struct lens_point *point = &table->point[i];
        command_text_add(text, i == 0 ? "" : ",");
        command_text_add_integer(text, point->at);
        command_text_add(text, ":");
        command_text_add_number(text, point->value / scale, decimals);
        command_text_add(text, ":");
        command_text_add_number(text, point->sigma / scale, decimals);
        command_text_add(text, ":");
        command_text_add_integer(text, point->count);
    }
}

// Takes a number up to `ends` or the end, as an integer of 1 / `scale`.
static bool take_number(const char **at, const char *ends, double scale, int64_t min, int64_t max,
                        int64_t *value) {
    char text[NUMBER_BYTES];
    double number = 0;
    const size_t length = strcspn(*at, ends);
    if (length >= sizeof text) {
        return false;
    }
    memcpy(text, *at, length);
    text[length] = '\0';
    *at += length;
    if (!command_words_number(text, &number) || number * scale < (double)min - 0.5 ||
        number * scale > (double)max + 0.5) {
        return false;
    }
    *value = (int64_t)(number * scale + (number < 0 ? -0.5 : 0.5));
    return true;
}

static bool take_point(const char **at, double scale, struct lens_point *point) {
    int64_t position = 0, value = 0, sigma = 0, times = 0;
    if (!take_number(at, ":", 1, 0, AT_MAX, &position) || *(*at)++ != ':' ||
        !take_number(at, ":", scale, -VALUE_MAX, VALUE_MAX, &value) || *(*at)++ != ':' ||
        !take_number(at, ":", scale, 0, SIGMA_MAX, &sigma) || *(*at)++ != ':' ||
        !take_number(at, ",", 1, 0, TIMES_MAX, &times)) {
        return false;
    }
    *point =
        (struct lens_point){(int32_t)position, (int32_t)value, (uint16_t)sigma, (uint16_t)times};
    return true;
}

bool lens_table_parse(enum lens_table_kind kind, const char *text, struct lens_table *table) {
    struct lens_table read = {.count = 0};
    const char *at = text;
    if (strcmp(text, NONE) == 0) {
        *table = read;
        return true;
    }
    for (;;) {
        if (read.count == LENS_POINTS_MAX ||
            !take_point(&at, kinds[kind].scale, &read.point[read.count])) {
            return false;
        }
        read.count++;
        if (*at == '\0') {
            break;
        }
        at++;
    }
    if (!lens_table_is_valid(&read)) {
        return false;
    }
    *table = read;
    return true;
}

void lens_object_print(const struct lens_object *object, struct command_text *text) {
    const double scale = kinds[LENS_TABLE_FOCUS].scale;
    const int decimals = kinds[LENS_TABLE_FOCUS].decimals;
    if (!object->known) {
        command_text_add(text, NONE);
        return;
    }
    command_text_add_number(text, object->position_q4 / scale, decimals);
    command_text_add(text, ":");
    command_text_add_number(text, object->sigma_q4 / scale, decimals);
}

bool lens_object_parse(const char *text, struct lens_object *object) {
    const double scale = kinds[LENS_TABLE_FOCUS].scale;
    const char *at = text;
    int64_t position = 0, sigma = 0;
    if (strcmp(text, NONE) == 0) {
        *object = (struct lens_object){.known = false};
        return true;
    }
    if (!take_number(&at, ":", scale, -VALUE_MAX, VALUE_MAX, &position) || *at++ != ':' ||
        !take_number(&at, "", scale, 0, SIGMA_MAX, &sigma) || *at != '\0') {
        return false;
    }
    *object = (struct lens_object){
        .known = true, .position_q4 = (int32_t)position, .sigma_q4 = (uint16_t)sigma};
    return true;
}
