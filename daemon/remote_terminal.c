// SPDX-License-Identifier: Apache-2.0
// A person at a terminal of the PC: line editing here, commands there.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/client.h"
#include "daemon/editor.h"
#include "daemon/remote.h"

enum { AHEAD_BYTES = 256, CTRL_C = 3 };

struct terminal {
    struct remote *remote;
    struct editor editor;
    char ahead[AHEAD_BYTES];  ///< typed while a command ran
    size_t ahead_bytes;
    bool ended;
};

static struct terminal *terminal_of_attention;

/// Keys while a command runs: Ctrl-C goes to the instrument, others wait.
static void attend(struct remote *remote) {
    struct terminal *self = terminal_of_attention;
    char data[64];
    const ssize_t bytes = read(STDIN_FILENO, data, sizeof data);
    self->ended = self->ended || bytes <= 0;
    if (bytes <= 0) {
        remote->extra_fd = -1;
    }
    for (ssize_t i = 0; i < bytes; i++) {
        if (data[i] == CTRL_C) {
            remote_line_send(&remote->line, "\003", 1);
            self->ahead_bytes = 0;
        } else if (self->ahead_bytes < sizeof self->ahead) {
            self->ahead[self->ahead_bytes++] = data[i];
        }
    }
}

static void show(struct remote *remote, void *cookie, const char *text) {
    (void)remote;
    (void)cookie;
    printf("%s\r\n", text);
    fflush(stdout);
}

static void tell_refusal(struct remote *remote, void *cookie, const char *text) {
    (void)remote;
    (void)cookie;
    if (strncmp(text, "ERR ", 4) == 0) {
        fprintf(stderr, "%s\n", text);
    }
}

static void send_to_screen(void *cookie, const char *data, size_t bytes) {
    (void)cookie;
    fwrite(data, 1, bytes, stdout);
    fflush(stdout);
}

static void keep_words(struct remote *remote, void *cookie, const char *text) {
    (void)remote;
    if (strncmp(text, "words: ", 7) == 0) {
        snprintf(cookie, EDITOR_WORDS_BYTES, "%s", text + 7);
    }
}

/// The daemon knows what there is.
static void complete(void *cookie, const char *typed, char *words) {
    struct terminal *self = cookie;
    char command[2 * EDITOR_LINE_BYTES + 16] = "complete \"";
    size_t at = strlen(command);
    for (; *typed != '\0'; typed++) {
        if (*typed == '"' || *typed == '\\') {
            command[at++] = '\\';
        }
        command[at++] = *typed;
    }
    command[at++] = '"';
    command[at] = '\0';
    struct message message;
    remote_ask(self->remote, command, keep_words, words, &message);
}

/// Carries out a line. False: the end.
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
    if (remote_files(self->remote, line, show, NULL, &result, &message) != 0) {
        if (result != 0) {
            printf("vergence: %s\r\n", message.text);
        }
        return result != ERROR_DEVICE;
    }
    result = remote_ask(self->remote, line, show, NULL, &message);
    if (result < 0) {
        printf("vergence: %s\r\n", message.text);
    }
    return result != ERROR_DEVICE;
}

/// Feeds what was typed. False: the end.
static bool feed(struct terminal *self, const char *data, size_t bytes) {
    for (size_t i = 0; i < bytes; i++) {
        const enum editor_event event = editor_feed(&self->editor, data[i]);
        if (event == EDITOR_END) {
            return false;
        }
        if (event == EDITOR_LINE && !run_line(self, self->editor.line)) {
            return false;
        }
        if (event != EDITOR_MORE) {
            editor_begin(&self->editor);
        }
    }
    return true;
}

static void converse(struct terminal *self) {
    editor_begin(&self->editor);
    while (!self->ended) {
        char data[AHEAD_BYTES];
        size_t bytes = self->ahead_bytes;
        memcpy(data, self->ahead, bytes);
        self->ahead_bytes = 0;
        if (bytes == 0) {
            const ssize_t got = read(STDIN_FILENO, data, sizeof data);
            if (got <= 0) {
                break;
            }
            bytes = (size_t)got;
        }
        if (!feed(self, data, bytes)) {
            break;
        }
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
    const int heard = remote_ask(remote, "version", tell_refusal, NULL, &message);
    if (heard < 0) {
        fprintf(stderr, "vergence: %s\n", message.text);
    }
    if (heard != 0) {
        return heard < 0 ? REMOTE_EXIT_LINE : REMOTE_EXIT_ERR;
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
    remote->attend = attend;
    converse(self);
    remote->extra_fd = -1;
    tcsetattr(STDIN_FILENO, TCSADRAIN, &settings);
    return CLIENT_OK;
}
