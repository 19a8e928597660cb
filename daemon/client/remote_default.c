// SPDX-License-Identifier: Apache-2.0
// `vergence --connect` without an address.
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "core/error.h"
#include "daemon/client/remote.h"
#include "daemon/files/standard_paths.h"

bool remote_is_address(const char *word) {
    const size_t first = strcspn(word, " \t");
    return strcspn(word, ":/.") < first;
}

int remote_open_default(struct remote_line *line, struct message *message) {
    char sockets[STANDARD_SOCKETS_MAX][STANDARD_PATH_BYTES];
    char tried[MESSAGE_BYTES / 2] = "";
    const size_t count = standard_paths_sockets(sockets);
    for (size_t i = 0; i < count; i++) {
        char address[sizeof "unix:" + STANDARD_PATH_BYTES];
        snprintf(address, sizeof address, "unix:%s", sockets[i]);
        const int error = remote_line_open(line, address, message);
        if (error == 0 || error == ERROR_MEMORY) {
            return error;
        }
        const bool is_missing = error == ERROR_IO && errno == ENOENT;
        const char *cause = is_missing ? "" : error == ERROR_IO ? strerror(errno) : "path too long";
        const size_t used = strlen(tried);
        snprintf(tried + used, sizeof tried - used, "%s%s%s%s%s", i == 0 ? "" : ", ", sockets[i],
                 is_missing ? "" : " (", cause, is_missing ? "" : ")");
    }
    return message_set(
        message, ERROR_IO,
        "no vergenced at %s: start \"vergenced\" (simulated instrument: \"vergence simulate\"), or "
        "give its ADDRESS: unix:PATH, tcp:HOST:PORT or serial:DEVICE",
        tried);
}
