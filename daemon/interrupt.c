// SPDX-License-Identifier: Apache-2.0
#include "daemon/interrupt.h"

#include <signal.h>
#include <stddef.h>

#include "core/invariant.h"

static volatile sig_atomic_t caught_signal;

static void remember(int number) {
    caught_signal = number;
}

void interrupt_catch(void) {
    static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
    for (size_t i = 0; i < sizeof signals / sizeof signals[0]; i++) {
        struct sigaction old;
        struct sigaction action = {.sa_handler = remember, .sa_flags = (int)SA_RESETHAND};
        sigemptyset(&action.sa_mask);
        if (sigaction(signals[i], NULL, &old) == 0 && old.sa_handler != SIG_IGN) {
            sigaction(signals[i], &action, NULL);
        }
    }
}

bool interrupt_requested(void) {
    return caught_signal != 0;
}

int interrupt_exit_code(void) {
    INVARIANT(caught_signal != 0);
    return 128 + caught_signal;
}
