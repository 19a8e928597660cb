// SPDX-License-Identifier: Apache-2.0
/// "Did you mean": the word of a list that is most similar to a mistyped one.
#ifndef VERGENCE_CORE_SUGGEST_H
#define VERGENCE_CORE_SUGGEST_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { SUGGEST_WORD_MAX = 32, SUGGEST_TEXT_BYTES = SUGGEST_WORD_MAX + 24 };

struct suggest {
    const char *typed;
    const char *prefix;  ///< prefix of the proposed word, such as "--"; not compared
    int distance;
    char text[SUGGEST_TEXT_BYTES];  ///< ` (did you mean "zoom"?)`; "": no word is similar
};

/// Begins a search; both texts must remain valid. `prefix`: at most two characters.
void suggest_begin(struct suggest *self, const char *typed, const char *prefix);

/// Considers a word of the list. Similar are words of which the typed one is the beginning (three
/// letters or more), and those with at most two wrong letters and half of the letters right. Words
/// of more than SUGGEST_WORD_MAX letters are ignored.
void suggest_consider(struct suggest *self, const char *word);

/// Considers each of the words in a list separated by blanks.
void suggest_consider_all(struct suggest *self, const char *words);

#ifdef __cplusplus
}
#endif

#endif
