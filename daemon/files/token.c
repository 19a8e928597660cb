// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/token.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/file_io.h"
#include "daemon/files/standard_paths.h"

#define SYSTEM_FOLDER "/var/lib/vergence"
#define NAME "tcp_token"

static const char digits[] = "0123456789abcdef";

static void default_path(char path[TOKEN_PATH_BYTES]) {
    const char *state = getenv("XDG_STATE_HOME");
    const char *home = getenv("HOME");
    int length = -1;
    // XDG base directory specification: a relative path is ignored.
    if (state != NULL && state[0] == '/') {
        length = snprintf(path, TOKEN_PATH_BYTES, "%s/vergence/" NAME, state);
    } else if (home != NULL && home[0] == '/' && access(SYSTEM_FOLDER, W_OK) != 0) {
        length = snprintf(path, TOKEN_PATH_BYTES, "%s/.local/state/vergence/" NAME, home);
    }
    if (length < 0 || length >= TOKEN_PATH_BYTES) {
        strcpy(path, SYSTEM_FOLDER "/" NAME);
    }
}

static int fail(const char *path, struct message *message) {
    const int number = errno;
    return message_set(message, file_error(number), "%s: %s", path, strerror(number));
}

/// Reads the token from an open file.
static int read_token(int fd, const char *path, bool own, char token[TOKEN_BYTES],
                      struct message *message) {
    char text[TOKEN_BYTES + 1] = "";
    struct stat about;
    if (fstat(fd, &about) != 0) {
        return fail(path, message);
    }
    if (!S_ISREG(about.st_mode)) {
        return message_set(message, ERROR_REFUSED, "%s: not a file", path);
    }
    if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
        return message_set(message, ERROR_REFUSED,
                           "%s: other users can read the token (remove the file, or chmod 600)",
                           path);
    }
    if (own && about.st_uid != geteuid()) {
        return message_set(message, ERROR_REFUSED,
                           "%s: the token belongs to another user (remove the file)", path);
    }
    const ssize_t bytes = read(fd, text, sizeof text);
    if (bytes < 0) {
        return fail(path, message);
    }
    const bool ends = bytes == TOKEN_DIGITS || (bytes == TOKEN_BYTES && text[TOKEN_DIGITS] == '\n');
    if (!ends || strspn(text, digits) != TOKEN_DIGITS) {
        return message_set(message, ERROR_SYNTAX,
                           "%s: not a token of %d hexadecimal digits (remove the file, and "
                           "vergenced creates a new one)",
                           path, TOKEN_DIGITS);
    }
    memcpy(token, text, TOKEN_DIGITS);
    token[TOKEN_DIGITS] = '\0';
    return ERROR_OK;
}

static int read_file(const char *path, bool own, char token[TOKEN_BYTES], struct message *message) {
    const int fd = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (fd < 0) {
        return fail(path, message);
    }
    const int error = read_token(fd, path, own, token, message);
    close(fd);
    return error;
}

/// Copies the path, or the default one if none was given, to `text`. Returns whether it was given.
static bool choose_path(const char *path, char text[TOKEN_PATH_BYTES]) {
    const bool given = path != NULL && path[0] != '\0';
    INVARIANT(!given || strlen(path) < TOKEN_PATH_BYTES);
    if (given) {
        strcpy(text, path);
    } else {
        default_path(text);
    }
    return given;
}

int token_read(const char *path, char token[TOKEN_BYTES], struct message *message) {
    char chosen[TOKEN_PATH_BYTES];
    choose_path(path, chosen);
    return read_file(chosen, false, token, message);
}

static bool make_token(char token[TOKEN_BYTES]) {
    unsigned char random[TOKEN_DIGITS / 2];
    if (getrandom(random, sizeof random, 0) != (ssize_t)sizeof random) {
        return false;
    }
    for (size_t i = 0; i < sizeof random; i++) {
        token[2 * i] = digits[random[i] >> 4];
        token[2 * i + 1] = digits[random[i] & 15];
    }
    token[TOKEN_DIGITS] = '\0';
    return true;
}

/// Creates the file under its name only once complete; it is never readable for others.
static int make_file(const char *path, char token[TOKEN_BYTES], struct message *message) {
    char text[TOKEN_BYTES + 1];
    if (!make_token(token)) {
        return fail(path, message);
    }
    snprintf(text, sizeof text, "%s\n", token);
    return atomic_file_write(AT_FDCWD, path, 0600, text, TOKEN_BYTES) ? 0 : fail(path, message);
}

int token_open(const char *path, char token[TOKEN_BYTES], struct message *message) {
    char chosen[TOKEN_PATH_BYTES];
    const bool given = choose_path(path, chosen);
    const int error = read_file(chosen, true, token, message);
    if (error != ERROR_MISSING) {
        return error;
    }
    if (!given) {
        standard_paths_make_parent(chosen, 0700);  // a failure is reported by creating the file
    }
    return make_file(chosen, token, message);
}

bool token_is(const char token[TOKEN_BYTES], const char *given, size_t length) {
    unsigned differences = 0;
    if (length != TOKEN_DIGITS) {
        return false;
    }
    for (size_t i = 0; i < TOKEN_DIGITS; i++) {
        differences |= (unsigned)(unsigned char)(token[i] ^ given[i]);
    }
    return differences == 0;
}
