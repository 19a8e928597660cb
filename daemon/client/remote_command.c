// SPDX-License-Identifier: Apache-2.0
// `vergence --connect [ADDRESS] [COMMAND...]`: its command line, one command, a script.
#include <cjson/cJSON.h>
#include <errno.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

#include "console/command.h"
#include "console/command_words.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/message.h"
#include "daemon/base/monotonic.h"
#include "daemon/cli/options.h"
#include "daemon/client/remote.h"
#include "daemon/files/file_io.h"

enum { EXIT_INTERRUPTED = 130, START_MS = 5000, START_POLL_NS = 50000000 };

struct arguments {
    const char *connect;
    const char *token;
    bool json;
    bool keep_going;
};

static const struct command_argument options[] = {
    {.name = "connect",
     .kind = COMMAND_TEXT,
     .offset = offsetof(struct arguments, connect),
     .value_name = "[ADDRESS]",
     .help = "unix:PATH, tcp:HOST:PORT, serial:DEVICE or serial:DEVICE:BAUD (115200). Without it: "
             "the default socket of this user's vergenced, else the system's."},
    {.name = "token",
     .kind = COMMAND_TEXT,
     .offset = offsetof(struct arguments, token),
     .value_name = "FILE",
     .help = "File with the token for tcp:HOST:PORT, if not the one that vergenced creates by "
             "default."},
    {.name = "json",
     .kind = COMMAND_FLAG,
     .offset = offsetof(struct arguments, json),
     .help = "Print answers as JSON, one object a line, including the client's own errors."},
    {.name = "keep-going",
     .kind = COMMAND_FLAG,
     .offset = offsetof(struct arguments, keep_going),
     .help = "Continue a script on standard input after a command that failed."},
};

static const struct option_page page = {
    .command = "vergence --connect",
    .operands = "[ADDRESS] [OPTIONS] [COMMAND [ARGUMENT ...]]",
    .summary = "sends commands to the vergenced of an instrument",
    .description =
        "Without a command: reads commands from standard input, up to its end or \"quit\"; at a "
        "terminal with line editing, history and completion. Ctrl-C cancels the running command; "
        "for a single command or a script, a second Ctrl-C ends at once. \"help\" lists the "
        "commands.\n"
        "\"fetch NAME [FILE]\" copies a file from the instrument, or all files of a session into a "
        "directory, and replaces no local file; \"send FILE [NAME]\" copies one to it; if the "
        "connection is lost, the same "
        "command resumes the transfer later. \"view\" fetches an image of what both cameras see "
        "now. \"measure NAME\" fetches its session and makes the surface here, with the options of "
        "\"vergence measure\" (--out, --board, ...) that follow. \"reconstruct [NAME]\" receives "
        "what was measured in its compact form, which the instrument does not keep unless the line "
        "is serial, and makes the files of it here, in a directory of "
        "the surface's name or in --out DIR; with \"files=LIST\" they stay on the instrument.\n"
        "Exit code: 0 OK; 1 ERR, or a local file or script failed; 2 invalid command line; 3 no "
        "connection, or no vergenced there; 130 cancelled by Ctrl-C.",
    .examples =
        "vergence --connect\n"
        "vergence --connect status\n"
        "vergence --connect unix:rig.sock status\n"
        "vergence --connect serial:/dev/ttyUSB0 bugreport\n"
        "vergence --connect serial:/dev/ttyUSB0 fetch bugreport-20260131-093000.txt\n"
        "vergence --connect serial:/dev/ttyUSB0 send rig.txt",
    .options = options,
    .option_count = sizeof options / sizeof options[0],
    .operands_min = 0,
    .operands_max = 0,
};

static void show(struct remote *self, void *cookie, const char *text) {
    (void)cookie;
    if (ferror(stdout)) {
        return;
    }
    // Errors go to standard error, so that they do not mix with the requested output.
    FILE *file = !self->json && strncmp(text, "ERR ", 4) == 0 ? stderr : stdout;
    (self->json ? printable_print_json : printable_print)(file, text);
    fputc('\n', file);
    // The reader is gone: stop anything that still runs for it, such as a watch.
    if (fflush(file) != 0) {
        remote_interrupt(self);
    }
}

