// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/workers.h"

#include <pthread.h>
#include <sched.h>
#include <stdbool.h>
#include <stdlib.h>

#include "core/invariant.h"
#include "daemon/base/thread.h"

enum { SPINS_BEFORE_SLEEP = 4000 };  // takes about 20..50 us, which is longer than most gaps

struct workers {
    struct parallel parallel;
    pthread_t threads[WORKERS_MAX_THREADS];
    int started;

    pthread_mutex_t mutex;  // guards what follows; the atomics are also read without it, to spin
    pthread_cond_t wake, done;
    bool busy;
    void (*part)(void *context, int index);
    void *context;
    int count;
    _Atomic int left;        // parts not yet taken
    _Atomic int unfinished;  // parts, taken or not, that are not done
    _Atomic bool stop;
};

static void relax(void) {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    __asm__ volatile("yield");
#endif
}

// For parts that wait for others, whose thread may not be running.
static void relax_or_yield(void *self) {
    (void)self;
    enum { SPINS_BEFORE_YIELD = 256 };
    static _Thread_local unsigned spins;
    if (++spins % SPINS_BEFORE_YIELD == 0) {
        sched_yield();
    } else {
        relax();
    }
}

/// Takes and does parts until none are left; the mutex is locked before and after.
static void do_parts(struct workers *workers) {
    while (workers->left > 0) {
        const int index = workers->count - workers->left--;
        void (*part)(void *, int) = workers->part;
        void *context = workers->context;
        pthread_mutex_unlock(&workers->mutex);
        part(context, index);
        pthread_mutex_lock(&workers->mutex);
        INVARIANT(workers->unfinished > workers->left);
        if (--workers->unfinished == 0) {
            pthread_cond_signal(&workers->done);
        }
    }
}

static bool has_work(struct workers *workers) {
    return workers->left > 0 || workers->stop;
}

static bool is_finished(struct workers *workers) {
    return workers->unfinished == 0;
}

/// Waits, spinning first; the mutex is locked before and after.
static void wait_until(bool (*holds)(struct workers *), struct workers *workers,
                       pthread_cond_t *condition) {
    pthread_mutex_unlock(&workers->mutex);
    for (int i = 0; i < SPINS_BEFORE_SLEEP && !holds(workers); i++) {
        relax();
    }
    pthread_mutex_lock(&workers->mutex);
    while (!holds(workers)) {
        pthread_cond_wait(condition, &workers->mutex);
    }
}

static void *thread_main(void *argument) {
    struct workers *workers = argument;
    pthread_mutex_lock(&workers->mutex);
    while (!workers->stop) {
        do_parts(workers);
        wait_until(has_work, workers, &workers->wake);
    }
    pthread_mutex_unlock(&workers->mutex);
    return NULL;
}

static void run(void *self, void (*part)(void *context, int index), void *context, int count) {
    struct workers *workers = self;
    INVARIANT(count >= 0);
    pthread_mutex_lock(&workers->mutex);
    if (count <= 1 || workers->started == 0 || workers->busy) {
        pthread_mutex_unlock(&workers->mutex);
        for (int index = 0; index < count; index++) {
            part(context, index);
        }
        return;
    }
    INVARIANT(workers->left == 0 && workers->unfinished == 0);
    workers->busy = true;
    workers->part = part;
    workers->context = context;
    workers->count = count;
    workers->unfinished = count;
    workers->left = count;
    pthread_cond_broadcast(&workers->wake);
    do_parts(workers);
    wait_until(is_finished, workers, &workers->done);
    workers->busy = false;
    pthread_mutex_unlock(&workers->mutex);
}

static int usable_processors(void) {
    cpu_set_t set;
    CPU_ZERO(&set);
    return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

struct workers *workers_create(int threads) {
    INVARIANT(threads >= 0);
    struct workers *workers = calloc(1, sizeof *workers);
    if (workers == NULL) {
        return NULL;
    }
    int wanted = threads > 0 ? threads : usable_processors();
    wanted = wanted > WORKERS_MAX_THREADS ? WORKERS_MAX_THREADS : wanted;
    pthread_mutex_init(&workers->mutex, NULL);
    pthread_cond_init(&workers->wake, NULL);
    pthread_cond_init(&workers->done, NULL);
    bool enough = true;
    while (workers->started < wanted - 1 && enough) {
        enough = thread_start(&workers->threads[workers->started], thread_main, workers);
        workers->started += enough ? 1 : 0;
    }
    workers->parallel = (struct parallel){
        .run = run, .self = workers, .threads = workers->started + 1, .relax = relax_or_yield};
    return workers;
}

void workers_destroy(struct workers *workers) {
    if (workers == NULL) {
        return;
    }
    pthread_mutex_lock(&workers->mutex);
    INVARIANT(!workers->busy && workers->left == 0 && workers->unfinished == 0);
    workers->stop = true;
    pthread_cond_broadcast(&workers->wake);
    pthread_mutex_unlock(&workers->mutex);
    for (int i = 0; i < workers->started; i++) {
        pthread_join(workers->threads[i], NULL);
    }
    pthread_cond_destroy(&workers->done);
    pthread_cond_destroy(&workers->wake);
    pthread_mutex_destroy(&workers->mutex);
    free(workers);
}

const struct parallel *workers_parallel(struct workers *workers) {
    return &workers->parallel;
}
