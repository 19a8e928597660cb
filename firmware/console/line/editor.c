// SPDX-License-Identifier: Apache-2.0
#include "console/line/editor.h"

#include <string.h>

#include "core/invariant.h"

enum { COLUMNS_MIN = 8, ESCAPE_NONE = 0, ESCAPE_BEGUN, ESCAPE_BRACKET, ESCAPE_SS3 };

enum key {
    KEY_CTRL_A = 1,
    KEY_CTRL_B = 2,
    KEY_CTRL_C = 3,
    KEY_CTRL_D = 4,
    KEY_CTRL_E = 5,
    KEY_CTRL_F = 6,
    KEY_BACKSPACE = 8,
    KEY_TAB = 9,
    KEY_LINE_FEED = 10,
    KEY_CTRL_K = 11,
    KEY_CTRL_L = 12,
    KEY_RETURN = 13,
    KEY_CTRL_N = 14,
    KEY_CTRL_P = 16,
    KEY_CTRL_U = 21,
    KEY_CTRL_W = 23,
    KEY_ESCAPE = 27,
    KEY_RUBOUT = 127,
};

void editor_init(struct editor *self, void (*send)(void *, const char *, size_t),
                 void (*complete)(void *, const char *, char *), void *cookie, const char *prompt) {
    memset(self, 0, sizeof *self);
    self->send = send;
    self->complete = complete;
    self->self = cookie;
    self->prompt = prompt;
    self->columns = EDITOR_COLUMNS;
}

static void send_text(struct editor *self, const char *text) {
    self->send(self->self, text, strlen(text));
}

static bool is_later_byte(char c) {
    return ((unsigned char)c & 0xC0) == 0x80;
}

/// Number of characters in a text; each takes one column.
static size_t width_of(const char *text, size_t bytes) {
    size_t width = 0;
    for (size_t i = 0; i < bytes; i++) {
        width += !is_later_byte(text[i]);
    }
    return width;
}

/// The start of the character after or before `at`.
static size_t next_start(const struct editor *self, size_t at) {
    do {
        at++;
    } while (at < self->length && is_later_byte(self->line[at]));
    return at;
}

static size_t previous_start(const struct editor *self, size_t at) {
    do {
        at--;
    } while (at > 0 && is_later_byte(self->line[at]));
    return at;
}

/// Columns after the prompt; the terminal's last one stays free, as writing there may wrap.
static size_t text_columns(const struct editor *self) {
    const size_t taken = width_of(self->prompt, strlen(self->prompt)) + 1;
    return self->columns >= taken + COLUMNS_MIN ? self->columns - taken : COLUMNS_MIN;
}

/// Scrolls so that the cursor is visible and no column is left empty that text could fill.
static void scroll(struct editor *self) {
    if (self->cursor < self->scrolled) {
        self->scrolled = self->cursor;
    }
    while (self->scrolled > 0) {
        const size_t more = previous_start(self, self->scrolled);
        if (width_of(self->line + more, self->length - more) >= text_columns(self)) {
            break;
        }
        self->scrolled = more;
    }
    while (width_of(self->line + self->scrolled, self->cursor - self->scrolled) >=
           text_columns(self)) {
        self->scrolled = next_start(self, self->scrolled);
    }
    INVARIANT(self->scrolled <= self->cursor);
}

static void draw(struct editor *self) {
    scroll(self);
    if (self->drawn > text_columns(self)) {
        self->drawn = text_columns(self);  // the window is narrower now: more blanks would wrap
    }
    size_t end = self->scrolled;
    size_t width = 0;
    while (end < self->length && width < text_columns(self)) {
        end = next_start(self, end);
        width++;
    }
    static const char blanks[] = "                                                                ";
    send_text(self, "\r");
    send_text(self, self->prompt);
    self->send(self->self, self->line + self->scrolled, end - self->scrolled);
    for (size_t left = self->drawn > width ? self->drawn - width : 0; left > 0;) {
        const size_t part = left < sizeof blanks - 1 ? left : sizeof blanks - 1;
        self->send(self->self, blanks, part);
        left -= part;
    }
    send_text(self, "\r");
    send_text(self, self->prompt);
    self->send(self->self, self->line + self->scrolled, self->cursor - self->scrolled);
    self->drawn = width;
}

static void set_line(struct editor *self, const char *text) {
    const size_t length = strlen(text);
    self->length = length < sizeof self->line ? length : sizeof self->line - 1;
    memcpy(self->line, text, self->length);
    self->line[self->length] = '\0';
    self->cursor = self->length;
    self->scrolled = 0;
}

void editor_begin(struct editor *self) {
    set_line(self, "");
    self->browsed = 0;
    self->drawn = 0;
    self->escape = ESCAPE_NONE;
    draw(self);
}

