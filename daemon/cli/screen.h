// SPDX-License-Identifier: Apache-2.0
/// Size of a terminal's window.
#ifndef VERGENCE_DAEMON_CLI_SCREEN_H
#define VERGENCE_DAEMON_CLI_SCREEN_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { SCREEN_COLUMNS = 80 };  ///< where the size is unknown

/// Current width in columns of the terminal `fd`; SCREEN_COLUMNS if unknown.
size_t screen_columns(int fd);

#ifdef __cplusplus
}
#endif

#endif
