// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <string.h>

#include "console/command_text.h"
#include "console/command_words.h"
#include "daemon/server/server.h"

/// The list under construction; `begun`: the last word of the line.
struct list {
    struct command_text text;
    const char *begun;
};

static void add(void *cookie, const char *word) {
    struct list *self = cookie;
    const size_t length = strlen(word);
    if (strncmp(word, self->begun, strlen(self->begun)) != 0 || length == 0 ||
        strpbrk(word, " \t\"#") != NULL || self->text.length + length + 2 > self->text.bytes) {
        return;
    }
    command_text_add(&self->text, self->text.length > 0 ? " " : "");
    command_text_add(&self->text, word);
}

static void add_choices(struct list *list, const char *choices) {
    char word[COMMAND_CHOICE_MAX];
    for (int i = 0; command_words_choice_at(choices, i, word); i++) {
        add(list, word);
    }
}

void completion_candidates(const struct daemon *daemon, const char *typed, char *words,
                           size_t bytes) {
    struct list list = {command_text_begin(words, bytes), typed};
    char before[COMMAND_LINE_MAX + 1];
    char storage[COMMAND_LINE_MAX + 1];
    const char *found[COMMAND_WORDS_MAX];
    size_t count = 0;
    const char *why = NULL;
    const char *blank = strrchr(typed, ' ');
    const size_t before_bytes = blank == NULL ? 0 : (size_t)(blank + 1 - typed);
    list.begun += before_bytes;
    if (before_bytes >= sizeof before) {
        return;
    }
    memcpy(before, typed, before_bytes);
    before[before_bytes] = '\0';
    if (command_words_split(before, storage, found, &count, &why) != 0) {
        return;
    }
    if (count == 0) {
        for (size_t i = 0; i < daemon->table_count; i++) {
            add(&list, daemon->table[i].name);
        }
        return;
    }
    const struct command *command = command_find(daemon->table, daemon->table_count, found[0]);
    if (command == NULL || count > command->argument_count) {
        return;
    }
    const struct command_argument *argument = &command->arguments[count - 1];
    const struct command_candidates candidates = {list.begun, found, count, daemon, add, &list};
    if (argument->kind == COMMAND_CHOICE) {
        add_choices(&list, argument->choices);
    } else if (argument->candidates != NULL) {
        argument->candidates(&candidates);
    }
}
