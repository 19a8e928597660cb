// SPDX-License-Identifier: Apache-2.0
/// A fake /dev/watchdog: armed when opened; reports when the system would have restarted.
#ifndef VERGENCE_TESTS_FAKE_WATCHDOG_H
#define VERGENCE_TESTS_FAKE_WATCHDOG_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

struct fake_watchdog {
    int period_s;
    int min_s, max_s;  ///< periods outside are set to the nearer limit
    bool sets_period, reports_period, has_keepalive;
    bool armed;
    unsigned feeds;
};

/// Adds the device. Lives until the next call.
struct fake_watchdog *fake_watchdog_add(const char *path);

#ifdef __cplusplus
}
#endif

#endif
