// SPDX-License-Identifier: Apache-2.0
/// Writing to a descriptor that blocks, whole.
#ifndef VERGENCE_DAEMON_FILES_WRITE_ALL_H
#define VERGENCE_DAEMON_FILES_WRITE_ALL_H

#include <stdbool.h>
#include <stddef.h>

/// Writes all `bytes` of `data`, in as many calls as that takes, also when signals come between.
/// False: errno says why (EIO when nothing was taken), and a part may have been written.
bool write_all(int fd, const void *data, size_t bytes);

#endif
