// SPDX-License-Identifier: Apache-2.0
/// A fake /dev/watchdog: armed when opened; reports when the system would have restarted.
#ifndef VERGENCE_TESTS_FAKE_WATCHDOG_H
#define VERGENCE_TESTS_FAKE_WATCHDOG_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct fake_watchdog {
    int period_s;
    int min_s, max_s;  ///< periods outside are set to the nearer limit
    bool sets_period, reports_period, has_keepalive;
    bool armed;
    unsigned feeds;
    uint64_t fed_us;
    uint64_t longest_us;  ///< longest time between two feeds
};

/// Adds the device. Lives until the next call.
struct fake_watchdog *fake_watchdog_add(const char *path);
/// Whether the system would have restarted by now.
bool fake_watchdog_bit(const struct fake_watchdog *self);

#ifdef __cplusplus
}
#endif

#endif
