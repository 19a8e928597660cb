// SPDX-License-Identifier: Apache-2.0
/// Output buffer of one client, of fixed size: a command fills it, the event loop empties it.
/// Filling never blocks: data that does not fit is dropped and `overrun` is set. Who has more than
/// an answer waits for the client first.
#ifndef VERGENCE_DAEMON_SERVER_OUTPUT_H
#define VERGENCE_DAEMON_SERVER_OUTPUT_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>

#include "console/line/reply.h"

/// Larger than the longest reply: a command's reply always fits once its client has read the
/// earlier ones.
enum { OUTPUT_BYTES = 256 * 1024 };
/// A client that has more to read gets no further answer, and no part of a stream.
enum { OUTPUT_BACKLOG_BYTES = OUTPUT_BYTES / 4 };

/// Two threads may use it at a time: a writer and a reader.
struct output {
    pthread_mutex_t lock;
    pthread_cond_t taken;  ///< data was removed
    char *data;            ///< OUTPUT_BYTES of them
    size_t head, length;
    bool closed;   ///< no reader: new data is discarded
    bool overrun;  ///< data was dropped
    int wake_fd;   ///< eventfd that wakes the event loop
};

/// Allocates the buffer; initially closed. False: out of memory.
bool output_open(struct output *self, int wake_fd);
void output_close(struct output *self);

/// Empties it for the next client. `closed`: discard everything until the next reset.
void output_reset(struct output *self, bool closed);

void output_put(struct output *self, const void *data, size_t bytes);
void output_put_text(struct output *self, const char *text);
/// Waits until its backlog is small enough for more. False: not within 50 ms.
bool output_await(struct output *self);
/// For answers that go to it.
struct reply_sink output_sink(struct output *self);

/// Copies up to `capacity` bytes from the front without removing them; returns their number.
size_t output_peek(struct output *self, void *data, size_t capacity);
/// Removes bytes from the front, at most those present.
void output_take(struct output *self, size_t bytes);

size_t output_length(struct output *self);
bool output_overrun(struct output *self);

#endif
