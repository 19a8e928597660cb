// SPDX-License-Identifier: Apache-2.0
#include "daemon/client/client.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "console/synonyms.h"
#include "core/invariant.h"
#include "core/suggest.h"
#include "daemon/base/message.h"
#include "daemon/base/process.h"
#include "daemon/cli/help.h"
#include "daemon/cli/options.h"
#include "daemon/client/remote.h"

/// Name under which `vergence help` lists the page of --connect, which is not a command.
#define CLIENT_HELP_CONNECT "connect"

enum { CLIENT_NAME_MAX = 32, CLIENT_CLOSED_PIPE = 128 + SIGPIPE };

static const char summary[] = "measures 3D surfaces with two cameras";

static const char *const usages[] = {
    "COMMAND [ARGUMENTS]",
    "help COMMAND",
    "--connect [ADDRESS] [COMMAND]   (an instrument; \"vergence help " CLIENT_HELP_CONNECT "\")",
    "--version",
};

static const struct {
    const char *code, *meaning;
} exits[] = {
    {"0", "success"},
    {"1", "failed: results could not be written, or out of memory"},
    {"2", "invalid command line"},
    {"3", "bad input: an image, a calibration or another file is unusable"},
    {"4", "no surface: the inputs are fine but nothing could be measured"},
    {"5", "not good: a calibration was written, but it is marked as not good"},
    {"130", "interrupted (Ctrl-C); 143 terminated, 129 hung up"},
};

static const char exits_note[] =
    "All but 0 come with one line on standard error that gives the reason.";

enum {
    USAGE_COUNT = sizeof usages / sizeof usages[0],
    EXIT_COUNT = sizeof exits / sizeof exits[0],
};

/// The page for people.
static void print_help(FILE *file, const struct client_command *commands, int command_count) {
    fprintf(file, "vergence - %s\n\n", summary);
    for (int i = 0; i < USAGE_COUNT; i++) {
        fprintf(file, "%s vergence %s\n", i == 0 ? "usage:" : "      ", usages[i]);
    }
    fputs("\nCommands\n", file);
    for (int i = 0; i < command_count; i++) {
        fprintf(file, "  %-19s%s\n", commands[i].name, commands[i].summary);
    }
    fputs("\nExit codes\n", file);
    for (int i = 0; i < EXIT_COUNT; i++) {
        fprintf(file, "  %-5s%s\n", exits[i].code, exits[i].meaning);
    }
    fprintf(file, "%s\n", exits_note);
}

/// The page for man(1).
static void print_help_manual(FILE *file, const struct client_command *commands,
                              int command_count) {
    manual_begin(file, "vergence", 1, summary);
    manual_heading(file, "SYNOPSIS");
    for (int i = 0; i < USAGE_COUNT; i++) {
        manual_synopsis(file, "vergence", usages[i], i > 0);
    }
    manual_heading(file, "COMMANDS");
    for (int i = 0; i < command_count; i++) {
        manual_entry(file, commands[i].name, NULL);
        manual_text(file, commands[i].summary);
    }
    manual_heading(file, "EXIT STATUS");
    for (int i = 0; i < EXIT_COUNT; i++) {
        manual_entry(file, exits[i].code, NULL);
        manual_text(file, exits[i].meaning);
    }
    manual_paragraph(file, exits_note);
    manual_heading(file, "SEE ALSO");
    for (int i = 0; i < command_count; i++) {
        manual_reference(file, "vergence-", commands[i].name, 1, false);
    }
    manual_reference(file, "vergence-", CLIENT_HELP_CONNECT, 1, false);
    manual_reference(file, "", "vergenced", 8, true);
}

/// The names of everything that has its own page, one per line.
static void print_help_names(FILE *file, const struct client_command *commands, int command_count) {
    for (int i = 0; i < command_count; i++) {
        fprintf(file, "%s\n", commands[i].name);
    }
    fputs(CLIENT_HELP_CONNECT "\n", file);
}

