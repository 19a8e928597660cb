// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/workers.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

#include "core/invariant.h"
#include "daemon/base/thread.h"

// A run is published as one word: its number in the upper half, the parts not yet taken in the
// lower. Taking a part is one compare-and-swap of that word, so a thread that is late for a run can
// neither take a part of the next one by mistake nor does any thread have to wait for it.

enum { SPINS_BEFORE_SLEEP = 4000 };  // about 20..50 us: longer than the gaps between bands of rows

struct worker {
    struct workers *workers;
    int number;
};

struct workers {
    struct parallel parallel;
    pthread_t threads[WORKERS_MAX_THREADS];
    struct worker worker[WORKERS_MAX_THREADS];
    int started;

    _Atomic uint64_t ticket;      // run number << 32 | parts not yet taken
    _Atomic uint32_t unfinished;  // parts, taken or not, that are not done
    void (*_Atomic part)(void *context, int index);
    void *_Atomic context;
    _Atomic uint32_t count;

    atomic_flag busy;
    _Atomic bool stop;
    _Atomic int sleeping_count;
    _Atomic bool caller_sleeps;
    pthread_mutex_t mutex;  // only for sleeping and waking up
    pthread_cond_t wake, done;
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

/// Takes and does parts until none are left.
static void do_parts(struct workers *workers) {
    uint64_t ticket = atomic_load(&workers->ticket);
    while ((uint32_t)ticket != 0) {
        // These three belong to the ticket's run: they change only after all its parts were taken,
        // and then the compare-and-swap below fails.
        void (*part)(void *, int) = atomic_load(&workers->part);
        void *context = atomic_load(&workers->context);
        const uint32_t count = atomic_load(&workers->count);
        if (!atomic_compare_exchange_weak(&workers->ticket, &ticket, ticket - 1)) {
            continue;
        }
        INVARIANT(count >= (uint32_t)ticket);
        part(context, (int)(count - (uint32_t)ticket));
        if (atomic_fetch_sub(&workers->unfinished, 1) == 1 &&
            atomic_load(&workers->caller_sleeps)) {
            pthread_mutex_lock(&workers->mutex);
            pthread_cond_signal(&workers->done);
            pthread_mutex_unlock(&workers->mutex);
        }
        ticket = atomic_load(&workers->ticket);
    }
}

static bool has_work(struct workers *workers) {
    return (uint32_t)atomic_load(&workers->ticket) != 0 || atomic_load(&workers->stop);
}

static void wait_for_work(struct workers *workers) {
    for (int i = 0; i < SPINS_BEFORE_SLEEP; i++) {
        if (has_work(workers)) {
            return;
        }
        relax();
    }
    pthread_mutex_lock(&workers->mutex);
    atomic_fetch_add(&workers->sleeping_count, 1);
    while (!has_work(workers)) {
        pthread_cond_wait(&workers->wake, &workers->mutex);
    }
    atomic_fetch_sub(&workers->sleeping_count, 1);
    pthread_mutex_unlock(&workers->mutex);
}

// Number of the thread in its pool; 0 for other threads, including a pool's caller.
static _Thread_local int thread_number;

static int own_number(void *self) {
    (void)self;
    return thread_number;
}

static void *thread_main(void *argument) {
    const struct worker *worker = argument;
    struct workers *workers = worker->workers;
    thread_number = worker->number;
    while (!atomic_load(&workers->stop)) {
        do_parts(workers);
        wait_for_work(workers);
    }
    return NULL;
}

static void wake_all(struct workers *workers) {
    if (atomic_load(&workers->sleeping_count) > 0) {
        pthread_mutex_lock(&workers->mutex);
        pthread_cond_broadcast(&workers->wake);
        pthread_mutex_unlock(&workers->mutex);
    }
}

static void wait_for_others(struct workers *workers) {
    for (int i = 0; i < SPINS_BEFORE_SLEEP; i++) {
        if (atomic_load(&workers->unfinished) == 0) {
            return;
        }
        relax();
    }
    pthread_mutex_lock(&workers->mutex);
    atomic_store(&workers->caller_sleeps, true);
    while (atomic_load(&workers->unfinished) != 0) {
        pthread_cond_wait(&workers->done, &workers->mutex);
    }
    atomic_store(&workers->caller_sleeps, false);
    pthread_mutex_unlock(&workers->mutex);
}

static void run(void *self, void (*part)(void *context, int index), void *context, int count) {
    struct workers *workers = self;
    INVARIANT(count >= 0);
    if (count <= 1 || workers->started == 0 || atomic_flag_test_and_set(&workers->busy)) {
        for (int index = 0; index < count; index++) {
            part(context, index);
        }
        return;
    }
    atomic_store(&workers->part, part);
    atomic_store(&workers->context, context);
    atomic_store(&workers->count, (uint32_t)count);
    atomic_store(&workers->unfinished, (uint32_t)count);
    const uint64_t number = (atomic_load(&workers->ticket) >> 32) + 1;
    atomic_store(&workers->ticket, number << 32 | (uint32_t)count);
    wake_all(workers);
    do_parts(workers);
    wait_for_others(workers);
    atomic_flag_clear(&workers->busy);
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
    atomic_flag_clear(&workers->busy);
    pthread_mutex_init(&workers->mutex, NULL);
    pthread_cond_init(&workers->wake, NULL);
    pthread_cond_init(&workers->done, NULL);
    bool enough = true;
    while (workers->started < wanted - 1 && enough) {
        const int i = workers->started;
        workers->worker[i] = (struct worker){workers, i + 1};
        enough = thread_start(&workers->threads[i], thread_main, &workers->worker[i]);
        workers->started += enough ? 1 : 0;
    }
    workers->parallel = (struct parallel){.run = run,
                                          .self = workers,
                                          .threads = workers->started + 1,
                                          .thread = own_number,
                                          .relax = relax_or_yield};
    return workers;
}

void workers_destroy(struct workers *workers) {
    if (workers == NULL) {
        return;
    }
    atomic_store(&workers->stop, true);
    pthread_mutex_lock(&workers->mutex);
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