static void bell(struct editor *self) {
    send_text(self, "\a");
}

static void insert(struct editor *self, const char *text, size_t bytes) {
    if (self->length + bytes >= sizeof self->line) {
        bell(self);
        return;
    }
    const bool at_end = self->cursor == self->length;
    memmove(self->line + self->cursor + bytes, self->line + self->cursor,
            self->length - self->cursor + 1);
    memcpy(self->line + self->cursor, text, bytes);
    self->length += bytes;
    self->cursor += bytes;
    // Appending sends one character instead of the whole line: serial lines are slow.
    const size_t width = width_of(self->line + self->scrolled, self->length - self->scrolled);
    if (at_end && width < text_columns(self)) {
        self->send(self->self, text, bytes);
        self->drawn = width;
    } else {
        draw(self);
    }
    INVARIANT(self->cursor <= self->length && self->line[self->length] == '\0');
}

static void erase(struct editor *self, size_t from, size_t to) {
    INVARIANT(from <= to && to <= self->length);
    memmove(self->line + from, self->line + to, self->length - to + 1);
    self->length -= to - from;
    self->cursor = from;
    draw(self);
}

static void erase_word(struct editor *self) {
    size_t from = self->cursor;
    while (from > 0 && self->line[from - 1] == ' ') {
        from--;
    }
    while (from > 0 && self->line[from - 1] != ' ') {
        from--;
    }
    erase(self, from, self->cursor);
}

/// Shows the history line `back` steps ago; 0: the typed line.
static void browse(struct editor *self, size_t back) {
    if (back > self->history_count) {
        bell(self);
        return;
    }
    if (self->browsed == 0) {
        strcpy(self->own, self->line);
    }
    self->browsed = back;
    set_line(self,
             back == 0
                 ? self->own
                 : self->history[(self->history_next + EDITOR_HISTORY - back) % EDITOR_HISTORY]);
    draw(self);
}

static void remember(struct editor *self) {
    const char *last = self->history[(self->history_next + EDITOR_HISTORY - 1) % EDITOR_HISTORY];
    if (self->length == 0 || (self->history_count > 0 && strcmp(last, self->line) == 0)) {
        return;
    }
    strcpy(self->history[self->history_next], self->line);
    self->history_next = (self->history_next + 1) % EDITOR_HISTORY;
    self->history_count += self->history_count < EDITOR_HISTORY;
}

/// Start of the word that the cursor is in or behind.
static size_t word_start(const struct editor *self) {
    size_t start = self->cursor;
    while (start > 0 && self->line[start - 1] != ' ') {
        start--;
    }
    return start;
}

/// Keeps those of `words` that begin with `begun`; returns their number and, in `shared`, the
/// length of their common prefix.
static size_t keep_matching(char *words, const char *begun, size_t begun_bytes, size_t *shared) {
    size_t count = 0;
    size_t kept = 0;
    size_t bytes = 0;
    for (const char *word = words; *word != '\0'; word += bytes + (word[bytes] == ' ')) {
        bytes = strcspn(word, " ");
        if (bytes < begun_bytes || bytes == 0 || memcmp(word, begun, begun_bytes) != 0) {
            continue;
        }
        size_t same = 0;
        while (count > 0 && same < bytes && same < *shared && words[same] == word[same]) {
            same++;
        }
        *shared = count == 0 ? bytes : same;
        memmove(words + kept, word, bytes);
        kept += bytes;
        words[kept++] = ' ';
        count++;
    }
    words[kept > 0 ? kept - 1 : 0] = '\0';
    return count;
}

static void complete(struct editor *self) {
    char typed[EDITOR_LINE_BYTES];
    // One more byte for the blank after the last word.
    char words[EDITOR_WORDS_BYTES + 1] = "";
    const size_t start = word_start(self);
    const size_t begun = self->cursor - start;
    if (self->complete == NULL) {
        bell(self);
        return;
    }
    memcpy(typed, self->line, self->cursor);
    typed[self->cursor] = '\0';
    self->complete(self->self, typed, words);
    size_t shared = 0;
    const size_t count = keep_matching(words, self->line + start, begun, &shared);
    INVARIANT(count == 0 || shared >= begun);
    if (count == 0) {
        bell(self);
    } else if (count == 1) {
        INVARIANT(shared > 0);
        const bool whole = words[shared - 1] != '/' && words[shared - 1] != '=';
        words[shared] = ' ';
        insert(self, words + begun, shared - begun + whole);
    } else if (shared > begun) {
        insert(self, words + begun, shared - begun);
    } else {
        send_text(self, "\r\n");
        send_text(self, words);
        send_text(self, "\r\n");
        self->drawn = 0;
        draw(self);
    }
}

static void move(struct editor *self, size_t cursor) {
    if (cursor == self->cursor) {
        bell(self);
        return;
    }
    self->cursor = cursor;
    draw(self);
}

