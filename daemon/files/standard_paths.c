// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/standard_paths.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/auxv.h>
#include <sys/stat.h>

#define SOCKET "/vergence/vergenced.sock"
#define STATE "/.local/state"

static const struct standard_paths of_system = {
    .config = "/etc/vergence/vergenced.conf",
    .socket = "/run" SOCKET,
    .files = "/var/lib/vergence/files",
    .store = "/var/lib/vergence/store",
};

/// Without a system call, as a confined daemon needs the defaults too.
static uid_t user(void) {
    return (uid_t)getauxval(AT_EUID);
}

/// Whether the system's directories apply, as for a systemd service.
static bool is_system(void) {
    return user() == 0 || getenv("RUNTIME_DIRECTORY") != NULL || getenv("STATE_DIRECTORY") != NULL;
}

/// Joins the value of a variable, or if it is not set a path in the home directory, with `rest`.
/// XDG: a relative path counts as not set. False: no such path.
static bool join(char path[STANDARD_PATH_BYTES], const char *variable, const char *in_home,
                 const char *rest) {
    const char *value = getenv(variable);
    const char *home = getenv("HOME");
    const bool set = value != NULL && value[0] == '/';
    if (!set && (home == NULL || home[0] != '/')) {
        return false;
    }
    return snprintf(path, STANDARD_PATH_BYTES, "%s%s%s", set ? value : home, set ? "" : in_home,
                    rest) < STANDARD_PATH_BYTES;
}

/// After "su" the variable may name another user's directory.
static bool runtime_socket(char path[STANDARD_PATH_BYTES]) {
    const char *directory = getenv("XDG_RUNTIME_DIR");
    struct stat status;
    return directory != NULL && directory[0] == '/' && stat(directory, &status) == 0 &&
           S_ISDIR(status.st_mode) && status.st_uid == user() &&
           snprintf(path, STANDARD_PATH_BYTES, "%s" SOCKET, directory) < STANDARD_PATH_BYTES;
}

static bool state_socket(char path[STANDARD_PATH_BYTES]) {
    return join(path, "XDG_STATE_HOME", STATE, SOCKET);
}

void standard_paths_default(struct standard_paths *paths) {
    paths->of_user =
        !is_system() &&
        join(paths->config, "XDG_CONFIG_HOME", "/.config", "/vergence/vergenced.conf") &&
        (runtime_socket(paths->socket) || state_socket(paths->socket)) &&
        join(paths->files, "XDG_DATA_HOME", "/.local/share", "/vergence/files") &&
        join(paths->store, "XDG_STATE_HOME", STATE, "/vergence/store") &&
        join(paths->log, "XDG_STATE_HOME", STATE, "/vergence/vergenced.log");
    if (!paths->of_user) {
        *paths = of_system;
    }
}

bool standard_paths_history(char path[STANDARD_PATH_BYTES]) {
    const bool found = join(path, "XDG_STATE_HOME", STATE, "/vergence/history");
    path[0] = found ? path[0] : '\0';
    return found;
}

size_t standard_paths_sockets(char sockets[STANDARD_SOCKETS_MAX][STANDARD_PATH_BYTES]) {
    size_t count = 0;
    if (user() != 0) {
        count += runtime_socket(sockets[count]);
        count += state_socket(sockets[count]);
    }
    memcpy(sockets[count], of_system.socket, sizeof of_system.socket);
    return count + 1;
}

bool standard_paths_make_parent(const char *path, mode_t mode) {
    char parent[STANDARD_PATH_BYTES];
    const char *last = strrchr(path, '/');
    if (last == NULL || last == path) {
        return true;
    }
    if (snprintf(parent, sizeof parent, "%.*s", (int)(last - path), path) >= (int)sizeof parent) {
        errno = ENAMETOOLONG;
        return false;
    }
    struct stat status;
    if (stat(parent, &status) == 0 || mkdir(parent, mode) == 0 || errno == EEXIST) {
        return true;
    }
    return errno == ENOENT && standard_paths_make_parent(parent, mode) &&
           (mkdir(parent, mode) == 0 || errno == EEXIST);
}
