// SPDX-License-Identifier: Apache-2.0
/// Where the daemon keeps its files unless its settings say otherwise, and where a client looks for
/// its socket: the system's directories for root and for a service of systemd, else this user's
/// (XDG base directories).
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
    bool of_user;  ///< else the system's
    char config[PLACES_PATH_BYTES];
    char socket[PLACES_PATH_BYTES];
    char files[PLACES_PATH_BYTES];
    char store[PLACES_PATH_BYTES];
    char log[PLACES_PATH_BYTES];  ///< "": standard error
};

/// The defaults of this process. Makes nothing. Without a home directory they are the system's.
void places_default(struct places *places);

/// The sockets that a client tries, in this order: the user's, then the system's. How many.
size_t places_sockets(char sockets[PLACES_SOCKETS_MAX][PLACES_PATH_BYTES]);

/// Makes the directory that `path` stands in, and those before it, where they are missing. False:
/// errno says why not.
bool places_make_parent(const char *path, mode_t mode);

#ifdef __cplusplus
}
#endif

#endif