/// Executes a cursor key, given by the final letter of its escape sequence or its control key.
static void motion(struct editor *self, char letter) {
    switch (letter) {
        case 'A':
            browse(self, self->browsed + 1);
            break;
        case 'B':
            if (self->browsed == 0) {
                bell(self);
            } else {
                browse(self, self->browsed - 1);
            }
            break;
        case 'C':
            move(self, self->cursor < self->length ? next_start(self, self->cursor) : self->cursor);
            break;
        case 'D':
            move(self, self->cursor > 0 ? previous_start(self, self->cursor) : 0);
            break;
        case 'H':
            move(self, 0);
            break;
        case 'F':
            move(self, self->length);
            break;
        default:
            break;
    }
}

static void erase_next(struct editor *self) {
    if (self->cursor < self->length) {
        erase(self, self->cursor, next_start(self, self->cursor));
    } else {
        bell(self);
    }
}

/// Executes the key ESC [ `parameter` ~ of the VT220.
static void edit_key(struct editor *self, char parameter) {
    switch (parameter) {
        case '1':
        case '7':
            motion(self, 'H');
            break;
        case '4':
        case '8':
            motion(self, 'F');
            break;
        case '3':
            erase_next(self);
            break;
        default:
            break;
    }
}

/// Processes a byte of an escape sequence (ECMA-48: ESC [ parameters letter; ESC O letter).
static void feed_escape(struct editor *self, char byte) {
    if (self->escape == ESCAPE_BEGUN) {
        self->escape = byte == 'O' ? ESCAPE_SS3 : ESCAPE_NONE;
        if (byte == '[') {
            self->escape = ESCAPE_BRACKET;
        }
        self->parameter = '\0';
        return;
    }
    if (self->escape == ESCAPE_BRACKET && byte >= 0x20 && byte <= 0x3F) {
        self->parameter = self->parameter == '\0' ? byte : self->parameter;
        return;
    }
    self->escape = ESCAPE_NONE;
    if (byte == '~') {
        edit_key(self, self->parameter);
    } else {
        motion(self, byte);
    }
}

/// Executes an editing control character.
static void feed_control(struct editor *self, char byte) {
    static const char motions[][2] = {{KEY_CTRL_A, 'H'}, {KEY_CTRL_B, 'D'}, {KEY_CTRL_E, 'F'},
                                      {KEY_CTRL_F, 'C'}, {KEY_CTRL_N, 'B'}, {KEY_CTRL_P, 'A'}};
    for (size_t i = 0; i < sizeof motions / sizeof motions[0]; i++) {
        if (byte == motions[i][0]) {
            motion(self, motions[i][1]);
            return;
        }
    }
    switch (byte) {
        case KEY_BACKSPACE:
        case KEY_RUBOUT:
            if (self->cursor > 0) {
                erase(self, previous_start(self, self->cursor), self->cursor);
            } else {
                bell(self);
            }
            break;
        case KEY_CTRL_D:
            erase_next(self);
            break;
        case KEY_CTRL_K: {
            const size_t cursor = self->cursor;
            erase(self, cursor, self->length);
            break;
        }
        case KEY_CTRL_U:
            erase(self, 0, self->cursor);
            break;
        case KEY_CTRL_W:
            erase_word(self);
            break;
        case KEY_CTRL_L:
            send_text(self, "\r\n");
            self->drawn = 0;
            draw(self);
            break;
        case KEY_TAB:
            complete(self);
            break;
        default:
            break;
    }
}

enum editor_event editor_feed(struct editor *self, char byte) {
    const bool after_return = self->after_return;
    self->after_return = byte == KEY_RETURN;
    // These abort an escape sequence, so that garbage cannot block the user.
    if (byte == KEY_CTRL_C) {
        self->escape = ESCAPE_NONE;
        send_text(self, "^C\r\n");
        set_line(self, "");
        return EDITOR_CANCEL;
    }
    if (byte == KEY_RETURN || byte == KEY_LINE_FEED) {
        if (byte == KEY_LINE_FEED && after_return) {
            return EDITOR_MORE;
        }
        self->escape = ESCAPE_NONE;
        send_text(self, "\r\n");
        remember(self);
        return EDITOR_LINE;
    }
    if (byte == KEY_ESCAPE) {
        self->escape = ESCAPE_BEGUN;
    } else if (self->escape != ESCAPE_NONE) {
        feed_escape(self, byte);
    } else if (byte == KEY_CTRL_D && self->length == 0) {
        return EDITOR_END;
    } else if ((unsigned char)byte < ' ' || byte == KEY_RUBOUT) {
        feed_control(self, byte);
    } else {
        insert(self, &byte, 1);
    }
    return EDITOR_MORE;
}