/// Reports an error that the instrument did not answer; in JSON as an answer, as programs count
/// them.
static int fail(struct remote *self, int error, const struct message *message, int code) {
    if (self->json) {
        remote_show_error(self, show, NULL, error, message->text);
    } else {
        fputs("vergence: ", stderr);
        printable_print(stderr, message->text);
        fputc('\n', stderr);
    }
    return code;
}

bool remote_take_signal(struct remote *self) {
    struct signalfd_siginfo information;
    return read(self->extra_fd, &information, sizeof information) == sizeof information;
}

/// The first Ctrl-C cancels on the instrument; a second one ends the client without waiting. A user
/// at a terminal may repeat it.
static void service(struct remote *self) {
    struct message message;
    if (!remote_take_signal(self)) {
        return;
    }
    if (self->interrupted && !self->interactive) {
        remote_progress(self, "", 0, 0);
        message_set(&message, 0,
                    "interrupted twice: ended before vergenced confirmed the cancellation");
        _exit(fail(self, ERROR_CANCELLED, &message, EXIT_INTERRUPTED));
    }
    self->interrupted = false;
    remote_interrupt(self);
}

static void watch_signals(struct remote *self) {
    sigset_t taken;
    sigemptyset(&taken);
    sigaddset(&taken, SIGINT);
    sigprocmask(SIG_BLOCK, &taken, NULL);
    self->extra_fd = signalfd(-1, &taken, SFD_CLOEXEC | SFD_NONBLOCK);
    self->service = service;
}

/// Rejects a line without sending it.
static int refuse(struct remote *self, const struct message *message) {
    return fail(self, ERROR_SYNTAX, message, REMOTE_EXIT_ERR);
}

/// The exit code after an interrupt; if the output has no reader, client_finish_output reports
/// that.
static int interrupted_code(void) {
    return ferror(stdout) != 0 ? CLIENT_FAILED : EXIT_INTERRUPTED;
}

/// The exit code of a line that remote_files has carried out with this `error`.
static int files_code(struct remote *self, int error, const struct message *message) {
    if (error == ERROR_OK) {
        return self->measure_exit;
    }
    const bool broken = error == ERROR_DEVICE || error == ERROR_TIMEOUT || error == ERROR_VERSION;
    int code = broken ? REMOTE_EXIT_LINE : REMOTE_EXIT_ERR;
    if (self->interrupted) {
        code = interrupted_code();
    }
    // In JSON it has been shown, and so has the instrument's own error.
    return self->json || error > 0 ? code : fail(self, error, message, code);
}

/// The exit code of a command with this result of remote_ask.
static int ask_code(struct remote *self, int result, const struct message *message) {
    switch (result) {
        case 0:
            return CLIENT_OK;
        case 1:
            return self->interrupted ? interrupted_code() : REMOTE_EXIT_ERR;
        case ERROR_CANCELLED:
            return fail(self, result, message, interrupted_code());
        case ERROR_CRC:
        case ERROR_SYNTAX:
        case ERROR_MEMORY:
            return fail(self, result, message, REMOTE_EXIT_ERR);
        default:
            return fail(self, result, message, REMOTE_EXIT_LINE);
    }
}

int remote_run_line(struct remote *self, const char *line) {
    char storage[COMMAND_LINE_MAX + 1];
    struct command_words words;
    const char *why = NULL;
    struct message message;
    if (command_words_split(line, storage, &words, &why) != 0) {
        message_set(&message, 0, "%s", why);
        return refuse(self, &message);
    }
    if (words.count == 0) {
        return CLIENT_OK;
    }
    if (words.word[0][0] == '@') {
        message_set(
            &message, 0,
            "\"%.80s\": lines beginning with @ are reserved for the client (use --json for JSON)",
            words.word[0]);
        return refuse(self, &message);
    }
    int error = 0;
    self->measure_exit = CLIENT_OK;
    if (remote_files(self, line, show, NULL, &error, &message) != 0) {
        return files_code(self, error, &message);
    }
    const int result = remote_ask(self, line, show, NULL, &message);
    if (result >= 0) {
        self->over = result == 0 && strcmp(words.word[0], "quit") == 0;
    }
    return ask_code(self, result, &message);
}

