// SPDX-License-Identifier: Apache-2.0
/// Default locations of the daemon's files and of the socket that a client looks for: the system's
/// directories for root and systemd services, else the user's (XDG base directories).
#ifndef VERGENCE_DAEMON_FILES_PLACES_H
#define VERGENCE_DAEMON_FILES_PLACES_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { PLACES_PATH_BYTES = 256, PLACES_SOCKETS_MAX = 3 };

struct places {
    bool of_user;  ///< else of the system
    char config[PLACES_PATH_BYTES];
    char socket[PLACES_PATH_BYTES];
    char files[PLACES_PATH_BYTES];
    char store[PLACES_PATH_BYTES];
    char log[PLACES_PATH_BYTES];  ///< "": standard error
};

/// The defaults of this process. Creates nothing. Without a home directory, the system's defaults.
void places_default(struct places *places);

/// The sockets that a client tries, in order: the user's, then the system's. Returns their number.
size_t places_sockets(char sockets[PLACES_SOCKETS_MAX][PLACES_PATH_BYTES]);

/// Creates the directory that contains `path` and its missing parents. False: see errno.
bool places_make_parent(const char *path, mode_t mode);

#ifdef __cplusplus
}
#endif

#endif
