// SPDX-License-Identifier: Apache-2.0
#include "device/lens_v3lc_answer.h"

#include <stddef.h>

#include "core/invariant.h"

enum { DIGITS_MAX = 4, IRIS = 2 };

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

// The integer after the only colon of the record, up to its end; -1: invalid.
static int value_of(const char *record, size_t length) {
    size_t colon = 0;
    while (colon < length && record[colon] != ':') {
        colon++;
    }
    size_t at = colon + 1;
    while (at < length && record[at] == ' ') {
        at++;
    }
    if (at >= length || length - at > DIGITS_MAX) {
        return -1;
    }
    int value = 0;
    for (; at < length; at++) {
        if (!is_digit(record[at])) {
            return -1;
        }
        value = 10 * value + (record[at] - '0');
    }
    return value;
}

static bool has_colon(const char *record, size_t length) {
    for (size_t i = 0; i < length; i++) {
        if (record[i] == ':') {
            return true;
        }
    }
    return false;
}

// The lens number in a first record, from 0; -1: not a first record.
static int lens_of(const char *record, size_t length, bool single) {
    static const char name[] = "V3LC ";
    enum { NAME = sizeof name - 1 };
    if (single) {
        return has_colon(record, length) ? -1 : 0;
    }
    if (length != NAME + 1 || (record[NAME] != '1' && record[NAME] != '2')) {
        return -1;
    }
    for (size_t i = 0; i < NAME; i++) {
        if (record[i] != name[i]) {
            return -1;
        }
    }
    return record[NAME] - '1';
}

// The value of a record of `length` bytes (0: too long), which names a lens (-1: it does not); -1:
// it is not one.
static int next_value(const struct lens_v3lc_answer *self, int lens, size_t length, bool single) {
    if (single && self->count == IRIS && has_colon(self->record, length)) {
        return 0;
    }
    const bool whole = self->length <= LENS_V3LC_RECORD;
    return self->begun && lens < 0 && whole ? value_of(self->record, length) : -1;
}

// Handles the end of a record.
static enum lens_v3lc_event end_record(struct lens_v3lc_answer *self, bool single) {
    const bool whole = self->length <= LENS_V3LC_RECORD;
    const size_t length = whole ? self->length : 0;
    INVARIANT(self->count < LENS_V3LC_VALUES);
    const bool was_begun = self->begun;
    const int lens = whole ? lens_of(self->record, length, single) : -1;
    const int value = next_value(self, lens, length, single);
    if (value >= 0) {
        self->values[self->count++] = (int16_t)value;
        if (self->count < LENS_V3LC_VALUES) {
            return LENS_V3LC_NOTHING;
        }
        self->begun = self->records = false;
        self->count = 0;
        return LENS_V3LC_ANSWER;
    }
    self->begun = lens >= 0;
    self->number = lens >= 0 ? (uint8_t)lens : self->number;
    self->count = 0;
    self->records = true;
    return was_begun && self->begun ? LENS_V3LC_GARBAGE : LENS_V3LC_NOTHING;
}

enum lens_v3lc_event lens_v3lc_answer_take(struct lens_v3lc_answer *self, bool single,
                                           uint8_t byte) {
    INVARIANT(self->length <= LENS_V3LC_RECORD + 1);
    if (byte != '\r' && byte != '\n') {
        if (self->length < LENS_V3LC_RECORD) {
            self->record[self->length] = (char)byte;
        }
        self->length = (uint8_t)(self->length + (self->length <= LENS_V3LC_RECORD ? 1 : 0));
        return LENS_V3LC_NOTHING;
    }
    enum lens_v3lc_event event = LENS_V3LC_NOTHING;
    if (self->length > 0) {
        event = end_record(self, single);
        self->length = 0;
    }
    if (byte == '\n' && event == LENS_V3LC_NOTHING && self->records && !self->begun) {
        event = LENS_V3LC_GARBAGE;
    }
    if (byte == '\n') {
        self->records = false;
    }
    return event;
}