/// Reads the next line of a script, whose end may be missing. 1; 0: end of input; or an error with
/// a message.
static int next_line(struct remote *self, struct remote_line *script, char **line,
                     struct message *message) {
    for (;;) {
        bool extra = false;
        const int error =
            remote_line_receive(script, REMOTE_FOREVER_MS, self->extra_fd, &extra, line);
        if (extra) {
            self->service(self);
        }
        if (self->interrupted) {
            return 0;
        }
        if (error == ERROR_DEVICE) {
            return script->errno_of_read == 0
                       ? 0
                       : message_set(message, file_error(script->errno_of_read),
                                     "cannot read standard input: %s",
                                     strerror(script->errno_of_read));
        }
        if (error == ERROR_OK) {
            return 1;
        }
    }
}

static int run_script(struct remote *self, bool keep_going) {
    struct remote_line script = {.fd = STDIN_FILENO, .script = true};
    struct message message;
    int worst = CLIENT_OK;
    script.data = malloc(REMOTE_LINE_BYTES + 1);
    if (script.data == NULL) {
        message_set(&message, 0, "out of memory");
        return fail(self, ERROR_MEMORY, &message, CLIENT_FAILED);
    }
    for (bool goes_on = !remote_interrupted(self); goes_on;) {
        char *line = NULL;
        const int got = next_line(self, &script, &line, &message);
        if (got < 0) {
            worst = fail(self, got, &message, REMOTE_EXIT_ERR);
            break;
        }
        if (got == 0) {
            worst = self->interrupted ? interrupted_code() : worst;
            break;
        }
        const int code = remote_run_line(self, line);
        worst = code != CLIENT_OK ? code : worst;
        goes_on = !self->over && (code == CLIENT_OK || (keep_going && code == REMOTE_EXIT_ERR));
    }
    free(script.data);
    return worst;
}

/// Appends a word at `length`; inside quotes, quotes and backslashes are escaped. The new length,
/// at most `bytes` - 2.
static size_t append_word(char *line, size_t length, size_t bytes, const char *word, bool quoted) {
    for (; *word != '\0' && length + 4 < bytes; word++) {
        if (quoted && (*word == '"' || *word == '\\')) {
            line[length++] = '\\';
        }
        line[length++] = *word;
    }
    line[length] = '\0';
    return length;
}

/// Joins the words; quotes those with blanks or quotes.
static bool join(char *const *words, int count, char *line, size_t bytes) {
    size_t length = 0;
    for (int i = 0; i < count; i++) {
        // A single word may be a whole line: 'pan 3 side=left'.
        const bool quoted = count > 1 && (words[i][0] == '\0' || strpbrk(words[i], " \t\"#"));
        const char *const lead = i > 0 ? " " : "";
        length += (size_t)snprintf(line + length, bytes - length, "%s%s", lead, quoted ? "\"" : "");
        length = append_word(line, length, bytes, words[i], quoted);
        length += (size_t)snprintf(line + length, bytes - length, "%s", quoted ? "\"" : "");
        if (length + 8 >= bytes) {
            return false;
        }
    }
    INVARIANT(length < bytes);
    return true;
}

/// The first of the client's own flags among the words of a command; NULL: none.
static const char *misplaced(char *const *words, int count) {
    for (int i = 1; i < count; i++) {
        for (unsigned j = 0; j < page.option_count; j++) {
            if (options[j].kind == COMMAND_FLAG && strncmp(words[i], "--", 2) == 0 &&
                strcmp(words[i] + 2, options[j].name) == 0) {
                return words[i];
            }
        }
    }
    return NULL;
}

/// Index of the command: everything after it belongs to it, even if it looks like an option (-3). A
/// "--connect" without an address is removed from the `*argc` words: the default socket is meant.
static int first_word(int *argc, char **argv) {
    int at = 1;
    while (at < *argc && strncmp(argv[at], "--", 2) == 0) {
        if (strcmp(argv[at], "--connect") != 0) {
            at += strcmp(argv[at], "--token") == 0 && at + 1 < *argc ? 2 : 1;
        } else if (at + 1 < *argc && remote_is_address(argv[at + 1])) {
            at += 2;
        } else {
            memmove(&argv[at], &argv[at + 1], (size_t)(*argc - at) * sizeof *argv);
            (*argc)--;
        }
    }
    return at;
}

