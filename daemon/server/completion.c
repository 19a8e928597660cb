// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/completion.h"

#include <stdio.h>
#include <string.h>

#include "rig/command_text.h"
#include "rig/command_words.h"

static void add_names(const struct command *table, size_t count, struct command_text *list) {
    for (size_t i = 0; i < count; i++) {
        command_text_add(list, i > 0 ? " " : "");
        command_text_add(list, table[i].name);
    }
}

void completion_words(const struct command *table, size_t count, const char *before, char *words,
                      size_t bytes) {
    struct command_text list = command_text_begin(words, bytes);
    char storage[COMMAND_LINE_MAX + 1];
    const char *found[COMMAND_WORDS_MAX];
    size_t word_count = 0;
    const char *why = NULL;
    if (command_words_split(before, storage, found, &word_count, &why) != 0) {
        return;
    }
    if (word_count == 0 || (word_count == 1 && strcmp(found[0], "help") == 0)) {
        add_names(table, count, &list);
        return;
    }
    const struct command *command = command_find(table, count, found[0]);
    const size_t place = word_count - 1;
    if (command != NULL && place < command->argument_count &&
        command->arguments[place].kind == COMMAND_CHOICE) {
        command_text_add(&list, command->arguments[place].choices);
    }
}
