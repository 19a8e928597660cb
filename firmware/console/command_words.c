// SPDX-License-Identifier: Apache-2.0
#include "console/command_words.h"

#include <string.h>

#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"

enum { NUMBER_DIGITS_MAX = 15 };

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

/// Copies a word up to the next blank; `*at` is on its first character, and on return behind it.
static bool copy_plain(const char **at, char **to) {
    while (**at != '\0' && !is_blank(**at)) {
        const bool value = **at == '"' && (*at)[-1] == '=';
        if (value) {
            (*at)++;
            return copy_quoted(at, to);
        }
        *(*to)++ = *(*at)++;
    }
    return true;
}

int command_words_split(const char *line, char *storage, struct command_words *words,
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
    words->count = 0;
    words->quoted = 0;
    for (const char *at = line;;) {
        at += strspn(at, " \t");
        if (*at == '\0' || *at == '#') {
            break;
        }
        const char *word = to;
        const bool quoted = *at == '"';
        at += quoted;
        if (!(quoted ? copy_quoted(&at, &to) : copy_plain(&at, &to))) {
            *why = "unterminated quote (a word that begins with \" must end with it)";
            return ERROR_SYNTAX;
        }
        *to++ = '\0';
        if (words->count == COMMAND_WORDS_MAX) {
            *why = "the line has more than 24 words";
            return ERROR_SYNTAX;
        }
        words->quoted |= (uint32_t)quoted << words->count;
        words->word[words->count++] = word;
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

int command_words_unit(const char *word, const char *units, char *number, size_t bytes) {
    char unit[COMMAND_CHOICE_MAX];
    const size_t length = strlen(word);
    for (int i = 0; command_words_choice_at(units, i, unit); i++) {
        const size_t of_unit = strlen(unit);
        if (length <= of_unit || length - of_unit >= bytes) {
            continue;
        }
        const bool leads = unit[of_unit - 1] == '/';
        if (strncmp(leads ? word : word + length - of_unit, unit, of_unit) == 0) {
            memcpy(number, leads ? word + of_unit : word, length - of_unit);
            number[length - of_unit] = '\0';
            return i;
        }
    }
    return -1;
}
