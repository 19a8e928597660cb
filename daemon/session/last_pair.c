// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/last_pair.h"

#include <pthread.h>
#include <stdlib.h>

#include "core/invariant.h"

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;  // guards `pair` and `users`

void last_pair_give_back(struct captured_pair *pair) {
    if (pair == NULL) {
        return;
    }
    pthread_mutex_lock(&lock);
    INVARIANT(pair->users > 0);
    const bool unused = --pair->users == 0;
    pthread_mutex_unlock(&lock);
    if (unused) {
        pair_release(pair->pair.frame);
        free(pair);
    }
}

void last_pair_set(struct last_pair *self, struct captured_pair *pair) {
    pthread_mutex_lock(&lock);
    struct captured_pair *const old = self->pair;
    INVARIANT(pair == NULL || (pair != old && pair->users == 0));
    self->pair = pair;
    if (pair != NULL) {
        pair->users = 1;
    }
    pthread_mutex_unlock(&lock);
    last_pair_give_back(old);
}

struct captured_pair *last_pair_use(struct last_pair *self) {
    pthread_mutex_lock(&lock);
    struct captured_pair *const pair = self->pair;
    if (pair != NULL) {
        INVARIANT(pair->users > 0 && pair->pair.frame[RIG_LEFT].image.data != NULL);
        pair->users++;
    }
    pthread_mutex_unlock(&lock);
    return pair;
}
