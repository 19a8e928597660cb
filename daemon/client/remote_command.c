// SPDX-License-Identifier: Apache-2.0
// `vergence --connect [ADDRESS] [COMMAND...]`: its command line, one command, a script.
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "console/command.h"
#include "console/command_words.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/printable.h"
#include "daemon/cli/exit_code.h"
#include "daemon/cli/options.h"
#include "daemon/client/remote.h"
#include "daemon/client/remote_script.h"
#include "daemon/files/file_error.h"

enum { EXIT_INTERRUPTED = 130 };

struct arguments {
    const char *connect;
    const char *token;
    bool json;
    bool keep_going;
};

static const struct option options[] = {
    {.name = "connect",
     .kind = OPTION_TEXT,
     .offset = offsetof(struct arguments, connect),
     .value_name = "[ADDRESS]",
     .help =
         "unix:PATH, tcp:HOST:PORT, serial:DEVICE or serial:DEVICE:BAUD (115200). Without it: the "
         "vergenced that this user has started without a setting for its socket, else the "
         "system's."},
    {.name = "token",
     .kind = OPTION_TEXT,
     .offset = offsetof(struct arguments, token),
     .value_name = "FILE",
     .help = "The token for tcp:HOST:PORT, where it is not in the file that vergenced makes by "
             "default."},
    {.name = "json",
     .kind = OPTION_FLAG,
     .offset = offsetof(struct arguments, json),
     .help = "Answers in JSON, one object a line, for programs; also what fails here."},
    {.name = "keep-going",
     .kind = OPTION_FLAG,
     .offset = offsetof(struct arguments, keep_going),
     .help = "A script on standard input goes on after a command that failed."},
};

static const struct option_page page = {
    .command = "vergence --connect",
    .operands = "[ADDRESS] [OPTIONS] [COMMAND [ARGUMENT ...]]",
    .summary = "asks the vergenced of an instrument",
    .description =
        "Without a command: line by line from standard input, up to its end or \"quit\"; at a "
        "terminal with line editing, history and completion. Ctrl-C cancels what runs; of a "
        "command or a script a second one does not wait for that. \"help\" lists the "
        "commands.\n"
        "\"fetch NAME [FILE]\" brings a file of the instrument here, or all files of a session "
        "into "
        "a directory, \"send FILE [NAME]\" takes one there; when the line breaks, the same command "
        "later goes on from there. \"snapshot\" brings a picture of what both cameras see now.\n"
        "Exit code: 0 OK; 1 ERR, or a file or script here failed; 2 the command line makes no "
        "sense; 3 no connection, or no vergenced there; 130 cancelled by Ctrl-C.",
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
    // What failed is for people too, but not among what was asked for.
    FILE *file = !self->json && strncmp(text, "ERR ", 4) == 0 ? stderr : stdout;
    (self->json ? printable_print_json : printable_print)(file, text);
    fputc('\n', file);
    // Nobody reads it any more: nor should anything run for it, such as a watch.
    if (fflush(file) != 0) {
        remote_interrupt(self);
    }
}

/// What the instrument did not answer: programs count answers, and get one.
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

/// Ctrl-C is the instrument's business first; whoever presses it twice does not want to wait.
static void attend(struct remote *self) {
    struct signalfd_siginfo information;
    struct message message;
    if (read(self->extra_fd, &information, sizeof information) != sizeof information) {
        return;
    }
    if (self->interrupted) {
        remote_progress(self, "", 0, 0);
        message_set(&message, 0,
                    "interrupted twice: ended before vergenced said that the command was given up");
        _exit(fail(self, ERROR_CANCELLED, &message, EXIT_INTERRUPTED));
    }
    remote_interrupt(self);
}

static void watch_signals(struct remote *self) {
    sigset_t taken;
    sigemptyset(&taken);
    sigaddset(&taken, SIGINT);
    sigprocmask(SIG_BLOCK, &taken, NULL);
    self->extra_fd = signalfd(-1, &taken, SFD_CLOEXEC | SFD_NONBLOCK);
    self->attend = attend;
}

