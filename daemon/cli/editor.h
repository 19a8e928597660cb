// SPDX-License-Identifier: Apache-2.0
/// A line editor for terminals: cursor keys, history, completion. It sends nothing but characters,
/// CR, LF, BEL and backspaces, so it works on any terminal, a dumb one too; lines longer than the
/// terminal is wide are scrolled. It keeps no file and waits for nothing: bytes in, bytes out.
///
/// Keys: left, right, Home, End (Ctrl-B, F, A, E), up, down (Ctrl-P, N), Backspace, Delete, Ctrl-K
/// and Ctrl-U (delete to the end, all before), Ctrl-W (the word before), Ctrl-L (draw again), Tab,
/// Ctrl-C (give the line up), Ctrl-D (the end, on an empty line).
#ifndef VERGENCE_DAEMON_CLI_EDITOR_H
#define VERGENCE_DAEMON_CLI_EDITOR_H

#include <stdbool.h>
#include <stddef.h>

#include "daemon/cli/screen.h"

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
    EDITOR_LINE,    ///< `line` is whole; editor_begin begins the next
    EDITOR_CANCEL,  ///< Ctrl-C: the line is empty now; editor_begin draws a new one
    EDITOR_END,     ///< Ctrl-D on an empty line
};

struct editor {
    /// Bytes for the terminal.
    void (*send)(void *self, const char *data, size_t bytes);
    /// The words that may stand where `typed`, the line up to the cursor, ends, with blanks
    /// between, in `words` (EDITOR_WORDS_BYTES). One that ends in / is to be gone on with. NULL: no
    /// completion.
    void (*complete)(void *self, const char *typed, char *words);
    void *self;
    const char *prompt;
    size_t columns;

    char line[EDITOR_LINE_BYTES];  ///< terminated
    size_t length, cursor;
    size_t scrolled;  ///< bytes of the line left of the screen
    size_t drawn;     ///< columns in use behind the prompt
    char history[EDITOR_HISTORY][EDITOR_LINE_BYTES];
    size_t history_count, history_next;
    size_t browsed;               ///< how far back the line comes from; 0: typed
    char own[EDITOR_LINE_BYTES];  ///< what was typed before
    int escape;                   ///< how much of an escape sequence has come
    char parameter;
    bool after_return;  ///< a LF that follows is none of its own
};

/// Stores what is given; the history is empty.
void editor_init(struct editor *self, void (*send)(void *, const char *, size_t),
                 void (*complete)(void *, const char *, char *), void *cookie, const char *prompt);

/// Draws an empty line behind the prompt.
void editor_begin(struct editor *self);

/// Takes a byte from the terminal.
enum editor_event editor_feed(struct editor *self, char byte);

#ifdef __cplusplus
}
#endif

#endif
