// SPDX-License-Identifier: Apache-2.0
/// What is to be sent to one client: a buffer of fixed size that a command fills and the event loop
/// empties. Filling never waits: what does not fit is lost, and the buffer remembers that.
#ifndef VERGENCE_DAEMON_REPLY_OUTPUT_H
#define VERGENCE_DAEMON_REPLY_OUTPUT_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Longest reply, with some to spare: one command's reply always fits when its client has read
/// those before.
enum { OUTPUT_BYTES = 256 * 1024 };

/// Two threads may use it at a time.
struct output {
    pthread_mutex_t lock;
    char *data;  ///< OUTPUT_BYTES of them
    size_t head, length;
    bool closed;   ///< nobody reads any more: what comes is forgotten
    bool overrun;  ///< something was lost
    int wake_fd;   ///< an eventfd that tells the event loop
    char *kept;    ///< OUTPUT_BYTES of an answer that may be asked for again; NULL: none may
    size_t kept_bytes;
};

/// Allocates the memory. False: there is none.
bool output_open(struct output *self, int wake_fd);
void output_close(struct output *self);

/// Empties it for the next client.
void output_reset(struct output *self, bool closed);

void output_put(struct output *self, const void *data, size_t bytes);
void output_put_text(struct output *self, const char *text);

/// From here on answers can be kept. False: there is no memory.
bool output_open_kept(struct output *self);
/// Forgets what was kept; keeps more of an answer, unless there is too much of it; puts all of it
/// once more. Only one thread may use them at a time.
void output_keep_begin(struct output *self);
void output_keep(struct output *self, const char *data, size_t bytes);
void output_repeat(struct output *self);

/// Copies up to `capacity` bytes from the front without taking them; their number.
size_t output_peek(struct output *self, void *data, size_t capacity);
void output_take(struct output *self, size_t bytes);

size_t output_length(struct output *self);
bool output_overrun(struct output *self);

#ifdef __cplusplus
}
#endif

#endif