/// Leaves Ctrl-C to a terminal.
static void unwatch_signals(struct remote *self) {
    sigset_t taken;
    close(self->extra_fd);
    self->extra_fd = -1;
    self->attend = NULL;
    sigemptyset(&taken);
    sigaddset(&taken, SIGINT);
    sigprocmask(SIG_UNBLOCK, &taken, NULL);
}

/// A line that the instrument never sees.
static int refuse(struct remote *self, const struct message *message) {
    return fail(self, ERROR_SYNTAX, message, REMOTE_EXIT_ERR);
}

/// The exit code of what was interrupted; where nobody reads the output, the client's end says so.
static int interrupted_code(void) {
    return ferror(stdout) != 0 ? CLIENT_FAILED : EXIT_INTERRUPTED;
}

/// A line of a script, or the command line's command.
static int run_line(struct remote *self, const char *line) {
    char storage[COMMAND_LINE_MAX + 1];
    const char *words[COMMAND_WORDS_MAX];
    size_t count = 0;
    const char *why = NULL;
    struct message message;
    if (command_words_split(line, storage, words, &count, &why) != 0) {
        message_set(&message, 0, "%s", why);
        return refuse(self, &message);
    }
    if (count == 0) {
        return CLIENT_OK;
    }
    if (words[0][0] == '@') {
        message_set(&message, 0,
                    "\"%.80s\": the client says for itself how it wants its answers; --json is for "
                    "JSON",
                    words[0]);
        return refuse(self, &message);
    }
    int error = 0;
    if (remote_files(self, line, show, NULL, &error, &message) != 0) {
        const bool broken = error == ERROR_DEVICE || error == ERROR_TIMEOUT;
        const int code = self->interrupted ? interrupted_code()
                         : broken          ? REMOTE_EXIT_LINE
                                           : REMOTE_EXIT_ERR;
        // As JSON it has been shown, and so has what the instrument said.
        return error == 0                ? CLIENT_OK
               : self->json || error > 0 ? code
                                         : fail(self, error, &message, code);
    }
    const int result = remote_ask(self, line, show, NULL, &message);
    if (result < 0) {
        const bool own = result == ERROR_CRC || result == ERROR_SYNTAX || result == ERROR_MEMORY;
        return fail(self, result, &message,
                    result == ERROR_CANCELLED ? interrupted_code()
                    : own                     ? REMOTE_EXIT_ERR
                                              : REMOTE_EXIT_LINE);
    }
    self->over = result == 0 && strcmp(words[0], "quit") == 0;
    return result == 0 ? CLIENT_OK : self->interrupted ? interrupted_code() : REMOTE_EXIT_ERR;
}

static int run_script(struct remote *self, bool keep_going) {
    static struct remote_script script;
    struct message message;
    int worst = CLIENT_OK;
    for (;;) {
        const enum remote_script_line kind = remote_script_next(&script, self);
        if (kind == REMOTE_SCRIPT_END) {
            return self->interrupted ? interrupted_code() : worst;
        }
        if (kind == REMOTE_SCRIPT_BROKEN) {
            message_set(&message, 0, "standard input cannot be read: %s",
                        strerror(script.errno_of_read));
            return fail(self, file_error(script.errno_of_read), &message, REMOTE_EXIT_ERR);
        }
        if (kind == REMOTE_SCRIPT_TOO_LONG) {
            message_set(&message, 0, "the line is longer than %d characters", COMMAND_LINE_MAX);
        } else if (kind == REMOTE_SCRIPT_CONTROL) {
            message_set(&message, 0, "the line holds a control character");
        }
        const int code =
            kind == REMOTE_SCRIPT_LINE ? run_line(self, script.line) : refuse(self, &message);
        worst = code != CLIENT_OK ? code : worst;
        if (self->over || (code != CLIENT_OK && (!keep_going || code != REMOTE_EXIT_ERR))) {
            return worst;
        }
    }
}

