// SPDX-License-Identifier: Apache-2.0
/// Lines `key = value`, in sections or not, read by libinih: files of settings, profiles, and saved
/// settings. `#` at the start of a line or after a blank starts a comment, as `;` does in libinih.
#ifndef VERGENCE_DAEMON_SETTINGS_INI_TEXT_H
#define VERGENCE_DAEMON_SETTINGS_INI_TEXT_H

#include <stddef.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Takes one line; `key` is SECTION.KEY in a section, both texts last until it returns. 0, or an
/// error with a message, which ends the reading.
typedef int ini_text_set(void *cookie, const char *key, const char *value, int line,
                         struct message *message);

/// Reads `length` bytes. 0; an error of `set`; ERROR_SYNTAX: not such a line, too long (libinih
/// limits lines to 196 characters unless it is built otherwise), or not a text; ERROR_MISSING: no
/// key or no value; ERROR_MEMORY. After an error the message says what is wrong in line `*line`.
int ini_text_read(const char *text, size_t length, ini_text_set *set, void *cookie, int *line,
                  struct message *message);

#ifdef __cplusplus
}
#endif

#endif
