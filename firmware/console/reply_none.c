// SPDX-License-Identifier: Apache-2.0
#include "console/reply_none.h"

#include <stddef.h>

static void no_number(void *self, const char *key, double value, int decimals, const char *unit) {
    (void)self, (void)key, (void)value, (void)decimals, (void)unit;
}
static void no_text(void *self, const char *key, const char *value) {
    (void)self, (void)key, (void)value;
}
static void no_begin(void *self, const char *key, bool array) {
    (void)self, (void)key, (void)array;
}
static void no_end(void *self) {
    (void)self;
}

const struct command_reply *reply_none(void) {
    static const struct command_reply_operations operations = {no_number, no_text, no_begin,
                                                               no_end};
    static const struct command_reply reply = {&operations, NULL};
    return &reply;
}
