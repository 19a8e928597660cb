// SPDX-License-Identifier: Apache-2.0
/// The client's side of a connection to a running vergenced: `vergence --connect [ADDRESS]`.
#ifndef VERGENCE_DAEMON_CLIENT_REMOTE_H
#define VERGENCE_DAEMON_CLIENT_REMOTE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "console/command_words.h"
#include "daemon/base/json.h"
#include "daemon/client/remote_line.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    REMOTE_REQUEST_BYTES = 640,
    REMOTE_WRITTEN_BYTES = 4096,
    REMOTE_STEP_BYTES = 160,
    REMOTE_EXIT_ERR = 1,
    REMOTE_EXIT_LINE = 3
};

struct client_command;
struct remote;

/// Takes bytes that come before an answer; `cookie` is that of remote_ask.
typedef void remote_take(struct remote *self, void *cookie, const void *bytes, size_t length);

/// A connection in use.
struct remote {
    struct remote_line line;
    bool json;               ///< answers are shown unchanged
    bool interactive;        ///< a user is there, who can end the wait for a silent peer
    const char *token_path;  ///< file of the token for TCP; NULL: the default file
    int bar_columns;         ///< width of the progress shown on standard error; 0: none
    remote_take *take;       ///< asks for such bytes, over a socket; NULL: does not
    struct cJSON *answer;    ///< answer to the last remote_call; freed with the connection
    bool interrupted;        ///< Ctrl-C was pressed: the command is cancelled, no new one starts
    bool refused;            ///< the instrument answered ERR to the last remote_call
    /// The client's own commands; NULL: it has none.
    const struct client_command *measure, *reconstruct;
    int measure_exit;              ///< its exit code, after remote_measure
    bool shows_steps;              ///< remote_keep_step keeps decisions
    char step[REMOTE_STEP_BYTES];  ///< the last one shown
    bool over;                     ///< "quit" was sent: no more commands can follow
    /// Another descriptor to watch while waiting for an answer, and its handler; -1, NULL: none.
    int extra_fd;
    void (*service)(struct remote *self);
};

/// Handles user input without waiting. Returns whether the user has interrupted.
bool remote_interrupted(struct remote *self);

/// Handles an interrupt by the user: reports it to the instrument, once.
void remote_interrupt(struct remote *self);

/// Receives the next line of an answer, valid until the next call; handles user input meanwhile. 0;
/// ERROR_TIMEOUT: none for `silence_ms` (REMOTE_FOREVER_MS: never), on a serial line nothing at
/// all, or for longer if the instrument has said that it is busy (console/line/framing.h);
/// ERROR_DEVICE.
int remote_receive(struct remote *self, int silence_ms, char **text);

/// Receives exactly `bytes` bytes, which come with an answer over a socket; handles user input
/// meanwhile. False: connection lost.
bool remote_receive_bytes(struct remote *self, void *data, size_t bytes);

/// Receives the bytes that a line of an answer announces, and passes them to `take`. 1; 0: it is
/// another line; ERROR_DEVICE: connection lost; ERROR_VERSION: too many.
int remote_receive_part(struct remote *self, void *cookie, const char *line);

/// Shows a line of an answer; may change `text` until it returns.
typedef void remote_show(struct remote *self, void *cookie, const char *text);

/// A file that was written, here or on the instrument, or a directory of files.
struct remote_written {
    char name[REMOTE_WRITTEN_BYTES];
    bool directory;
    uint64_t files;  ///< number of files in the directory
    uint64_t bytes;
};

/// Checks that vergenced is at the other end of a socket; its event loop answers at once,
/// whatever its threads do (a serial line is verified when it is opened). Over TCP sends the token.
/// A peer that does not answer is given up REMOTE_LINE_OPEN_MS after the line was opened; an
/// interactive user gets a line on standard error instead, and the wait continues. 0; 1: the daemon
/// rejects the client, with a reason that went to `show`; or with a message ERROR_DEVICE:
/// connection lost, ERROR_VERSION: the peer is not vergenced, ERROR_TIMEOUT: no answer,
/// ERROR_CANCELLED: interrupted by the user, or an error of token_read.
int remote_greet(struct remote *self, remote_show *show, void *cookie, struct message *message);

/// Whether a word is an address (unix:PATH, ...): no command has such a name.
bool remote_is_address(const char *word);

/// Connects to the daemon of this user, else to the system's. 0, or an error with a message that
/// names all sockets tried, and leaves the cause for the last one in errno.
int remote_open_default(struct remote_line *line, struct message *message);

/// Runs the command line `vergence --connect ...`; returns the process's exit code. `measure`,
/// `reconstruct`: the client's own commands of these names; NULL: it has none.
int remote_main(int argc, char **argv, const struct client_command *measure,
                const struct client_command *reconstruct);

