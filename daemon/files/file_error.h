// SPDX-License-Identifier: Apache-2.0
/// What errno says of a file or its disk, as an error of core/error.h.
#ifndef VERGENCE_DAEMON_FILES_FILE_ERROR_H
#define VERGENCE_DAEMON_FILES_FILE_ERROR_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// ERROR_MISSING (there is none), ERROR_FULL (as below), ERROR_REFUSED (not for this user, not on
/// this disk, not through a link), or ERROR_IO.
int file_error(int number);

/// Whether there is no room: on the disk, of a quota, or up to a limit of size.
bool file_error_is_full(int number);

#ifdef __cplusplus
}
#endif

#endif
