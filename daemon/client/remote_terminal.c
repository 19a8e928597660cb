// SPDX-License-Identifier: Apache-2.0
// Interactive use at a terminal of the PC: libedit edits the lines, the instrument runs them.
#include <errno.h>
#include <histedit.h>
#include <limits.h>
#include <locale.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <wchar.h>

#include "core/invariant.h"
#include "core/utf8.h"
#include "daemon/base/message.h"
#include "daemon/cli/options.h"
#include "daemon/client/remote.h"
#include "daemon/files/standard_paths.h"

enum { CTRL_C = 3, HISTORY_LINES = 1000, WORDS_BYTES = 4096 };

struct terminal {
    struct remote *remote;
    EditLine *edit;
    History *history;
    char history_path[STANDARD_PATH_BYTES];  ///< "": not kept
    bool cancelled;                          ///< the line being edited, by Ctrl-C
};

static struct terminal *terminal_of(EditLine *edit) {
    void *self = NULL;
    el_get(edit, EL_CLIENTDATA, &self);
    INVARIANT(self != NULL);
    return self;
}

static char *prompt(EditLine *edit) {
    static char text[] = "vergence> ";
    (void)edit;
    return text;
}

/// Reads a key. Ctrl-C comes as a signal, which the connection watches, too.
static int read_key(EditLine *edit, wchar_t *key) {
    struct remote *remote = terminal_of(edit)->remote;
    char bytes[MB_LEN_MAX] = "";
    mbstate_t state = {0};
    for (;;) {
        struct pollfd fds[2] = {{.fd = STDIN_FILENO, .events = POLLIN},
                                {.fd = remote->extra_fd, .events = POLLIN}};
        if (poll(fds, 2, -1) < 0 && errno != EINTR) {
            return -1;
        }
        remote->interrupted = false;
        if (fds[1].revents != 0 && remote_take_signal(remote)) {
            *key = CTRL_C;
            return 1;
        }
        if (fds[0].revents == 0) {
            continue;
        }
        if (read(STDIN_FILENO, bytes, 1) != 1) {
            return 0;
        }
        const size_t got = mbrtowc(key, bytes, 1, &state);
        if (got == (size_t)-1) {
            *key = L'?';
        }
        if (got != (size_t)-2) {
            return 1;
        }
    }
}

/// Ctrl-C discards the line.
static unsigned char cancel(EditLine *edit, int key) {
    (void)key;
    terminal_of(edit)->cancelled = true;
    puts("^C");
    return CC_NEWLINE;
}

static void save_words(struct remote *remote, void *cookie, const char *text) {
    (void)remote;
    if (strncmp(text, "words: ", 7) == 0) {
        utf8_copy_printable(text + 7, cookie, WORDS_BYTES);
    }
}

/// Length of the beginning that all the words, separated by blanks, have in common.
static size_t shared_length(const char *words) {
    size_t shared = strcspn(words, " ");
    for (const char *word = strchr(words, ' '); word != NULL; word = strchr(word, ' ')) {
        size_t same = 0;
        word++;
        while (same < shared && word[same] == words[same]) {
            same++;
        }
        shared = same;
    }
    return shared;
}

/// Asks the daemon for completions: inserts what they have in common, else lists them.
static unsigned char complete(EditLine *edit, int key) {
    struct terminal *self = terminal_of(edit);
    const LineInfo *line = el_line(edit);
    const int length = (int)(line->cursor - line->buffer);
    char typed[REMOTE_REQUEST_BYTES], quoted[REMOTE_REQUEST_BYTES];
    char command[sizeof quoted + 16];
    char words[WORDS_BYTES] = "";
    struct message message;
    (void)key;
    snprintf(typed, sizeof typed, "%.*s", length, line->buffer);
    if (length >= (int)sizeof typed || !remote_quote(typed, quoted)) {
        return CC_ERROR;  // longer than any request
    }
    snprintf(command, sizeof command, "complete %s", quoted);
    self->remote->interrupted = false;
    remote_ask(self->remote, command, save_words, words, &message);
    const char *blank = strrchr(typed, ' ');
    const size_t begun = strlen(blank != NULL ? blank + 1 : typed);
    const size_t shared = shared_length(words);
    const bool single = strchr(words, ' ') == NULL;
    if (words[0] == '\0' || shared < begun) {
        return CC_ERROR;
    }
    if (!single && shared == begun) {
        printf("\n%s\n", words);
        return CC_REDISPLAY;
    }
    char added[WORDS_BYTES];
    const bool whole = single && words[shared - 1] != '/' && words[shared - 1] != '=';
    snprintf(added, sizeof added, "%.*s%s", (int)(shared - begun), words + begun, whole ? " " : "");
    return el_insertstr(edit, added) == 0 ? CC_REFRESH : CC_ERROR;
}

