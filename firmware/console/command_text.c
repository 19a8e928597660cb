// SPDX-License-Identifier: Apache-2.0
#include "console/command_text.h"

#include <stdarg.h>
#include <stdbool.h>

#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/utf8.h"

enum { TYPED_MAX = 40 };

struct command_text command_text_begin(char *data, size_t bytes) {
    INVARIANT(data != NULL && bytes > 0);
    data[0] = '\0';
    return (struct command_text){data, bytes, 0};
}

static void add_character(struct command_text *text, char added) {
    INVARIANT(text->length < text->bytes);
    if (text->length + 1 < text->bytes) {
        text->data[text->length++] = added;
        text->data[text->length] = '\0';
    }
}

void command_text_add(struct command_text *text, const char *added) {
    INVARIANT(added != NULL);
    for (const char *at = added; *at != '\0'; at++) {
        add_character(text, *at);
    }
}

static void add_digits(struct command_text *text, uint32_t value, int digits, const char *digit) {
    for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) {
        add_character(text, digit[(value >> shift) & 15]);
    }
}

void command_text_add_all(struct command_text *text, ...) {
    va_list strings;
    va_start(strings, text);
    for (const char *added = va_arg(strings, const char *); added != NULL;
         added = va_arg(strings, const char *)) {
        command_text_add(text, added);
    }
    va_end(strings);
}

void command_text_add_typed(struct command_text *text, const char *added) {
    INVARIANT(added != NULL);
    for (size_t i = 0; added[i] != '\0'; i++) {
        // Does not split a multi-byte character: its later bytes begin with the bits 10.
        if (i >= TYPED_MAX && ((unsigned char)added[i] & 0xC0) != 0x80) {
            command_text_add(text, "...");
            return;
        }
        const bool control = (unsigned char)added[i] < ' ' || added[i] == 0x7F;
        add_character(text, control ? '?' : added[i]);
    }
}

int command_text_decimals(double size) {
    if (size < 1) {
        return 3;
    }
    if (size < 10) {
        return 2;
    }
    return size < 100 ? 1 : 0;
}

void command_text_add_number(struct command_text *text, double value, int decimals) {
    INVARIANT(decimals >= 0 && decimals <= COMMAND_TEXT_DECIMALS_MAX);
    int64_t scaled = 0;
    // A large number leaves no room for all decimals.
    while (decimals > 0 && decimal_from_double(value, decimals, &scaled) != ERROR_OK) {
        decimals--;
    }
    if (decimal_from_double(value, decimals, &scaled) != ERROR_OK) {
        command_text_add(text, "?");
        return;
    }
    while (decimals > 0 && scaled % 10 == 0) {
        scaled /= 10;
        decimals--;
    }
    char digits[DECIMAL_TEXT_BYTES];
    decimal_print(scaled, decimals, digits);
    command_text_add(text, digits);
}

void command_text_add_integer(struct command_text *text, int64_t value) {
    char digits[DECIMAL_TEXT_BYTES];
    decimal_print_integer(value, digits);
    command_text_add(text, digits);
}

void command_text_add_unit(struct command_text *text, const char *unit) {
    if (unit != NULL) {
        command_text_join(text, " ", unit);
    }
}

// The decimals that a conversion asks for; leaves `format` behind them.
static int take_decimals(const char **format, va_list *values) {
    int decimals = 0;
    if (**format != '.') {
        return decimals;
    }
    if (*++*format == '*') {
        ++*format;
        return va_arg(*values, int);
    }
    for (; **format >= '0' && **format <= '9'; ++*format) {
        decimals = 10 * decimals + (**format - '0');
    }
    return decimals;
}

static void print_double(struct command_text *text, double value, int decimals) {
    char digits[DECIMAL_TEXT_BYTES];
    decimal_print_double(value, decimals, digits);
    command_text_add(text, digits);
}

static void print(struct command_text *text, const char *format, va_list *values) {
    while (*format != '\0') {
        if (*format != '%') {
            add_character(text, *format++);
            continue;
        }
        format++;
        const int digits = *format == '0' ? format[1] - '0' : 1;
        format += *format == '0' ? 2 : 0;
        const int decimals = take_decimals(&format, values);
        switch (*format++) {
            case 's':
                command_text_add(text, va_arg(*values, const char *));
                break;
            case 'd':
                command_text_add_integer(text, va_arg(*values, int));
                break;
            case 'u':
                command_text_add_integer(text, va_arg(*values, unsigned));
                break;
            case 'x':
                add_digits(text, va_arg(*values, unsigned), digits, "0123456789abcdef");
                break;
            case 'f':
                print_double(text, va_arg(*values, double), decimals);
                break;
            default:
                INVARIANT(format[-1] == '%');
                add_character(text, '%');
        }
    }
}

void command_text_print_list(struct command_text *text, const char *format, va_list values) {
    va_list own;
    va_copy(own, values);
    print(text, format, &own);
    va_end(own);
}

void command_text_print(struct command_text *text, const char *format, ...) {
    va_list values;
    va_start(values, format);
    print(text, format, &values);
    va_end(values);
}

int command_text_message(struct message *message, int code, const char *format, ...) {
    struct command_text text = command_text_begin(message->text, sizeof message->text);
    va_list values;
    va_start(values, format);
    print(&text, format, &values);
    va_end(values);
    utf8_mask_controls(message->text);
    return code;
}

void command_text_add_hex(struct command_text *text, uint32_t value, int digits) {
    INVARIANT(digits >= 1 && digits <= 8);
    command_text_add(text, "0x");
    add_digits(text, value, digits, "0123456789ABCDEF");
}
