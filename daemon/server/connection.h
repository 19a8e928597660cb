// SPDX-License-Identifier: Apache-2.0
/// A client of the daemon: somebody at a terminal, or a program that sends lines. All of it is the
/// event loop's, but for the job that a crew carries out meanwhile.
#ifndef VERGENCE_DAEMON_SERVER_CONNECTION_H
#define VERGENCE_DAEMON_SERVER_CONNECTION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/cli/editor.h"
#include "daemon/reply/job.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    CONNECTION_INPUT_BYTES = 16384,
    CONNECTION_NAME_BYTES = 64,
    CONNECTION_IDLE = 0x16  ///< SYN: a command of a sealed line is under way
};

enum connection_kind {
    CONNECTION_LINES,  ///< lines in, answers out
    /// Prompt, echo, line editing; `@program` makes it lines for a program, `@sealed` lines that
    /// are carried out with their CRC alone.
    CONNECTION_TERMINAL,
};

/// What the connection needs of the server; `self` is the server.
struct connection_host {
    /// Queues the job; when there is no room answers so, and the job is JOB_FREE again.
    void (*submit)(void *self, struct job *job);
    /// Takes a job back that no crew has begun. False: one has.
    bool (*withdraw)(void *self, struct job *job);
    /// Answers at once, with an error or (0) without one; no crew has the job.
    void (*answer)(void *self, struct job *job, int error, const char *message);
    /// Parses what `job` asks for; see command_parse.
    int (*parse)(void *self, const char *line, struct job *job, char *message,
                 size_t message_bytes);
    /// Completion for terminals; see editor.h.
    void (*complete)(void *self, const char *typed, char *words);
    void *self;
};

struct connection {
    bool used;
    bool greeted;          ///< a line has come that makes sense; over TCP the token
    const char *token;     ///< that the first line must give; NULL: none
    uint64_t begun_us;     ///< when a client came that has yet to greet
    const char *hangs_up;  ///< why the daemon ends the connection, for the log; NULL: it does not
    bool lasting;          ///< a terminal of the daemon's own: comes back after its end
    enum connection_kind kind;
    bool program;  ///< a terminal whose other end is a program
    bool sealed;   ///< which seals its lines
    int in_fd, out_fd;
    char name[CONNECTION_NAME_BYTES];
    const struct connection_host *host;
    struct output output;
    struct job job;
    bool json, progress;  ///< asked for all lines to come
    bool ended;           ///< no more input: to be closed when all is answered
    bool gone;            ///< nobody is there any more
    int32_t once_id;      ///< of the last command that is carried out once; REQUEST_ID_NONE
    char input[CONNECTION_INPUT_BYTES];
    size_t input_bytes;
    size_t refused_bytes;  ///< of them, with lines that a Ctrl-C came behind
    bool ctrl_c_ahead;     ///< one comes, behind more lines than there is room for
    uint64_t looked_us;    ///< when that was last looked for
    uint64_t heard_us;     ///< when something came last
    bool skipping;         ///< the rest of a line that was too long
    bool overflowed;       ///< a terminal's: what has come behind the input since then was dropped
    bool dropping;         ///< up to the middle of a line
    size_t dropped_lines;
    uint64_t watch_us;    ///< when the next round of a watch is due
    uint64_t life_us;     ///< when a sign of life was last given
    uint64_t stalled_us;  ///< since when the client has not read; 0: it reads
    struct editor editor;
};

/// Allocates the output; of a `terminal` also what keeps an answer. False: no memory.
bool connection_init(struct connection *self, const struct connection_host *host, int wake_fd,
                     bool terminal);
void connection_destroy(struct connection *self);

/// A client has come.
void connection_begin(struct connection *self, enum connection_kind kind, int in_fd, int out_fd,
                      const char *name);
/// The client that has come at `now_us` has yet to greet, and to give the token unless that is
/// NULL.
void connection_await_greeting(struct connection *self, const char *token, uint64_t now_us);
/// Whether a person types there now.
bool connection_is_edited(const struct connection *self);
/// Whether a command is under way, or a watch.
bool connection_is_busy(const struct connection *self);
/// Nobody is there any more: what runs or waits is cancelled.
void connection_gone(struct connection *self);
/// Does what is due: takes an answer that is finished, begins the next line or round.
void connection_step(struct connection *self, uint64_t now_us);
/// When the next round of a watch is due; UINT64_MAX: never.
uint64_t connection_due_us(const struct connection *self);
/// Sends what the client takes now.
void connection_send(struct connection *self, uint64_t now_us);
/// Whether all is over and it may be closed.
bool connection_over(struct connection *self);

#ifdef __cplusplus
}
#endif

#endif