/// Completions for `vergence` and `vergence help`.
static void print_help_completion(FILE *file, const struct client_command *commands,
                                  int command_count) {
    for (int i = 0; i < command_count; i++) {
        const char *blank = strchr(commands[i].name, ' ');  // "calibrate capture"
        if (blank != NULL) {
            char first[CLIENT_NAME_MAX + 16];
            snprintf(first, sizeof first, "vergence help %.*s", (int)(blank - commands[i].name),
                     commands[i].name);
            shell_completion_add(file, first, blank + 1);
            continue;
        }
        shell_completion_add(file, "vergence", commands[i].name);
        shell_completion_add(file, "vergence help", commands[i].name);
    }
    shell_completion_add(file, "vergence help", CLIENT_HELP_CONNECT);
    shell_completion_add(file, "vergence", "help --connect --help --version");
}

static const struct client_command *find_command(const char *name,
                                                 const struct client_command *commands,
                                                 int command_count) {
    for (int i = 0; i < command_count; i++) {
        if (strcmp(name, commands[i].name) == 0) {
            return &commands[i];
        }
    }
    struct suggest suggest;
    suggest_begin(&suggest, name, "");
    for (int i = 0; i < command_count; i++) {
        suggest_consider(&suggest, commands[i].name);
    }
    struct message line;
    const char *meant = synonyms_command(name, NULL);
    if (meant != NULL && suggest.text[0] == '\0') {
        fprintf(stderr,
                "vergence: unknown command \"%s\" (did you mean \"vergence --connect %s\"?)\n",
                name, meant);
        return NULL;
    }
    message_set(&line, 0, "unknown command \"%s\"%s", name,
                suggest.text[0] != '\0' ? suggest.text
                                        : " (\"vergence --help\" lists all, \"vergence --connect "
                                          "help\" those of an instrument)");
    fprintf(stderr, "vergence: %s\n", line.text);
    return NULL;
}

/// Prints a page of `vergence help`, or its form for man(1) (`form` "--help-man") or for a shell
/// ("--help-words"). Returns the exit code.
static int print_page(const char *name, char *form, const struct client_command *commands,
                      int command_count) {
    static char connect[] = "--connect";
    char copy[CLIENT_NAME_MAX];
    if (strcmp(name, CLIENT_HELP_CONNECT) == 0) {
        char *remote_argv[] = {connect, connect, form, NULL};
        return remote_main(3, remote_argv, NULL, NULL);
    }
    const struct client_command *command = find_command(name, commands, command_count);
    if (command == NULL) {
        return CLIENT_USAGE;
    }
    snprintf(copy, sizeof copy, "%s", command->name);
    char *command_argv[] = {copy, form, NULL};
    return command->run(2, command_argv);
}

/// The command that the words name: two of them, as in "calibrate capture", if there is such one.
static const char *name_of(char **words, const struct client_command *commands, int command_count) {
    for (int i = 0; words[1] != NULL && i < command_count; i++) {
        const size_t length = strlen(words[0]);
        if (strncmp(commands[i].name, words[0], length) == 0 && commands[i].name[length] == ' ' &&
            strcmp(commands[i].name + length + 1, words[1]) == 0) {
            return commands[i].name;
        }
    }
    return words[0];
}

/// For the build: `vergence help --man [COMMAND]` prints manual pages, `--words` completions, and
/// `--names` the names of commands that have pages.
static int run_help(int argc, char **argv, const struct client_command *commands,
                    int command_count) {
    static char help[] = "--help", manual[] = "--help-man", words[] = "--help-words";
    const char *first = argc > 2 ? argv[2] : NULL;
    if (first == NULL) {
        print_help(stdout, commands, command_count);
    } else if (strcmp(first, "--man") == 0 && argc > 3) {
        return print_page(name_of(argv + 3, commands, command_count), manual, commands,
                          command_count);
    } else if (strcmp(first, "--man") == 0) {
        print_help_manual(stdout, commands, command_count);
    } else if (strcmp(first, "--names") == 0) {
        print_help_names(stdout, commands, command_count);
    } else if (strcmp(first, "--words") == 0) {
        print_help_completion(stdout, commands, command_count);
        for (int i = 0; i < command_count; i++) {
            print_page(commands[i].name, words, commands, command_count);
        }
        print_page(CLIENT_HELP_CONNECT, words, commands, command_count);
    } else {
        return print_page(name_of(argv + 2, commands, command_count), help, commands,
                          command_count);
    }
    return CLIENT_OK;
}

