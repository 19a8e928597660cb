// SPDX-License-Identifier: Apache-2.0
/// A PC in front of the instrument: asks a running vergenced. `vergence --connect [ADDRESS]`.
#ifndef VERGENCE_DAEMON_CLIENT_REMOTE_H
#define VERGENCE_DAEMON_CLIENT_REMOTE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/base/json_reader.h"
#include "daemon/client/remote_line.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    REMOTE_IDS = 1000000,
    REMOTE_REQUEST_BYTES = 640,
    REMOTE_WRITTEN_BYTES = 4096 + 64,
    REMOTE_EXIT_ERR = 1,
    REMOTE_EXIT_LINE = 3
};

/// A conversation.
struct remote {
    struct remote_line line;
    bool json;               ///< answers are shown as they come
    bool person;             ///< at a terminal, who can end the wait for a silent peer
    const char *token_path;  ///< of the token for TCP; NULL: the default one
    int bar_columns;         ///< of the progress that is shown on standard error; 0: none
    int32_t id;              ///< of the last request that wanted one, 0 .. 999999
    bool interrupted;        ///< by Ctrl-C: what runs is given up, and nothing new is begun
    bool refused;            ///< by the instrument, which said ERR to the last remote_call
    bool over;               ///< the instrument has obeyed a "quit": nothing more can be asked
    /// What may want attention while an answer is awaited, and who gives it; -1, NULL: none.
    int extra_fd;
    void (*attend)(struct remote *self);
};

/// Looks for attention without waiting. Whether the user has interrupted.
bool remote_interrupted(struct remote *self);

/// The user has interrupted: tells the instrument, once.
void remote_interrupt(struct remote *self);

/// The id of the next request.
int32_t remote_next_id(const struct remote *self);

/// The next line of an answer, until the next call; attends to the user meanwhile. 0;
/// ERROR_TIMEOUT: none has come for `limit_ms` (REMOTE_FOREVER_MS: never), on a serial line nothing
/// at all; ERROR_DEVICE.
int remote_receive(struct remote *self, int limit_ms, char **text);

/// What shows a line of an answer; `text` is its until the end of the call.
typedef void remote_show(struct remote *self, void *cookie, const char *text);

/// A file that came to be, here or there, or a directory of files.
struct remote_written {
    const char *name;
    bool directory;
    uint64_t files;  ///< of a directory
    uint64_t bytes;
};

/// Finds out that vergenced is at the other end of a socket, which its event loop answers at once,
/// whatever its threads do (a serial line is asked when it is opened); over TCP gives the token. A
/// peer that says nothing is given up after REMOTE_LINE_OPEN_MS from the opening of the line on; a
/// person gets a line on standard error then, and the wait goes on. 0; 1: the daemon turns the
/// client away, which `show` has seen; or with a message ERROR_DEVICE: the connection broke,
/// ERROR_VERSION: what answers is no vergenced, ERROR_TIMEOUT: nothing answers, ERROR_CANCELLED:
/// the user has interrupted, or an error of token_read.
int remote_greet(struct remote *self, remote_show *show, void *cookie, struct message *message);

/// Whether a word is meant to be an address (unix:PATH, ...): no command has such a name.
bool remote_is_address(const char *word);

/// Opens a line to the daemon of this user, else to the system's. 0, or an error with a message
/// that names all places where none was.
int remote_open_default(struct remote_line *line, struct message *message);

/// The command line `vergence --connect ...`; the process's exit code.
int remote_main(int argc, char **argv);

/// Sends a command and gives each line of the answer to `show`; waits for its end as long as it
/// takes. 0: OK; 1: ERR, which `show` has seen; with a message ERROR_DEVICE: the line broke,
/// ERROR_TIMEOUT: nothing sensible comes through a serial line, ERROR_CRC: rounds of a watch were
/// damaged there, ERROR_CANCELLED: it was interrupted, ERROR_SYNTAX: it is too long, ERROR_VERSION:
/// no vergenced answers, ERROR_MEMORY.
int remote_ask(struct remote *self, const char *command, remote_show *show, void *cookie,
               struct message *message);

