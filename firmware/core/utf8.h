// SPDX-License-Identifier: Apache-2.0
/// UTF-8 text, and text from elsewhere (another program, a file, a name) for terminals: control
/// characters, and those that turn the direction of writing, never reach a terminal.
#ifndef VERGENCE_CORE_UTF8_H
#define VERGENCE_CORE_UTF8_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// The UTF-8 character (RFC 3629) at the start of a text; returns its length, 0: not valid UTF-8.
size_t utf8_character(const char *text, uint32_t *character);

/// A control character, also one that turns the direction of writing (Unicode UAX 9), as the text
/// after it would be shown in another order than it has, and separators of lines and paragraphs.
bool utf8_is_control(uint32_t character);

/// Copies as much of a text as fits into `bytes` (> 0), terminated, with ? in place of each byte of
/// such a character and each that is not UTF-8.
void utf8_copy_printable(const char *text, char *to, size_t bytes);

/// Puts ? in place of each byte of a control character; bytes that are not UTF-8 stay.
void utf8_mask_controls(char *text);

/// Number of printable bytes at the start of a text, in whole characters.
size_t utf8_count_printable(const char *text);

#ifdef __cplusplus
}
#endif

#endif
