// SPDX-License-Identifier: Apache-2.0
/// The names in a directory.
#ifndef VERGENCE_DAEMON_FILES_DIRECTORY_NAMES_H
#define VERGENCE_DAEMON_FILES_DIRECTORY_NAMES_H

#include <dirent.h>

#ifdef __cplusplus
extern "C" {
#endif

/// A stream over an open directory, from where `fd` stands; closedir() ends both. NULL with errno:
/// `fd` is closed, or was not open (negative).
DIR *directory_stream(int fd);

/// Lists an open directory's names in order, without `.` and `..`. Returns their number, or -1 with
/// errno. The caller frees each of `*names` and the array.
int directory_names(int directory, char ***names);

#ifdef __cplusplus
}
#endif

#endif
