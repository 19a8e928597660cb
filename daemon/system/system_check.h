// SPDX-License-Identifier: Apache-2.0
/// What the daemon needs of the system of a board, compared with what is there: functions of the
/// kernel, devices, partitions of flash, and variables of U-Boot.
#ifndef VERGENCE_DAEMON_SYSTEM_SYSTEM_CHECK_H
#define VERGENCE_DAEMON_SYSTEM_SYSTEM_CHECK_H

#include <stdbool.h>
#include <stdio.h>

#include "daemon/settings/config.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Prints a table, or JSON, with a row for each: whether it is there, what needs it, and what to do
/// if it is missing. Changes nothing. Returns how many are missing that these settings need.
int system_check_print(FILE *file, const struct config *config, bool as_json);

#ifdef __cplusplus
}
#endif

#endif
