// SPDX-License-Identifier: Apache-2.0
#include "fake_watchdog.h"

#include <errno.h>
#include <linux/watchdog.h>
#include <stdio.h>
#include <string.h>

#include "fake_file.h"

static struct fake_watchdog state;
static bool magic;  // the last byte written was 'V'

static int arm(struct fake_file *file) {
    (void)file;
    if (state.armed) {
        return -EBUSY;
    }
    state.armed = true;
    return 0;
}

static void close_watchdog(struct fake_file *file) {
    (void)file;
    state.armed = !magic;
}

static void describe(struct fake_file *file, unsigned long request, const void *argument,
                     char *line, size_t bytes) {
    (void)file;
    if (request == WDIOC_GETSUPPORT) {
        snprintf(line, bytes, "GETSUPPORT");
    } else if (request == WDIOC_SETTIMEOUT) {
        snprintf(line, bytes, "SETTIMEOUT %d", *(const int *)argument);
    } else if (request == WDIOC_GETTIMEOUT) {
        snprintf(line, bytes, "GETTIMEOUT");
    } else if (request == WDIOC_KEEPALIVE) {
        snprintf(line, bytes, "KEEPALIVE");
    }
}

static int control(struct fake_file *file, unsigned long request, void *argument) {
    (void)file;
    int *seconds = argument;
    if (request == WDIOC_GETSUPPORT) {
        *(struct watchdog_info *)argument = (struct watchdog_info){
            .options = WDIOF_MAGICCLOSE | (state.sets_period ? WDIOF_SETTIMEOUT : 0U) |
                       (state.has_keepalive ? WDIOF_KEEPALIVEPING : 0U),
            .identity = "Fake watchdog"};
        return 0;
    }
    if (request == WDIOC_SETTIMEOUT && state.sets_period) {
        state.period_s = *seconds < state.min_s   ? state.min_s
                         : *seconds > state.max_s ? state.max_s
                                                  : *seconds;
        *seconds = state.period_s;
        return 0;
    }
    if (request == WDIOC_GETTIMEOUT && state.reports_period) {
        *seconds = state.period_s;
        return 0;
    }
    if (request == WDIOC_KEEPALIVE && state.has_keepalive) {
        state.feeds++;
        return 0;
    }
    return request == WDIOC_SETTIMEOUT ? -EOPNOTSUPP : -ENOTTY;
}

static int write_bytes(struct fake_file *file, const void *data, size_t bytes) {
    (void)file;
    magic = memchr(data, 'V', bytes) != NULL;
    state.feeds++;
    return (int)bytes;
}

struct fake_watchdog *fake_watchdog_add(const char *path) {
    static const struct fake_operations operations = {.open = arm,
                                                      .close = close_watchdog,
                                                      .describe = describe,
                                                      .ioctl = control,
                                                      .write = write_bytes};
    magic = false;
    state = (struct fake_watchdog){.period_s = 60,
                                   .min_s = 2,
                                   .max_s = 120,
                                   .sets_period = true,
                                   .reports_period = true,
                                   .has_keepalive = true};
    fake_file_device(path, 10, 130, &operations, &state);
    return &state;
}
