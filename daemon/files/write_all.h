// SPDX-License-Identifier: Apache-2.0
/// Writes everything to a blocking descriptor.
#ifndef VERGENCE_DAEMON_FILES_WRITE_ALL_H
#define VERGENCE_DAEMON_FILES_WRITE_ALL_H

#include <stdbool.h>
#include <stddef.h>

/// Writes all `bytes` of `data`, in as many calls as needed, also across signals. False with errno
/// (EIO if nothing was accepted); a part may have been written.
bool write_all(int fd, const void *data, size_t bytes);

#endif
