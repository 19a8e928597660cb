// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/message.h"

#include <stdarg.h>
#include <stdio.h>

int message_set(struct message *message, int code, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(message->text, sizeof message->text, format, arguments);
    va_end(arguments);
    if (length < 0) {
        message->text[0] = '\0';
    }
    for (char *c = message->text; *c != '\0'; c++) {
        if ((unsigned char)*c < ' ' || *c == 0x7f) {
            *c = '?';
        }
    }
    return code;
}
