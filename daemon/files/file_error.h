// SPDX-License-Identifier: Apache-2.0
/// Maps the errno of a file operation to an error of core/error.h.
#ifndef VERGENCE_DAEMON_FILES_FILE_ERROR_H
#define VERGENCE_DAEMON_FILES_FILE_ERROR_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// ERROR_MISSING (does not exist), ERROR_FULL (see below), ERROR_REFUSED (no permission, a
/// read-only disk, or a link that is not followed), or ERROR_IO.
int file_error(int number);

/// Whether the error means no space: disk, quota or size limit.
bool file_error_is_full(int number);

#ifdef __cplusplus
}
#endif

#endif
