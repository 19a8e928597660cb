// SPDX-License-Identifier: Apache-2.0
// C library functions that replace system calls: time and waiting.
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "fake_file.h"
#include "fake_kernel.h"

int __ppoll_chk(struct pollfd *polled, nfds_t count, const struct timespec *timeout,
                const sigset_t *signals, size_t room);
int __poll_chk(struct pollfd *polled, nfds_t count, int timeout_ms, size_t room);

static const uint64_t never_us = UINT64_MAX;
// Maximum time between polls of real files while devices are also waited for.
static const uint64_t look_again_us = 5000;

int clock_gettime(clockid_t clock, struct timespec *now) {
    if (clock == CLOCK_MONOTONIC && fake_kernel_time_is_virtual()) {
        const uint64_t now_us = fake_kernel_now_us();
        *now = (struct timespec){.tv_sec = (time_t)(now_us / 1000000),
                                 .tv_nsec = (long)(now_us % 1000000) * 1000};
        return 0;
    }
    return (int)syscall(SYS_clock_gettime, clock, now);
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *until,
                    struct timespec *left) {
    if (clock == CLOCK_MONOTONIC && fake_kernel_time_is_virtual()) {
        // As in the kernel: no time passes, and the function returns the error number.
        if (fake_kernel_step("clock", "sleep", flags == TIMER_ABSTIME ? "until" : "for") ==
            FAKE_FAIL) {
            return errno;
        }
        const uint64_t time_us =
            (uint64_t)until->tv_sec * 1000000 + (uint64_t)until->tv_nsec / 1000;
        fake_kernel_sleep_until(flags == TIMER_ABSTIME ? time_us : fake_kernel_now_us() + time_us);
        return 0;
    }
    return syscall(SYS_clock_nanosleep, clock, flags, until, left) == 0 ? 0 : errno;
}

static int poll_really(struct pollfd *polled, nfds_t count, const struct timespec *timeout,
                       const sigset_t *signals) {
    // The kernel modifies its timeout argument.
    struct timespec copy = {0};
    if (timeout != NULL) {
        copy = *timeout;
    }
    return (int)syscall(SYS_ppoll, polled, count, timeout == NULL ? NULL : &copy, signals,
                        _NSIG / 8);
}

/// Polls every descriptor once. `*next_us`: when a device may have news.
static int poll_once(struct pollfd *polled, nfds_t count, uint64_t *next_us, bool *has_real) {
    static const struct timespec at_once = {0};
    int ready = 0;
    for (nfds_t i = 0; i < count; i++) {
        struct fake_file *file = fake_file_of(polled[i].fd);
        polled[i].revents = 0;
        if (file == NULL || file->operations == NULL) {
            *has_real = true;
            ready += poll_really(&polled[i], 1, &at_once, NULL) > 0;
        } else if (fake_file_is_dead(file)) {
            polled[i].revents = POLLERR | POLLHUP;
            ready++;
        } else if (file->operations->poll != NULL) {
            const int always = POLLERR | POLLHUP | POLLNVAL;
            fake_kernel_lock();
            const int events = file->operations->poll(file, fake_kernel_now_us(), next_us);
            fake_kernel_unlock();
            polled[i].revents = (short)(events & (polled[i].events | always));
            ready += polled[i].revents != 0;
        }
    }
    return ready;
}

static int poll_until(struct pollfd *polled, nfds_t count, uint64_t deadline_us) {
    for (;;) {
        uint64_t next_us = never_us;
        bool has_real = false;
        const int ready = poll_once(polled, count, &next_us, &has_real);
        const uint64_t now_us = fake_kernel_now_us();
        if (ready > 0 || now_us >= deadline_us) {
            return ready;
        }
        if (has_real && !fake_kernel_time_is_virtual() && next_us > now_us + look_again_us) {
            next_us = now_us + look_again_us;
        }
        if (next_us == never_us && deadline_us == never_us) {
            fprintf(stderr, "fake kernel: a wait for something that never comes\n");
            abort();
        }
        fake_kernel_sleep_until(next_us < deadline_us ? next_us : deadline_us);
    }
}

int ppoll(struct pollfd *polled, nfds_t count, const struct timespec *timeout,
          const sigset_t *signals) {
    struct fake_file *file = NULL;
    bool devices = false;
    for (nfds_t i = 0; i < count; i++) {
        struct fake_file *one = fake_file_of(polled[i].fd);
        file = file == NULL ? one : file;
        devices = devices || (one != NULL && one->operations != NULL);
    }
    if (file == NULL) {
        return poll_really(polled, count, timeout, signals);
    }
    const uint64_t timeout_us =
        timeout == NULL ? never_us
                        : (uint64_t)timeout->tv_sec * 1000000 + (uint64_t)timeout->tv_nsec / 1000;
    char details[64] = "";
    const int events = polled[0].events;
    snprintf(details, sizeof details, "%s", (events & POLLOUT) != 0 ? "out" : "in");
    if (fake_kernel_time_is_virtual()) {
        snprintf(details + strlen(details), sizeof details - strlen(details), " %lluus",
                 (unsigned long long)timeout_us);
    }
    if (fake_kernel_step(file->name, "poll", details) == FAKE_FAIL) {
        return -1;
    }
    if (!devices && !fake_kernel_time_is_virtual()) {
        return poll_really(polled, count, timeout, signals);
    }
    return poll_until(polled, count,
                      timeout_us == never_us ? never_us : fake_kernel_now_us() + timeout_us);
}

int poll(struct pollfd *polled, nfds_t count, int timeout_ms) {
    const struct timespec timeout = {.tv_sec = timeout_ms / 1000,
                                     .tv_nsec = timeout_ms % 1000 * 1000000L};
    return ppoll(polled, count, timeout_ms < 0 ? NULL : &timeout, NULL);
}

int __ppoll_chk(struct pollfd *polled, nfds_t count, const struct timespec *timeout,
                const sigset_t *signals, size_t room) {
    if (room / sizeof *polled < count) {
        abort();
    }
    return ppoll(polled, count, timeout, signals);
}

int __poll_chk(struct pollfd *polled, nfds_t count, int timeout_ms, size_t room) {
    if (room / sizeof *polled < count) {
        abort();
    }
    return poll(polled, count, timeout_ms);
}
