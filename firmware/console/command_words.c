// SPDX-License-Identifier: Apache-2.0
#include "console/command_words.h"

#include <string.h>

#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"

// Digits that count; larger numbers are multiplied by up to so many tens, so that they stay finite.
enum { NUMBER_DIGITS_MAX = 15, NUMBER_TENS_MAX = 250 };

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
    return ERROR_OK;
}

static const char *after_sign(const char *word) {
    return word + (*word == '-' || *word == '+');
}

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

/// A decimal number while its characters are read.
struct decimal {
    int64_t scaled;
    int digits, decimals, tens;  ///< digits that count; digits after the point; tens to multiply by
    bool point;
};

/// Takes the next character; false: it does not belong to a number.
static bool take_character(struct decimal *self, char next) {
    if (next == '.' && !self->point) {
        self->point = true;
        return true;
    }
    if (!is_digit(next)) {
        return false;
    }
    if (self->digits == NUMBER_DIGITS_MAX) {
        self->tens += !self->point && self->tens < NUMBER_TENS_MAX;
        return true;
    }
    self->scaled = self->scaled * 10 + (next - '0');
    self->digits += self->digits > 0 || next != '0' || self->point;
    self->decimals += self->point;
    return true;
}

/// Reads all of `length` characters as a decimal number.
static bool read_decimal(const char *word, size_t length, double *value) {
    const bool negative = length > 0 && *word == '-';
    struct decimal read = {.scaled = 0};
    if (length == 0 || !is_digit(word[length - 1])) {
        return false;
    }
    for (size_t i = negative || *word == '+'; i < length; i++) {
        if (!take_character(&read, word[i])) {
            return false;
        }
    }
    INVARIANT(read.scaled >= 0 && read.scaled <= DECIMAL_MAX);
    *value = decimal_to_double(negative ? -read.scaled : read.scaled, read.decimals);
    for (; read.tens > 0; read.tens--) {
        *value *= 10;
    }
    return true;
}

bool command_words_number(const char *word, double *value) {
    return read_decimal(word, strlen(word), value);
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

// ---- numbers with units

/// Units of a kind stand for each other.
static const struct {
    const char *name;
    char kind;
    double size;
} units[] = {
    {"um", 'l', 1e-3},
    {"mm", 'l', 1},
    {"cm", 'l', 10},
    {"m", 'l', 1e3},
    {"km", 'l', 1e6},
    {"us", 't', 1},
    {"ms", 't', 1e3},
    {"s", 't', 1e6},
    {"min", 't', 60e6},
    {"Hz", 'f', 1},
    {"kHz", 'f', 1e3},
    {"MHz", 'f', 1e6},
    {"mrad", 'a', 180 / 3141.592653589793},
    {"deg", 'a', 1},
    {"rad", 'a', 180 / 3.141592653589793},
    {"counts", 'p', 1},
    {"steps", 'p', 1},
};

/// The size of a unit within its kind; 0: it stands for itself alone.
static double size_of(const char *unit, char *kind) {
    for (size_t i = 0; i < sizeof units / sizeof units[0]; i++) {
        if (strcmp(units[i].name, unit) == 0) {
            *kind = units[i].kind;
            return units[i].size;
        }
    }
    *kind = '\0';
    return 0;
}

/// How many `to` a `from` is; 0: they are of different kinds.
static double ratio_of(const char *from, const char *to) {
    char kind = '\0', other = '\0';
    const double size = size_of(from, &kind), own = size_of(to, &other);
    if (strcmp(from, to) == 0) {
        return 1;
    }
    return size > 0 && kind == other ? size / own : 0;
}

int command_words_unit(const char *unit, const char *accepted, double *ratio) {
    char own[COMMAND_CHOICE_MAX];
    for (int i = 0;
         accepted != NULL && *accepted != '\0' && command_words_choice_at(accepted, i, own); i++) {
        *ratio = ratio_of(unit, own);
        if (*ratio > 0) {
            return i;
        }
    }
    return -1;
}

/// Whether a text has the form of a unit behind its number, such as "m", "deg/s" or "%"; "" has.
static bool is_unit(const char *text) {
    const size_t length = strcspn(text, " \t0123456789.,:;+-#\"\\");
    return length == 0 ? *text == '\0'
                       : text[length] == '\0' && text[0] != '/' && text[length - 1] != '/';
}

/// Reads "100" or, of a time, "1/100".
static bool read_ratio(const char *word, size_t length, double *value) {
    const char *slash = memchr(word, '/', length);
    const size_t upper = slash != NULL ? (size_t)(slash - word) : length;
    double lower = 1;
    const bool valid = read_decimal(word, upper, value) &&
                       (slash == NULL || read_decimal(slash + 1, length - upper - 1, &lower)) &&
                       lower > 0;
    *value = valid ? *value / lower : 0;
    return valid;
}

/// Whether numbers in the first of these units are times.
static bool are_times(const char *accepted) {
    char first[COMMAND_CHOICE_MAX];
    char kind = '\0';
    return accepted != NULL && *accepted != '\0' && command_words_choice_at(accepted, 0, first) &&
           size_of(first, &kind) > 0 && kind == 't';
}

/// Converts a number from the unit that was typed to the accepted one of its kind.
static enum command_quantity convert(const char *unit, const char *accepted,
                                     struct command_number *number) {
    double ratio = 1;
    number->unit = command_words_unit(unit, accepted, &ratio);
    number->converted = number->converted || ratio != 1;
    number->value *= ratio;
    return number->unit >= 0 ? COMMAND_QUANTITY_READ : COMMAND_QUANTITY_UNKNOWN_UNIT;
}

/// Reads the number of a text, and finds its unit ("": none). False: it has not that form.
static bool split_quantity(const char *text, struct command_number *number, const char **unit) {
    const bool leads = (text[0] == 'f' || text[0] == 'F') && text[1] == '/';
    const char *begin = text + (leads ? 2 : 0);
    const size_t length = strspn(begin, "+-./0123456789");
    const char *rest = begin + length + strspn(begin + length, " \t");
    *unit = leads ? "f/" : rest;
    *number = (struct command_number){.stated = **unit != '\0',
                                      .converted = memchr(begin, '/', length) != NULL};
    return read_ratio(begin, length, &number->value) && (leads ? *rest == '\0' : is_unit(rest));
}

enum command_quantity command_words_quantity(const char *text, const char *accepted,
                                             struct command_number *number) {
    const char *unit = NULL;
    const bool valid = split_quantity(text, number, &unit);
    const bool fraction = number->converted;
    if (!valid || (fraction && !are_times(accepted))) {
        return COMMAND_QUANTITY_NO_NUMBER;
    }
    if (number->stated) {
        return convert(unit, accepted, number);
    }
    // As on a camera's dial, a fraction without a unit is one of a second.
    return fraction ? convert("s", accepted, number) : COMMAND_QUANTITY_READ;
}
