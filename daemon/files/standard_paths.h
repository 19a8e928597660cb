// SPDX-License-Identifier: Apache-2.0
/// Default locations of the daemon's files and of the socket that a client looks for: the system's
/// directories for root and systemd services, else the user's (XDG base directories).
#ifndef VERGENCE_DAEMON_FILES_STANDARD_PATHS_H
#define VERGENCE_DAEMON_FILES_STANDARD_PATHS_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { STANDARD_PATH_BYTES = 256, STANDARD_SOCKETS_MAX = 3 };

struct standard_paths {
    bool of_user;  ///< else of the system
    char config[STANDARD_PATH_BYTES];
    char socket[STANDARD_PATH_BYTES];
    char files[STANDARD_PATH_BYTES];
    char store[STANDARD_PATH_BYTES];
    char log[STANDARD_PATH_BYTES];  ///< "": standard error
};

/// The defaults of this process. Creates nothing. Without a home directory, the system's defaults.
void standard_paths_default(struct standard_paths *paths);

/// The sockets that a client tries, in order: the user's, then the system's. Returns their number.
size_t standard_paths_sockets(char sockets[STANDARD_SOCKETS_MAX][STANDARD_PATH_BYTES]);

/// Where the client keeps the lines typed at a terminal. False: this user has no home directory.
bool standard_paths_history(char path[STANDARD_PATH_BYTES]);

/// Creates the directory that contains `path` and its missing parents. False: see errno.
bool standard_paths_make_parent(const char *path, mode_t mode);

#ifdef __cplusplus
}
#endif

#endif
