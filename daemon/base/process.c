// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/process.h"

#include <signal.h>
#include <stdio.h>
#include <unistd.h>

// Written into the build directory by build_id.cmake.
#include "build_id.h"
#include "core/invariant.h"

const char *version_text(void) {
    return VERGENCE_VERSION;
}

const char *version_build_id(void) {
    return VERGENCE_BUILD_ID;
}

const char *version_build_date(void) {
    return VERGENCE_BUILD_DATE;
}

static volatile sig_atomic_t caught_signal;

static _Thread_local struct {
    bool (*should_stop)(void *self);
    void *self;
} asked;

/// Calls only async-signal-safe functions.
static void set_handler(int number, void (*handler)(int)) {
    struct sigaction action = {.sa_handler = handler};
    sigemptyset(&action.sa_mask);
    sigaction(number, &action, NULL);
}

static void end_at_once(int number) {
    static const char text[] =
        "vergence: ended at once; a hidden directory .vergence-* may remain, which the next run "
        "removes\n";
    const ssize_t written = write(STDERR_FILENO, text, sizeof text - 1);
    (void)written;  // nothing can be done about a failure
    set_handler(number, SIG_DFL);
    raise(number);
}

static void remember(int number) {
    caught_signal = number;
    set_handler(number, end_at_once);
}

static void set_handlers(void (*handler)(int)) {
    static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
    for (size_t i = 0; i < sizeof signals / sizeof signals[0]; i++) {
        struct sigaction old;
        if (sigaction(signals[i], NULL, &old) == 0 && old.sa_handler != SIG_IGN) {
            set_handler(signals[i], handler);
        }
    }
}

void interrupt_catch(void) {
    set_handlers(remember);
}

void interrupt_release(void) {
    set_handlers(SIG_DFL);
    caught_signal = 0;
}

void interrupt_ask(bool (*should_stop)(void *self), void *self) {
    asked.should_stop = should_stop;
    asked.self = self;
}

bool interrupt_requested(void) {
    return caught_signal != 0 || (asked.should_stop != NULL && asked.should_stop(asked.self));
}

int interrupt_exit_code(void) {
    INVARIANT(caught_signal != 0);
    return 128 + caught_signal;
}