/// Verifies that vergenced is at the other end, then runs `line`, the command of the command line;
/// NULL: there is none.
static int converse(struct remote *self, const char *line, bool keep_going) {
    struct message message;
    self->interactive = line == NULL && isatty(STDIN_FILENO) != 0 && !self->json;
    watch_signals(self);
    const int error = remote_greet(self, show, NULL, &message);
    if (error < 0) {
        return fail(self, error, &message,
                    error == ERROR_CANCELLED ? interrupted_code() : REMOTE_EXIT_LINE);
    }
    if (error != ERROR_OK) {
        return REMOTE_EXIT_ERR;
    }
    if (self->interactive) {
        return remote_terminal(self);
    }
    return line != NULL ? remote_run_line(self, line) : run_script(self, keep_going);
}

/// Whether a daemon that starts may make this socket (NULL: the default one, with its directories).
static bool may_appear(const char *where) {
    char folder[PATH_MAX];
    if (where == NULL || strncmp(where, "unix:", 5) != 0) {
        return where == NULL;
    }
    snprintf(folder, sizeof folder, "%s", where + 5);
    char *slash = strrchr(folder, '/');
    if (slash == NULL) {
        return true;
    }
    slash[1] = '\0';
    return access(folder, F_OK) == 0;
}

/// Opens the line. A daemon that was started just before has no socket yet, so wait for one.
static int open_line(struct remote *self, const char *where, struct message *message) {
    const uint64_t begin_us = monotonic_now_us();
    for (;;) {
        errno = 0;
        const int error = where != NULL ? remote_line_open(&self->line, where, message)
                                        : remote_open_default(&self->line, message);
        const bool starts =
            error == ERROR_IO && (errno == ENOENT || errno == ECONNREFUSED) && may_appear(where);
        const uint64_t waited_ms = (monotonic_now_us() - begin_us) / MONOTONIC_US_IN_MS;
        if (!starts || waited_ms >= START_MS) {
            remote_progress(self, "", 0, 0);
            return error;
        }
        remote_progress(self, "waiting for vergenced to start", waited_ms, START_MS);
        nanosleep(&(struct timespec){.tv_nsec = START_POLL_NS}, NULL);
    }
}

int remote_main(int argc, char **argv, const struct client_command *measure,
                const struct client_command *reconstruct) {
    struct arguments arguments = {0};
    const int first = first_word(&argc, argv);
    const int count = argc - first;
    int none = 0;
    struct message message;
    char line[COMMAND_LINE_MAX + 16] = "";
    const int code = options_parse(&page, first, argv, &arguments, NULL, &none);
    if (code != OPTIONS_CONTINUE) {
        return code;
    }
    struct remote remote = {.json = arguments.json,
                            .extra_fd = -1,
                            .token_path = arguments.token,
                            .measure = measure,
                            .reconstruct = reconstruct};
    const char *option = misplaced(argv + first, count);
    if (option != NULL) {
        message_set(&message, 0, "put \"%s\" between ADDRESS and the command", option);
        return fail(&remote, ERROR_ARGUMENT, &message, CLIENT_USAGE);
    }
    if (!join(argv + first, count, line, sizeof line)) {
        message_set(&message, 0, "command longer than %d characters", COMMAND_LINE_MAX);
        return fail(&remote, ERROR_SYNTAX, &message, CLIENT_USAGE);
    }
    int result = CLIENT_OK;
    const int error = open_line(&remote, arguments.connect, &message);
    if (error != ERROR_OK) {
        result = fail(&remote, error, &message,
                      error == ERROR_ARGUMENT ? CLIENT_USAGE : REMOTE_EXIT_LINE);
    } else {
        result = converse(&remote, count > 0 ? line : NULL, arguments.keep_going);
    }
    cJSON_Delete(remote.answer);
    remote_line_close(&remote.line);
    return result;
}
