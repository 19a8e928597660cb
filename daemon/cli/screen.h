// SPDX-License-Identifier: Apache-2.0
/// The window of the terminal that somebody looks at.
#ifndef VERGENCE_DAEMON_CLI_SCREEN_H
#define VERGENCE_DAEMON_CLI_SCREEN_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { SCREEN_COLUMNS = 80 };  ///< where nobody knows better

/// How many columns the window of the terminal `fd` has now; SCREEN_COLUMNS where the terminal
/// does not know.
size_t screen_columns(int fd);

#ifdef __cplusplus
}
#endif

#endif