/// Sends a command and passes each line of the answer to `show`; waits for its end without a limit.
/// Over a serial line only lines that arrived undamaged are shown; a command that arrived damaged,
/// or that only reads, is repeated, and of another one it is unknown whether it was executed.
/// 0: OK; 1: ERR, which went to `show`; with a message ERROR_DEVICE: connection lost,
/// ERROR_TIMEOUT: nothing valid arrives over a serial line, ERROR_CRC: rounds of a watch were
/// damaged there, ERROR_CANCELLED: interrupted, ERROR_SYNTAX: too long, ERROR_VERSION: the peer is
/// not vergenced, ERROR_MEMORY.
int remote_ask(struct remote *self, const char *command, remote_show *show, void *cookie,
               struct message *message);

/// Requests a JSON answer, for commands that may be repeated. `*result` is valid until the next
/// call. 0; ERROR_REFUSED: the daemon answered ERR; other errors of remote_ask; all with a message.
int remote_call(struct remote *self, const char *command, const struct cJSON **result,
                struct message *message);

/// Quotes a word for a command line, so that it may contain anything. `text` has
/// REMOTE_REQUEST_BYTES. False: it does not fit.
bool remote_quote(const char *word, char *text);

/// Calls `VERB "NAME" REST`. Errors of remote_call.
__attribute__((format(printf, 6, 7))) int remote_call_about(struct remote *self, const char *verb,
                                                            const char *name,
                                                            const struct cJSON **result,
                                                            struct message *message,
                                                            const char *rest, ...);

/// Length and CRC-32 of an open file. False: it cannot be read.
bool remote_sum_file(int fd, uint64_t *size, uint32_t *crc);

/// Keeps a line of progress on standard error, once, above the bar and also where that is not a
/// terminal: that a command waits for another client's, and with `shows_steps` each decision of
/// `measure` ("aim: the subject is ...").
void remote_keep_step(struct remote *self, const char *what);

/// Shows a line `... what done/total` of a text answer as progress. False: not such a line.
bool remote_show_progress(struct remote *self, const char *text);

/// Draws a progress bar on standard error if that is a terminal; `total` 0 erases it.
void remote_progress(struct remote *self, const char *what, uint64_t done, uint64_t total);

/// Fetches a file of the instrument into `local` (NULL: its own name), resuming an earlier attempt
/// (kept in local.part); anything at that path that is not a file is an error. Or all files of a
/// directory into the directory `local`, which is created: files of an earlier attempt are kept; if
/// it contains anything else, that is an error. 0 once the disk has all, or an error with a
/// message.
int remote_fetch(struct remote *self, const char *name, const char *local,
                 struct remote_written *written, struct message *message);

/// As remote_fetch, of what a command has just made: an error other than ERROR_REFUSED says how to
/// get it later, and which command of the PC (`then`; NULL: none) is next.
int remote_fetch_result(struct remote *self, const char *name, const char *local, const char *then,
                        struct remote_written *written, struct message *message);

/// Puts the first free name for a new local file into `local`: `name`, else with a number before
/// its extension.
void remote_free_name(const char *name, char *local, size_t bytes);

/// Runs a line that moves whole files: "fetch NAME [FILE]" (also of a directory), "send FILE
/// [NAME]", and commands that make files, which are fetched: "view", "focus-curve", "measure",
/// "reconstruct" unless it names its files. 0: not such a line; else 1, with its result in
/// `*error`, as of remote_ask. Written files are shown as an answer, in JSON errors too.
int remote_files(struct remote *self, const char *line, remote_show *show, void *cookie, int *error,
                 struct message *message);

/// Runs `measure NAME ...`: the instrument measures; the session is fetched and the client's own
/// `measure` makes its surface here, with the options that only the PC has, which are checked
/// before. Over a serial line, or without that command, the instrument's surface is fetched. Runs
/// `reconstruct ...`, too: the surface comes in its compact form, over a socket as it is made
/// there, and the client's own `reconstruct` makes all files of it. As remote_ask; `measure_exit`
/// is the exit code of the client's own command, or of that check.
int remote_measure(struct remote *self, const struct command_words *words, remote_show *show,
                   void *cookie, struct message *message);

/// Show, in the form of the daemon's answers: what was written (in text without the OK); an error
/// (JSON only); and a line "ERR NAME sentence" of the daemon, in the form that was requested.
void remote_show_written(struct remote *self, remote_show *show, void *cookie,
                         const struct remote_written *written);
void remote_show_error(struct remote *self, remote_show *show, void *cookie, int error,
                       const char *message);
void remote_show_rejection(struct remote *self, remote_show *show, void *cookie, const char *text);

/// Runs a line of a script or of a terminal, or the command of the command line. Its exit code.
int remote_run_line(struct remote *self, const char *line);

/// Takes a Ctrl-C of the user that is waiting at `extra_fd`; false: none was.
bool remote_take_signal(struct remote *self);

/// Runs an interactive session at a terminal; returns the process's exit code.
int remote_terminal(struct remote *self);

#ifdef __cplusplus
}
#endif

#endif