/// Joins the words; those with blanks or quotes in quotes.
static bool join(char *const *words, int count, char *line, size_t bytes) {
    size_t length = 0;
    for (int i = 0; i < count; i++) {
        // One word alone may be a whole line: 'pan left 3'.
        const bool quoted = count > 1 && (words[i][0] == '\0' || strpbrk(words[i], " \t\"#"));
        const char *const lead = i > 0 ? " " : "";
        length += (size_t)snprintf(line + length, bytes - length, "%s%s", lead, quoted ? "\"" : "");
        for (const char *at = words[i]; *at != '\0' && length + 4 < bytes; at++) {
            if (quoted && (*at == '"' || *at == '\\')) {
                line[length++] = '\\';
            }
            line[length++] = *at;
        }
        line[length] = '\0';
        length += (size_t)snprintf(line + length, bytes - length, "%s", quoted ? "\"" : "");
        if (length + 8 >= bytes) {
            return false;
        }
    }
    INVARIANT(length < bytes);
    return true;
}

/// The first flag of the client's own that stands among the words of a command; NULL: none does.
static const char *misplaced(char *const *words, int count) {
    for (int i = 1; i < count; i++) {
        for (int j = 0; j < page.option_count; j++) {
            if (options[j].kind == OPTION_FLAG && strncmp(words[i], "--", 2) == 0 &&
                strcmp(words[i] + 2, options[j].name) == 0) {
                return words[i];
            }
        }
    }
    return NULL;
}

/// Where the command begins: what follows is its own, also when it looks like an option (-3). A
/// "--connect" without an address is taken out of the `*argc` words: the default socket is meant.
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

/// Talks with what is at the other end of the line, first to see that it is vergenced; `line` is
/// the command of the command line, NULL: there is none.
static int converse(struct remote *self, const char *line, bool keep_going) {
    struct message message;
    self->person = line == NULL && isatty(STDIN_FILENO) != 0 && !self->json;
    watch_signals(self);
    const int error = remote_greet(self, show, NULL, &message);
    if (error < 0) {
        return fail(self, error, &message,
                    error == ERROR_CANCELLED ? interrupted_code() : REMOTE_EXIT_LINE);
    }
    if (error != 0) {
        return REMOTE_EXIT_ERR;
    }
    if (self->person) {
        unwatch_signals(self);
        return remote_terminal(self);
    }
    return line != NULL ? run_line(self, line) : run_script(self, keep_going);
}

int remote_main(int argc, char **argv) {
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
    // Answers to another program may still come: its numbers were others.
    const int32_t id = (int32_t)(monotonic_now_us() % REMOTE_IDS);
    struct remote remote = {
        .json = arguments.json, .id = id, .extra_fd = -1, .token_path = arguments.token};
    const char *option = misplaced(argv + first, count);
    if (option != NULL) {
        message_set(&message, 0, "\"%s\" goes between ADDRESS and the command", option);
        return fail(&remote, ERROR_ARGUMENT, &message, CLIENT_USAGE);
    }
    if (!join(argv + first, count, line, sizeof line)) {
        message_set(&message, 0, "the command is longer than %d characters", COMMAND_LINE_MAX);
        return fail(&remote, ERROR_SYNTAX, &message, CLIENT_USAGE);
    }
    int result = CLIENT_OK;
    const int error = arguments.connect != NULL
                          ? remote_line_open(&remote.line, arguments.connect, &message)
                          : remote_open_default(&remote.line, &message);
    if (error != 0) {
        result = fail(&remote, error, &message,
                      error == ERROR_ARGUMENT ? CLIENT_USAGE : REMOTE_EXIT_LINE);
    } else {
        result = converse(&remote, count > 0 ? line : NULL, arguments.keep_going);
    }
    remote_line_close(&remote.line);
    return result;
}