static bool connects_later(int argc, char **argv) {
    for (int i = 2; i < argc; i++) {
        if (strcmp(argv[i], "--connect") == 0 || strncmp(argv[i], "--connect=", 10) == 0) {
            return true;
        }
    }
    return false;
}

/// The client's own command of this name, for `--connect`; NULL: it has none.
static const struct client_command *own(const char *name, const struct client_command *commands,
                                        int command_count) {
    for (int i = 0; i < command_count; i++) {
        if (strcmp(name, commands[i].name) == 0) {
            return &commands[i];
        }
    }
    return NULL;
}

static int dispatch(int argc, char **argv, const struct client_command *commands,
                    int command_count) {
    if (argc < 2) {
        fputs("vergence: missing command (\"vergence --help\" lists all)\n", stderr);
        return CLIENT_USAGE;
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0 ||
        strcmp(argv[1], "help") == 0) {
        return run_help(argc, argv, commands, command_count);
    }
    if (strcmp(argv[1], "--version") == 0) {
        printf("vergence %s (build %s)\n", version_text(), version_build_id());
        return CLIENT_OK;
    }
    if (strncmp(argv[1], "--connect", 9) == 0) {
        return remote_main(argc, argv, own("measure", commands, command_count),
                           own("reconstruct", commands, command_count));
    }
    if (argv[1][0] == '-' && connects_later(argc, argv)) {
        fprintf(stderr,
                "vergence: \"--connect ADDRESS\" must come first: put \"%.40s\" between ADDRESS "
                "and the command\n",
                argv[1]);
        return CLIENT_USAGE;
    }
    const struct client_command *command = find_command(argv[1], commands, command_count);
    return command != NULL ? command->run(argc - 1, argv + 1) : CLIENT_USAGE;
}

bool client_occupy_standard_streams(void) {
    for (int fd = 0; fd <= 2; fd++) {
        const int other_way = fd == STDIN_FILENO ? O_WRONLY : O_RDONLY;
        if (fcntl(fd, F_GETFD) == -1 && open("/dev/null", other_way) != fd) {
            return false;
        }
    }
    return true;
}

/// The error of standard output, 0: unknown. `number` is errno of the last flush, 0: nothing was
/// left to flush. An earlier error is found by writing again, as errno has been overwritten since.
static int output_error(int number) {
    struct pollfd output = {.fd = STDOUT_FILENO, .events = POLLOUT};
    if (number == 0 && write(STDOUT_FILENO, "", 0) != 0) {
        number = errno;
    }
    if (number == 0 && poll(&output, 1, 0) > 0 && (output.revents & POLLERR) != 0) {
        number = EPIPE;  // a pipe accepts an empty write even without a reader
    }
    return number;
}

int client_finish_output(const char *program, int exit_code) {
    const int last = fflush(stdout) != 0 ? errno : 0;
    if (last == 0 && ferror(stdout) == 0) {
        return exit_code;
    }
    const int number = output_error(last);
    if (number == EPIPE) {
        return CLIENT_CLOSED_PIPE;
    }
    fprintf(stderr, "%s: writing to standard output failed%s%s\n", program, number != 0 ? ": " : "",
            number != 0 ? strerror(number) : "");
    return exit_code == CLIENT_OK ? CLIENT_FAILED : exit_code;
}

int client_main(int argc, char **argv, const struct client_command *commands, int command_count) {
    INVARIANT(command_count >= 1);
    if (!client_occupy_standard_streams()) {
        return CLIENT_FAILED;
    }
    // A reader that closes the pipe (head, less) must not stop a command half way through its
    // files.
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN);  // a size limit is reported like a full disk
    return client_finish_output("vergence", dispatch(argc, argv, commands, command_count));
}
