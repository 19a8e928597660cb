// SPDX-License-Identifier: Apache-2.0
#include "console/line/completion.h"

#include <string.h>

#include "console/command_text.h"
#include "console/command_words.h"

/// The list under construction; `begun`: the last word of the line.
struct list {
    struct command_text text;
    const char *begun;
    const struct command_table *table;
    const void *context;
};

static void add(void *cookie, const char *word) {
    struct list *self = cookie;
    const size_t length = strlen(word);
    if (strncmp(word, self->begun, strlen(self->begun)) != 0 || length == 0 ||
        word[strcspn(word, " \t\"#")] != '\0' ||
        self->text.length + length + 2 > self->text.bytes) {
        return;
    }
    command_text_add(&self->text, self->text.length > 0 ? " " : "");
    command_text_add(&self->text, word);
}

/// Adds the values of an argument, each after `before`: "side=" of an option.
static void add_values(const struct command_argument *argument, const char *before,
                       const struct command_words *words, struct list *list) {
    char word[COMMAND_CHOICE_MAX];
    const char *choices = argument->kind == COMMAND_FLAG ? "yes" : argument->choices;
    for (int i = 0; choices != NULL && command_words_choice_at(choices, i, word); i++) {
        char whole[2 * COMMAND_CHOICE_MAX];
        struct command_text text = command_text_begin(whole, sizeof whole);
        command_text_add(&text, before);
        command_text_add(&text, word);
        add(list, whole);
    }
    if (choices == NULL && argument->candidates != NULL) {
        const struct command_candidates candidates = {.begun = list->begun,
                                                      .words = words->word,
                                                      .count = words->count,
                                                      .context = list->context,
                                                      .table = *list->table,
                                                      .add = add,
                                                      .self = list};
        argument->candidates(&candidates);
    }
}

/// Adds what may follow the words: the next operand, and options.
static void add_arguments(const struct command *command, const struct command_words *words,
                          struct list *list) {
    const struct command_parser parser = {.command = command->name, .dashes = ""};
    size_t operands = 0;
    for (size_t i = 1; i < words->count; i++) {
        operands += (words->quoted >> i & 1) != 0 || !command_is_option(&parser, words->word[i]);
    }
    for (unsigned i = 0; i < command->argument_count; i++) {
        const struct command_argument *argument = &command->arguments[i];
        if (!command_argument_is_option(argument)) {
            if (operands-- == 0) {
                add_values(argument, "", words, list);
            }
            continue;
        }
        char name[COMMAND_CHOICE_MAX + 2];
        struct command_text text = command_text_begin(name, sizeof name);
        command_text_add(&text, argument->name);
        command_text_add(&text, "=");
        if (strncmp(list->begun, name, strlen(name)) == 0) {
            add_values(argument, name, words, list);
        } else {
            add(list, name);
        }
    }
}

void completion_words(const struct command_table *table, const void *context, const char *typed,
                      char *words, size_t bytes) {
    struct list list = {command_text_begin(words, bytes), typed, table, context};
    char before[COMMAND_LINE_MAX + 1];
    char storage[COMMAND_LINE_MAX + 1];
    struct command_words found;
    const char *why = NULL;
    const char *blank = strrchr(typed, ' ');
    const size_t before_bytes = blank == NULL ? 0 : (size_t)(blank + 1 - typed);
    list.begun += before_bytes;
    if (before_bytes >= sizeof before) {
        return;
    }
    memcpy(before, typed, before_bytes);
    before[before_bytes] = '\0';
    if (command_words_split(before, storage, &found, &why) != 0) {
        return;
    }
    if (found.count == 0) {
        for (size_t i = 0; i < table->count; i++) {
            add(&list, table->rows[i].name);
        }
        return;
    }
    const struct command *command = command_find(table->rows, table->count, found.word[0]);
    if (command != NULL) {
        add_arguments(command, &found, &list);
    }
}
