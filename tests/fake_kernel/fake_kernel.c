// SPDX-License-Identifier: Apache-2.0
#include "fake_kernel.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "fake_file.h"
#include "fake_mtd.h"
#include "fake_video.h"

enum { WATCHES = 4, PLANS = 8, RECORD_BYTES = 1 << 20 };

enum effect { EFFECT_NONE, EFFECT_ERROR, EFFECT_KILL, EFFECT_HANG, EFFECT_HALVE, EFFECT_SLOW };

struct plan {
    enum effect effect;
    char what[128];
    unsigned after;  // matching calls to skip
    unsigned times;  // 0: for ever
    bool for_ever;
    int error;  // errno of the failing calls; EFFECT_SLOW: delay in ms
};

static pthread_mutex_t mutex = PTHREAD_RECURSIVE_MUTEX_INITIALIZER_NP;
static char watches[WATCHES][FAKE_PATH_BYTES];
static struct plan plans[PLANS];
static char record[RECORD_BYTES];
static size_t record_length;
static int record_fd = -1;
static unsigned calls;
static bool failed, time_is_virtual;
static uint64_t virtual_now_us, call_takes_us;

void fake_kernel_lock(void) {
    pthread_mutex_lock(&mutex);
}

void fake_kernel_unlock(void) {
    pthread_mutex_unlock(&mutex);
}

void fake_kernel_forget(void) {
    fake_kernel_lock();
    record[0] = '\0';
    record_length = 0;
    calls = 0;
    fake_kernel_unlock();
}

void fake_kernel_reset(void) {
    fake_kernel_lock();
    fake_kernel_forget();
    memset(watches, 0, sizeof watches);
    memset(plans, 0, sizeof plans);
    failed = time_is_virtual = false;
    call_takes_us = 0;
    fake_file_forget_all();
    fake_video_forget();
    fake_mtd_forget();
    fake_kernel_unlock();
}

static void stop(const char *why) {
    fprintf(stderr, "fake kernel: %s\n", why);
    abort();
}

const char *fake_kernel_record(void) {
    return record;
}

void fake_kernel_record_to(const char *path) {
    record_fd =
        (int)syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    if (record_fd < 0) {
        stop("the record's file cannot be opened");
    }
}

unsigned fake_kernel_calls(void) {
    return calls;
}

bool fake_kernel_failed(void) {
    return failed;
}

void fake_kernel_watch(const char *prefix) {
    for (int i = 0; i < WATCHES; i++) {
        if (watches[i][0] == '\0') {
            snprintf(watches[i], sizeof watches[i], "%s", prefix);
            return;
        }
    }
    stop("no room for another prefix");
}

bool fake_kernel_watches(const char *path, char *name, size_t bytes) {
    for (int i = 0; i < WATCHES; i++) {
        const size_t length = strlen(watches[i]);
        if (length > 0 && strncmp(path, watches[i], length) == 0) {
            const char *slash = strrchr(path, '/');
            snprintf(name, bytes, "%s", slash == NULL ? path : slash + 1);
            return true;
        }
    }
    return false;
}

bool fake_kernel_plug(const char *path, const char *file) {
    struct fake_device *device = fake_file_device_at(path);
    if (device != NULL) {
        snprintf(device->plug, sizeof device->plug, "%s", file);
    }
    return device != NULL;
}

static void add_plan(enum effect effect, const char *what, unsigned nth, int error,
                     unsigned times) {
    fake_kernel_lock();
    int i = 0;
    while (i < PLANS && plans[i].effect != EFFECT_NONE) {
        i++;
    }
    if (i == PLANS || nth == 0) {
        stop("no room for another failure, or one that was to be number 0");
    }
    plans[i] = (struct plan){
        .effect = effect, .after = nth - 1, .times = times, .for_ever = times == 0, .error = error};
    snprintf(plans[i].what, sizeof plans[i].what, "%s", what);
    fake_kernel_unlock();
}

void fake_kernel_fail(const char *what, unsigned nth, int error, unsigned times) {
    add_plan(EFFECT_ERROR, what, nth, error, times);
}

void fake_kernel_kill(const char *what, unsigned nth) {
    add_plan(EFFECT_KILL, what, nth, 0, 1);
}

