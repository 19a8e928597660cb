// SPDX-License-Identifier: Apache-2.0
#include "core/suggest.h"

#include <stdbool.h>
#include <string.h>

#include "core/invariant.h"

enum { WRONG_MAX = 2, BEGIN_LETTERS = 3, PREFIX_MAX = 2 };

/// Levenshtein's distance, row by row: letters to change, insert or delete.
static int edit_distance(const char *word, size_t length, const char *other, size_t columns) {
    int row[SUGGEST_WORD_MAX + 1];
    INVARIANT(length <= SUGGEST_WORD_MAX && columns <= SUGGEST_WORD_MAX);
    for (size_t j = 0; j <= columns; j++) {
        row[j] = (int)j;
    }
    for (size_t i = 0; i < length; i++) {
        int diagonal = row[0];
        row[0] = (int)i + 1;
        for (size_t j = 1; j <= columns; j++) {
            const int replaced = diagonal + (word[i] != other[j - 1]);
            diagonal = row[j];
            const int gap = (row[j] < row[j - 1] ? row[j] : row[j - 1]) + 1;
            row[j] = replaced < gap ? replaced : gap;
        }
    }
    INVARIANT(row[columns] >= 0 && row[columns] <= SUGGEST_WORD_MAX);
    return row[columns];
}

void suggest_begin(struct suggest *self, const char *typed, const char *prefix) {
    INVARIANT(strlen(prefix) <= PREFIX_MAX);
    self->typed = typed;
    self->prefix = prefix;
    self->distance = WRONG_MAX + 1;
    self->text[0] = '\0';
}

static void consider(struct suggest *self, const char *word, size_t length) {
    static const char before[] = " (did you mean \"", after[] = "\"?)";
    const size_t typed = strlen(self->typed);
    const size_t longer = typed > length ? typed : length;
    if (typed == 0 || length == 0 || longer > SUGGEST_WORD_MAX) {
        return;
    }
    const bool begins = typed >= BEGIN_LETTERS && strncmp(self->typed, word, typed) == 0;
    const int distance = begins ? 1 : edit_distance(self->typed, typed, word, length);
    // A short word is close to anything.
    if (distance >= self->distance || 2 * (size_t)distance > longer) {
        return;
    }
    self->distance = distance;
    char *at = self->text;
    INVARIANT(strlen(self->prefix) <= PREFIX_MAX && length <= SUGGEST_WORD_MAX);
    memcpy(at, before, sizeof before - 1);
    at += sizeof before - 1;
    memcpy(at, self->prefix, strlen(self->prefix));
    at += strlen(self->prefix);
    memcpy(at, word, length);
    memcpy(at + length, after, sizeof after);
}

void suggest_consider(struct suggest *self, const char *word) {
    consider(self, word, strlen(word));
}

void suggest_consider_all(struct suggest *self, const char *words) {
    while (*words != '\0') {
        const size_t length = strcspn(words, " ");
        consider(self, words, length);
        words += length + (words[length] == ' ');
    }
}