/// The same over a serial line: nothing is shown that has not arrived as it was sent, and nothing
/// is carried out twice.
int remote_ask_sealed(struct remote *self, const char *command, remote_show *show, void *cookie,
                      struct message *message);

/// Asks for a JSON answer that arrives whole, several times if need be: for commands that may be
/// repeated. `*result` points into the line until the next call. 0; ERROR_DEVICE; ERROR_TIMEOUT:
/// nothing sensible came; ERROR_REFUSED: the daemon said ERR; ERROR_CANCELLED: interrupted; with a
/// message.
int remote_call(struct remote *self, const char *command, struct json_value *result,
                struct message *message);

/// A word as a line has it that a name may stand in, whatever it holds: in quotes. `text` has
/// REMOTE_REQUEST_BYTES. False: there is no room for it.
bool remote_quote(const char *word, char *text);

/// The line `files NAME`, or `files NAME AFTER` where `after` is not NULL. `command` has
/// REMOTE_REQUEST_BYTES. False: there is no room for it.
bool remote_files_command(const char *name, const char *after, char *command);

/// Shows a line `... what done/total` of an answer in text. False: it is none.
bool remote_show_progress(struct remote *self, const char *text);

/// How far something is, as a bar on standard error when that is a terminal; `total` 0 wipes it.
void remote_progress(struct remote *self, const char *what, uint64_t done, uint64_t total);

/// Fetches a file of the instrument into `local`, going on where an earlier try was broken off
/// (local.part holds it). What is there under that name and is no file is refused. 0, once the disk
/// has the file and its name, and the file's length in `*bytes`, or an error with a message.
int remote_fetch(struct remote *self, const char *name, const char *local, uint64_t *bytes,
                 struct message *message);

/// Whether the file `local` here is the same as the instrument's. 0 or an error with a message.
int remote_fetch_compare(struct remote *self, const char *name, const char *local, bool *same,
                         struct message *message);

/// Fetches all files of a directory of the instrument into the directory `local`, which is made.
/// Files of an earlier try are kept; a directory with anything else in it is refused, and nothing
/// is written to it. 0 or an error with a message.
int remote_fetch_directory(struct remote *self, const char *name, const char *local,
                           struct remote_written *written, struct message *message);

/// Sends a file of this machine to the instrument, where it gets the plain name `name`; goes on
/// where an earlier try was broken off. 0 and the file's length in `*bytes`, or an error with a
/// message.
int remote_send(struct remote *self, const char *local, const char *name, uint64_t *bytes,
                struct message *message);

/// Carries out a line "snapshot", which is `line`, and fetches the picture into the working
/// directory, under a name that nothing there has. What was written is shown as an answer; 1: the
/// instrument said ERR, which was shown. Else 0, or an error with a message.
int remote_snapshot(struct remote *self, const char *line, remote_show *show, void *cookie,
                    struct message *message);

/// Carries out a line that moves whole files: "fetch NAME [FILE]", also of a directory, "send FILE
/// [NAME]", "snapshot". 0: it is another one; else 1, and `*error` is that of remote_fetch,
/// remote_send or remote_snapshot. What was written is shown as an answer, in JSON also an error.
int remote_files(struct remote *self, const char *line, remote_show *show, void *cookie, int *error,
                 struct message *message);

/// Shows as an answer of the daemon what was written; an error (only in JSON); and in the form that
/// was asked for a line "ERR NAME sentence" of the daemon.
void remote_show_written(struct remote *self, remote_show *show, void *cookie,
                         const struct remote_written *written);
void remote_show_error(struct remote *self, remote_show *show, void *cookie, int error,
                       const char *message);
void remote_show_refusal(struct remote *self, remote_show *show, void *cookie, const char *text);

/// A person at a terminal. The process's exit code.
int remote_terminal(struct remote *self);

#ifdef __cplusplus
}
#endif

#endif