void fake_kernel_hang(const char *what, unsigned nth) {
    add_plan(EFFECT_HANG, what, nth, 0, 1);
}

void fake_kernel_short(const char *what, unsigned nth, unsigned times) {
    add_plan(EFFECT_HALVE, what, nth, 0, times);
}

void fake_kernel_slow(const char *what, unsigned ms) {
    add_plan(EFFECT_SLOW, what, 1, (int)ms, 0);
}

/// Whether this plan applies now; counts the call.
static bool is_due(struct plan *plan, const char *line) {
    if (plan->effect == EFFECT_NONE || strstr(line, plan->what) == NULL) {
        return false;
    }
    // Sleeping fails only on a signal: a plan must name it explicitly.
    if (plan->what[0] == '\0' && strncmp(line, "clock ", 6) == 0) {
        return false;
    }
    if (plan->after > 0) {
        plan->after--;
        return false;
    }
    return true;
}

static void write_down(const char *line) {
    const size_t length = strlen(line);
    if (record_length + length + 2 > RECORD_BYTES) {
        record_length = 0;  // a long run keeps only the end of the record
    }
    memcpy(record + record_length, line, length);
    record_length += length;
    record[record_length++] = '\n';
    record[record_length] = '\0';
    calls++;
    if (record_fd >= 0) {
        syscall(SYS_write, record_fd, record + record_length - length - 1, length + 1);
    }
}

enum fake_fate fake_kernel_step(const char *name, const char *call, const char *details) {
    char line[FAKE_LINE_BYTES];
    const int at_call = snprintf(line, sizeof line, "%s %s%s%s", name, call,
                                 details[0] == '\0' ? "" : " ", details);
    if (at_call < 0) {
        stop("a line could not be written");
    }
    enum fake_fate fate = FAKE_RUN;
    bool hangs = false;
    int error = 0, slow_ms = 0;
    fake_kernel_lock();
    write_down(line);
    virtual_now_us += call_takes_us;
    for (int i = 0; i < PLANS; i++) {
        struct plan *plan = &plans[i];
        if (!is_due(plan, line)) {
            continue;
        }
        if (plan->effect == EFFECT_SLOW) {
            slow_ms += plan->error;
            continue;
        }
        failed = true;
        if (plan->effect == EFFECT_KILL) {
            syscall(SYS_kill, getpid(), SIGKILL);
        }
        hangs = hangs || plan->effect == EFFECT_HANG;
        fate = plan->effect == EFFECT_HALVE ? FAKE_HALVE : FAKE_FAIL;
        error = plan->error;
        if (!plan->for_ever && --plan->times == 0) {
            plan->effect = EFFECT_NONE;
        }
    }
    fake_kernel_unlock();
    if (slow_ms > 0) {
        syscall(SYS_nanosleep, &(struct timespec){slow_ms / 1000, slow_ms % 1000 * 1000000L}, NULL);
    }
    while (hangs) {
        syscall(SYS_ppoll, NULL, 0, NULL, NULL, 0);
    }
    if (fate == FAKE_FAIL) {
        errno = error;
    }
    return fate;
}

void fake_kernel_virtual_time(uint64_t now_us) {
    time_is_virtual = true;
    virtual_now_us = now_us;
}

bool fake_kernel_time_is_virtual(void) {
    return time_is_virtual;
}

uint64_t fake_kernel_now_us(void) {
    if (time_is_virtual) {
        return virtual_now_us;
    }
    struct timespec now;
    syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

void fake_kernel_advance(uint64_t us) {
    virtual_now_us += us;
}

void fake_kernel_call_takes(uint64_t us) {
    call_takes_us = us;
}

void fake_kernel_sleep_until(uint64_t until_us) {
    if (time_is_virtual) {
        virtual_now_us = until_us > virtual_now_us ? until_us : virtual_now_us;
        return;
    }
    const struct timespec until = {.tv_sec = (time_t)(until_us / 1000000),
                                   .tv_nsec = (long)(until_us % 1000000) * 1000};
    while (syscall(SYS_clock_nanosleep, CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL) != 0 &&
           errno == EINTR) {
    }
}
