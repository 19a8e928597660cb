// SPDX-License-Identifier: Apache-2.0
#include "daemon/reconstruct_recorded.h"

#include <stddef.h>

#include "core/error.h"

enum { BAYER_NONE, BAYER_GRBG };  // places among the words of --bayer

struct wanted {
    int pair;  // from 1; 0: the last one
    int seen;
    struct session_pair_files *files;
};

static void look_at(void *self, const struct session_pair_files *files) {
    struct wanted *wanted = self;
    wanted->seen++;
    if (wanted->pair == 0 || wanted->pair == wanted->seen) {
        *wanted->files = *files;
    }
}

int reconstruct_recorded_resolve(struct reconstruct_request *request,
                                 struct session_pair_files *files, bool *own,
                                 struct message *message) {
    const char *path = request->session_path;
    *own = false;
    if (path == NULL) {
        return ERROR_OK;
    }
    struct wanted wanted = {.pair = request->pair, .files = files};
    const int pairs = session_pairs_read(path, look_at, &wanted, message);
    if (pairs < 0) {
        return pairs;
    }
    if (request->pair > pairs) {
        return message_set(message, ERROR_RANGE,
                           "%s: the session holds %d pair%s: --pair %d is none", path, pairs,
                           pairs == 1 ? "" : "s", request->pair);
    }
    if (request->calibration_path == NULL && !request->rectified) {
        if (files->calibration[0] == '\0') {
            return message_set(message, ERROR_MISSING,
                               "%s: the session holds no calibration: --calibration FILE is "
                               "missing (or --rectified for a rectified pair without one)",
                               path);
        }
        request->calibration_path = files->calibration;
        *own = true;
    }
    request->left_path = files->path[0];
    request->right_path = files->path[1];
    if (request->bayer < 0) {
        request->bayer = files->mosaic ? BAYER_GRBG : BAYER_NONE;
    }
    return ERROR_OK;
}
