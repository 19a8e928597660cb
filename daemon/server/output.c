// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/output.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/invariant.h"
#include "daemon/base/monotonic.h"

enum { AWAIT_US = 50000 };

bool output_open(struct output *self, int wake_fd) {
    *self = (struct output){.wake_fd = wake_fd, .closed = true};
    self->data = malloc(OUTPUT_BYTES);
    pthread_condattr_t attributes;
    if (self->data == NULL || pthread_mutex_init(&self->lock, NULL) != 0 ||
        pthread_condattr_init(&attributes) != 0) {
        return false;
    }
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    const bool ready = pthread_cond_init(&self->taken, &attributes) == 0;
    pthread_condattr_destroy(&attributes);
    return ready;
}

void output_close(struct output *self) {
    free(self->data);
    self->data = NULL;
    pthread_cond_destroy(&self->taken);
    pthread_mutex_destroy(&self->lock);
}

void output_reset(struct output *self, bool closed) {
    pthread_mutex_lock(&self->lock);
    self->head = 0;
    self->length = 0;
    self->closed = closed;
    self->overrun = false;
    pthread_cond_signal(&self->taken);
    pthread_mutex_unlock(&self->lock);
}

/// Copies to the end. The bytes must fit.
static void append(struct output *self, const char *data, size_t bytes) {
    INVARIANT(self->length + bytes <= OUTPUT_BYTES);
    INVARIANT(self->head < OUTPUT_BYTES && !self->closed);
    const size_t tail = (self->head + self->length) % OUTPUT_BYTES;
    const size_t first = bytes < OUTPUT_BYTES - tail ? bytes : OUTPUT_BYTES - tail;
    memcpy(self->data + tail, data, first);
    memcpy(self->data, data + first, bytes - first);
    self->length += bytes;
}

void output_put(struct output *self, const void *data, size_t bytes) {
    if (bytes == 0) {
        return;
    }
    INVARIANT(self->data != NULL);
    pthread_mutex_lock(&self->lock);
    const bool wake = self->length == 0;
    if (!self->closed && bytes <= OUTPUT_BYTES - self->length) {
        append(self, data, bytes);
    } else {
        self->overrun = self->overrun || !self->closed;
    }
    pthread_mutex_unlock(&self->lock);
    if (wake) {
        const uint64_t one = 1;
        const ssize_t written = write(self->wake_fd, &one, sizeof one);
        (void)written;  // fails only if the counter is at its maximum, which wakes the loop too
    }
}

void output_put_text(struct output *self, const char *text) {
    output_put(self, text, strlen(text));
}

bool output_await(struct output *self) {
    const struct timespec until = monotonic_timespec(monotonic_now_us() + AWAIT_US);
    pthread_mutex_lock(&self->lock);
    int waited = 0;
    while (self->length > OUTPUT_BACKLOG_BYTES && waited == 0) {
        waited = pthread_cond_timedwait(&self->taken, &self->lock, &until);
    }
    const bool has_room = self->length <= OUTPUT_BACKLOG_BYTES;
    pthread_mutex_unlock(&self->lock);
    return has_room;
}

static void put(void *self, const void *data, size_t bytes) {
    output_put(self, data, bytes);
}

struct reply_sink output_sink(struct output *self) {
    return (struct reply_sink){put, self};
}

size_t output_peek(struct output *self, void *data, size_t capacity) {
    pthread_mutex_lock(&self->lock);
    const size_t bytes = self->length < capacity ? self->length : capacity;
    const size_t first = bytes < OUTPUT_BYTES - self->head ? bytes : OUTPUT_BYTES - self->head;
    memcpy(data, self->data + self->head, first);
    memcpy((char *)data + first, self->data, bytes - first);
    pthread_mutex_unlock(&self->lock);
    return bytes;
}

void output_take(struct output *self, size_t bytes) {
    pthread_mutex_lock(&self->lock);
    // A reset between peek and take may have emptied it.
    const size_t taken = bytes < self->length ? bytes : self->length;
    self->head = (self->head + taken) % OUTPUT_BYTES;
    self->length -= taken;
    pthread_cond_signal(&self->taken);
    INVARIANT(self->head < OUTPUT_BYTES && self->length <= OUTPUT_BYTES);
    pthread_mutex_unlock(&self->lock);
}

size_t output_length(struct output *self) {
    pthread_mutex_lock(&self->lock);
    const size_t length = self->length;
    pthread_mutex_unlock(&self->lock);
    INVARIANT(length <= OUTPUT_BYTES);
    return length;
}

bool output_overrun(struct output *self) {
    pthread_mutex_lock(&self->lock);
    const bool overrun = self->overrun;
    pthread_mutex_unlock(&self->lock);
    return overrun;
}
