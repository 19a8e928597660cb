// SPDX-License-Identifier: Apache-2.0
#include "console/command_words.h"

#include <string.h>

#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"

enum { NUMBER_DIGITS_MAX = 15, FAR_AWAY = 1000 };

static bool is_blank(char c) {
    return c == ' ' || c == '\t';
}

/// Copies a quoted word; `*at` is after the opening quote, and on return after the closing one.
static bool copy_quoted(const char **at, char **to) {
    const char *from = *at;
    while (*from != '"') {
        if (*from == '\\' && (from[1] == '"' || from[1] == '\\')) {
            from++;
        }
        if (*from == '\0') {
            return false;
        }
        *(*to)++ = *from++;
    }
    *at = from + 1;
    return is_blank(**at) || **at == '\0';
}

int command_words_split(const char *line, char *storage, const char **words, size_t *count,
                        const char **why) {
    const size_t length = strlen(line);
    if (length > COMMAND_LINE_MAX) {
        *why = "the line is longer than 512 characters";
        return ERROR_SYNTAX;
    }
    for (size_t i = 0; i < length; i++) {
        if (((unsigned char)line[i] < ' ' && line[i] != '\t') || line[i] == 0x7F) {
            *why = "the line contains a control character";
            return ERROR_SYNTAX;
        }
    }
    char *to = storage;
    *count = 0;
    for (const char *at = line;;) {
        at += strspn(at, " \t");
        if (*at == '\0' || *at == '#') {
            break;
        }
        const char *word = to;
        if (*at == '"') {
            at++;
            if (!copy_quoted(&at, &to)) {
                *why = "unterminated quote (a word that begins with \" must end with it)";
                return ERROR_SYNTAX;
            }
        } else {
            const size_t bytes = strcspn(at, " \t");
            memcpy(to, at, bytes);
            to += bytes;
            at += bytes;
        }
        *to++ = '\0';
        if (*count < COMMAND_WORDS_MAX) {
            words[(*count)++] = word;
        }
    }
    // Each word is followed by a blank or the line's end, so there is room for its zero.
    INVARIANT(to <= storage + COMMAND_LINE_MAX + 1);
    return 0;
}

static const char *after_sign(const char *word) {
    return word + (*word == '-' || *word == '+');
}

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

bool command_words_number(const char *word, double *value) {
    const char *at = after_sign(word);
    int64_t scaled = 0;
    int digits = 0;
    int decimals = 0;
    bool point = false;
    for (; *at != '\0'; at++) {
        if (*at == '.' && !point) {
            point = true;
        } else if (is_digit(*at) && digits < NUMBER_DIGITS_MAX) {
            scaled = scaled * 10 + (*at - '0');
            digits += digits > 0 || *at != '0' || point;
            decimals += point;
        } else {
            return false;
        }
    }
    if (at == word || !is_digit(at[-1])) {
        return false;
    }
    INVARIANT(scaled >= 0 && scaled <= DECIMAL_MAX);
    *value = decimal_to_double(*word == '-' ? -scaled : scaled, decimals);
    return true;
}

/// Value of a digit; 16 or more if the character is not a digit.
static unsigned digit_value(char c) {
    if (c >= '0' && c <= '9') {
        return (unsigned)(c - '0');
    }
    if (c >= 'a' && c <= 'f') {
        return (unsigned)(c - 'a') + 10;
    }
    return c >= 'A' && c <= 'F' ? (unsigned)(c - 'A') + 10 : 16;
}

bool command_words_integer(const char *word, int64_t *value) {
    const bool negative = *word == '-';
    const char *at = after_sign(word);
    const unsigned base = at[0] == '0' && (at[1] == 'x' || at[1] == 'X') ? 16 : 10;
    at += base == 16 ? 2 : 0;
    const char *first = at;
    uint64_t magnitude = 0;
    for (; digit_value(*at) < base; at++) {
        const uint64_t digit = digit_value(*at);
        magnitude = magnitude > ((uint64_t)INT64_MAX - digit) / base ? (uint64_t)INT64_MAX
                                                                     : magnitude * base + digit;
    }
    if (at == first || *at != '\0') {
        return false;
    }
    INVARIANT(magnitude <= (uint64_t)INT64_MAX);
    *value = negative ? -(int64_t)magnitude : (int64_t)magnitude;
    return true;
}

bool command_words_choice_at(const char *choices, int index, char *word) {
    const char *at = choices;
    for (int i = 0; i < index; i++) {
        at = strchr(at, ' ');
        if (at == NULL) {
            return false;
        }
        at++;
    }
    const size_t bytes = strcspn(at, " ");
    INVARIANT(bytes > 0 && bytes < COMMAND_CHOICE_MAX);
    memcpy(word, at, bytes);
    word[bytes] = '\0';
    return true;
}

int command_words_choice(const char *word, const char *choices) {
    char choice[COMMAND_CHOICE_MAX];
    for (int i = 0; command_words_choice_at(choices, i, choice); i++) {
        if (strcmp(word, choice) == 0) {
            return i;
        }
    }
    return -1;
}

/// Levenshtein's distance, row by row; words of at most COMMAND_CHOICE_MAX letters.
static int edit_distance(const char *word, size_t length, const char *other, size_t columns) {
    int row[COMMAND_CHOICE_MAX + 1];
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
    INVARIANT(row[columns] >= 0 && row[columns] <= COMMAND_CHOICE_MAX);
    return row[columns];
}

int command_words_distance(const char *word, const char *other) {
    const size_t length = strlen(word);
    const size_t columns = strlen(other);
    if (length > COMMAND_CHOICE_MAX || columns > COMMAND_CHOICE_MAX) {
        return FAR_AWAY;
    }
    if (length >= 3 && strncmp(word, other, length) == 0) {
        return length == columns ? 0 : 1;
    }
    if (length > columns + COMMAND_SLIPS_MAX || columns > length + COMMAND_SLIPS_MAX) {
        return FAR_AWAY;
    }
    return edit_distance(word, length, other, columns);
}
