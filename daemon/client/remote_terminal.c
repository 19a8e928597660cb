// SPDX-License-Identifier: Apache-2.0
// Interactive use at a terminal of the PC: line editing here, commands on the instrument.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/message.h"
#include "daemon/cli/editor.h"
#include "daemon/cli/exit_code.h"
#include "daemon/cli/screen.h"
#include "daemon/client/remote.h"

enum { AHEAD_BYTES = 65536, CTRL_C = 3, BELL = 7 };

struct terminal {
    struct remote *remote;
    struct editor editor;
    char ahead[AHEAD_BYTES];  ///< typed ahead, not yet processed
    size_t ahead_begin, ahead_end;
    bool input_paused;  ///< overflow: input is discarded up to the end of a line
    bool ended, broken;
};

static struct terminal *terminal_of_attention;

/// Reads keys. Ctrl-C discards what was typed ahead; while a command runs it cancels on the
/// instrument.
static void listen(struct terminal *self, bool runs) {
    char data[256];
    const ssize_t bytes = read(STDIN_FILENO, data, sizeof data);
    if (bytes <= 0) {
        self->ended = true;
        self->remote->extra_fd = -1;
    }
    for (ssize_t i = 0; i < bytes; i++) {
        if (data[i] == CTRL_C) {
            self->ahead_begin = self->ahead_end = 0;
            self->input_paused = false;
        }
        if (data[i] == CTRL_C && runs) {
            // Send it again if the first one had no effect.
            self->remote->interrupted = false;
            remote_interrupt(self->remote);
        } else if (self->input_paused) {
            self->input_paused = runs || data[i] != '\r';
        } else {
            self->ahead[self->ahead_end++] = data[i];
        }
        if (self->ahead_end == sizeof self->ahead) {
            // Discard the rest of a cut line, which must not be taken for a command.
            self->ahead_begin = self->ahead_end = 0;
            self->input_paused = true;
            fputc(BELL, stdout);
            fflush(stdout);
        }
    }
}

/// Handles input while a command runs.
static void service(struct remote *remote) {
    INVARIANT(terminal_of_attention->remote == remote);
    listen(terminal_of_attention, true);
}

static void show(struct remote *remote, void *cookie, const char *text) {
    (void)remote;
    (void)cookie;
    printable_print(stdout, text);
    fputs("\r\n", stdout);
    fflush(stdout);
}

static void print_rejection(struct remote *remote, void *cookie, const char *text) {
    (void)remote;
    (void)cookie;
    if (strncmp(text, "ERR ", 4) == 0) {
        printable_print(stderr, text);
        fputc('\n', stderr);
    }
}

static void send_to_screen(void *cookie, const char *data, size_t bytes) {
    (void)cookie;
    fwrite(data, 1, bytes, stdout);
    fflush(stdout);
}

static void save_words(struct remote *remote, void *cookie, const char *text) {
    (void)remote;
    if (strncmp(text, "words: ", 7) == 0) {
        printable_copy(text + 7, cookie, EDITOR_WORDS_BYTES);
    }
}

/// Asks the daemon for completions.
static void complete(void *cookie, const char *typed, char *words) {
    struct terminal *self = cookie;
    char quoted[REMOTE_REQUEST_BYTES];
    char command[sizeof quoted + 16];
    if (!remote_quote(typed, quoted)) {
        return;  // longer than any request
    }
    snprintf(command, sizeof command, "complete %s", quoted);
    struct message message;
    self->remote->interrupted = false;
    remote_ask(self->remote, command, save_words, words, &message);
}

/// Runs a line. False: end of the session.
static bool run_line(struct terminal *self, const char *line) {
    struct message message;
    char name[EDITOR_LINE_BYTES] = "";
    if (sscanf(line, " %599s", name) < 1 || name[0] == '#') {
        return true;
    }
    if (strcmp(name, "quit") == 0 || strcmp(name, "exit") == 0) {
        return false;
    }
    int result = 0;
    self->remote->interrupted = false;
    if (remote_files(self->remote, line, show, NULL, &result, &message) == 0) {
        result = remote_ask(self->remote, line, show, NULL, &message);
    }
    if (result < 0) {
        fputs("vergence: ", stdout);
        show(self->remote, NULL, message.text);
    }
    self->broken = result == ERROR_DEVICE;
    return !self->broken;
}

/// Processes a key. False: end of the session.
static bool feed(struct terminal *self, char key) {
    self->editor.columns = screen_columns(STDOUT_FILENO);
    const enum editor_event event = editor_feed(&self->editor, key);
    if (event == EDITOR_END || (event == EDITOR_LINE && !run_line(self, self->editor.line))) {
        return false;
    }
    if (event != EDITOR_MORE) {
        editor_begin(&self->editor);
    }
    return true;
}

static void converse(struct terminal *self) {
    bool goes_on = true;
    editor_begin(&self->editor);
    while (goes_on) {
        if (self->ahead_begin < self->ahead_end) {
            // Key by key, as a command started by one of them may discard the others.
            goes_on = feed(self, self->ahead[self->ahead_begin++]);
            continue;
        }
        self->ahead_begin = self->ahead_end = 0;
        if (self->ended) {
            break;
        }
        listen(self, false);
    }
    printf("\r\n");
}

int remote_terminal(struct remote *remote) {
    static struct terminal terminal;
    struct terminal *self = &terminal;
    struct termios settings;
    struct message message;
    INVARIANT(!remote->json);
    *self = (struct terminal){.remote = remote};
    const int received = remote_ask(remote, "version", print_rejection, NULL, &message);
    if (received < 0) {
        fputs("vergence: ", stderr);
        printable_print(stderr, message.text);
        fputc('\n', stderr);
    }
    if (received != 0) {
        return received < 0 ? REMOTE_EXIT_LINE : REMOTE_EXIT_ERR;
    }
    editor_init(&self->editor, send_to_screen, complete, self, "vergence> ");
    if (tcgetattr(STDIN_FILENO, &settings) != 0) {
        return CLIENT_FAILED;
    }
    struct termios raw = settings;
    cfmakeraw(&raw);
    tcsetattr(STDIN_FILENO, TCSADRAIN, &raw);
    terminal_of_attention = self;
    remote->extra_fd = STDIN_FILENO;
    remote->service = service;
    converse(self);
    remote->extra_fd = -1;
    tcsetattr(STDIN_FILENO, TCSADRAIN, &settings);
    return self->broken ? REMOTE_EXIT_LINE : CLIENT_OK;
}
