// SPDX-License-Identifier: Apache-2.0
#include "daemon/cli/shell_completion.h"

#include <stdbool.h>
#include <string.h>

#include "core/invariant.h"

void shell_completion_print(FILE *file, const char *key, const char *part, const char *words) {
    INVARIANT(strchr(key, '\'') == NULL && strchr(words, '\'') == NULL);
    fprintf(file, "_vergence_words['%s%s%s']='%s'\n", key, part != NULL ? " " : "",
            part != NULL ? part : "", words);
}

void shell_completion_add(FILE *file, const char *key, const char *word) {
    INVARIANT(strchr(key, '\'') == NULL && strchr(word, '\'') == NULL);
    fprintf(file, "_vergence_words['%s']+=' %s'\n", key, word);
}

void shell_completion_options(FILE *file, const struct option_page *page) {
    char dashed[64];
    for (unsigned i = 0; i < page->option_count; i++) {
        const struct command_argument *option = &page->options[i];
        const int length = snprintf(dashed, sizeof dashed, "--%s", option->name);
        INVARIANT(length > 0 && (size_t)length < sizeof dashed);
        shell_completion_add(file, page->command, dashed);
        if (option->kind == COMMAND_FLAG) {
            continue;
        }
        // An instrument is completed with the addresses known on this machine.
        const bool address = strcmp(option->name, "connect") == 0;
        shell_completion_print(file, page->command, dashed,
                               option->kind == COMMAND_CHOICE ? option->choices
                               : address                      ? "@addresses"
                                                              : "");
    }
    shell_completion_add(file, page->command, "--help");
}