static void open_history(struct terminal *self) {
    HistEvent event;
    history(self->history, &event, H_SETSIZE, HISTORY_LINES);
    history(self->history, &event, H_SETUNIQUE, 1);
    if (standard_paths_history(self->history_path)) {
        history(self->history, &event, H_LOAD, self->history_path);
    }
}

/// Saves after each line, so that nothing is lost if the client is killed.
static void save_history(struct terminal *self, const char *line) {
    HistEvent event;
    history(self->history, &event, H_ENTER, line);
    if (self->history_path[0] != '\0' && standard_paths_make_parent(self->history_path, S_IRWXU)) {
        const mode_t mask = umask(S_IRWXG | S_IRWXO);
        history(self->history, &event, H_SAVE, self->history_path);
        umask(mask);
    }
}

static bool begin(struct terminal *self) {
    setlocale(LC_CTYPE, "");
    self->edit = el_init("vergence", stdin, stdout, stderr);
    self->history = history_init();
    if (self->edit == NULL || self->history == NULL) {
        return false;
    }
    open_history(self);
    el_set(self->edit, EL_CLIENTDATA, self);
    el_set(self->edit, EL_EDITOR, "emacs");
    el_set(self->edit, EL_PROMPT, prompt);
    el_set(self->edit, EL_SIGNAL, 1);
    el_set(self->edit, EL_HIST, history, self->history);
    el_set(self->edit, EL_GETCFN, read_key);
    el_set(self->edit, EL_ADDFN, "vergence-complete", "Complete the word", complete);
    el_set(self->edit, EL_ADDFN, "vergence-cancel", "Discard the line", cancel);
    el_set(self->edit, EL_BIND, "^I", "vergence-complete", NULL);
    el_set(self->edit, EL_BIND, "^C", "vergence-cancel", NULL);
    el_set(self->edit, EL_BIND, "^R", "em-inc-search-prev", NULL);
    // What is typed while a command runs, as Ctrl-C, is not shown among its answer. Ctrl-D is left
    // to the next line, which libedit begins to show before it changes the terminal's mode.
    el_set(self->edit, EL_SETTY, "-x", "-echo", "-icanon", NULL);
    el_source(self->edit, NULL);
    return true;
}

static int converse(struct terminal *self) {
    for (;;) {
        char line[REMOTE_REQUEST_BYTES];
        int length = 0;
        self->cancelled = false;
        const char *typed = el_gets(self->edit, &length);
        if (self->cancelled) {
            continue;
        }
        if (typed == NULL || length <= 0) {
            putchar('\n');
            return CLIENT_OK;
        }
        if (typed[0] == '\n') {
            continue;
        }
        snprintf(line, sizeof line, "%.*s", (int)strcspn(typed, "\n"), typed);
        save_history(self, line);
        self->remote->interrupted = false;
        if (strcmp(line, "exit") == 0) {
            return CLIENT_OK;
        }
        const int code = remote_run_line(self->remote, line);
        if (self->remote->over || code == REMOTE_EXIT_LINE) {
            return self->remote->over ? CLIENT_OK : code;
        }
    }
}

int remote_terminal(struct remote *remote) {
    static struct terminal terminal;
    struct terminal *self = &terminal;
    INVARIANT(!remote->json);
    *self = (struct terminal){.remote = remote};
    const int code = begin(self) ? converse(self) : CLIENT_FAILED;
    if (self->history != NULL) {
        history_end(self->history);
    }
    if (self->edit != NULL) {
        el_end(self->edit);
    }
    return code;
}
