// SPDX-License-Identifier: Apache-2.0
/// A line editor for terminals: cursor keys, history, completion. It sends only characters, CR, LF,
/// BEL and backspaces, so it works on any terminal, including dumb ones; lines wider than the
/// terminal scroll. It uses no files and never blocks: bytes in, bytes out.
///
/// Keys: left, right, Home, End (Ctrl-B, F, A, E), up, down (Ctrl-P, N), Backspace, Delete, Ctrl-K
/// and Ctrl-U (delete to the end, to the start), Ctrl-W (delete the previous word), Ctrl-L
/// (redraw), Tab, Ctrl-C (discard the line), Ctrl-D (end, on an empty line).
#ifndef VERGENCE_CONSOLE_LINE_EDITOR_H
#define VERGENCE_CONSOLE_LINE_EDITOR_H

#include <stdbool.h>
#include <stddef.h>

#include "console/line/progress_bar.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    EDITOR_LINE_BYTES = 600,
    EDITOR_HISTORY = 64,
    EDITOR_WORDS_BYTES = 4096,
    EDITOR_COLUMNS = SCREEN_COLUMNS,
};

enum editor_event {
    EDITOR_MORE,
    EDITOR_LINE,    ///< `line` is complete; editor_begin starts the next
    EDITOR_CANCEL,  ///< Ctrl-C: the line is now empty; editor_begin draws a new one
    EDITOR_END,     ///< Ctrl-D on an empty line
};

struct editor {
    /// Sends bytes to the terminal.
    void (*send)(void *self, const char *data, size_t bytes);
    /// Puts the completions of `typed` (the line up to the cursor), separated by blanks, into
    /// `words` (EDITOR_WORDS_BYTES). A completion that ends in / or = is not finished. NULL: no
    /// completion.
    void (*complete)(void *self, const char *typed, char *words);
    void *self;
    const char *prompt;
    size_t columns;

    char line[EDITOR_LINE_BYTES];  ///< terminated
    size_t length, cursor;
    size_t scrolled;  ///< bytes of the line that are scrolled off to the left
    size_t drawn;     ///< columns in use behind the prompt
    char history[EDITOR_HISTORY][EDITOR_LINE_BYTES];
    size_t history_count, history_next;
    size_t browsed;               ///< position in the history, counted back; 0: the typed line
    char own[EDITOR_LINE_BYTES];  ///< the typed line, while the history is browsed
    int escape;                   ///< state of the escape sequence parser
    char parameter;
    bool after_return;  ///< a CR came last, so a LF belongs to it
};

/// Stores the arguments and clears the history.
void editor_init(struct editor *self, void (*send)(void *, const char *, size_t),
                 void (*complete)(void *, const char *, char *), void *cookie, const char *prompt);

/// Draws the prompt and an empty line.
void editor_begin(struct editor *self);

/// Processes one byte from the terminal.
enum editor_event editor_feed(struct editor *self, char byte);

#ifdef __cplusplus
}
#endif

#endif
