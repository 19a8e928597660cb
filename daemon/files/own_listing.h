// SPDX-License-Identifier: Apache-2.0
/// The list of the files that this product wrote into a directory of a user: `.vergence-files` in
/// that directory. Only what it names is replaced or removed there.
#ifndef VERGENCE_DAEMON_FILES_OWN_LISTING_H
#define VERGENCE_DAEMON_FILES_OWN_LISTING_H

#include <stdbool.h>
#include <stddef.h>

#include "daemon/files/own_remove.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OWN_LISTING_NAME ".vergence-files"

struct own_listing {
    char *text;  // a head, then one name a line; allocated; NULL: no names
    size_t length;
};

/// Reads the list of the directory; none if there is no valid one. The caller frees it.
void own_listing_read(int directory, struct own_listing *self);

bool own_listing_has(const struct own_listing *self, const char *name);

/// Adds or drops a name. False: out of memory, or a name with a line feed is added.
bool own_listing_set(struct own_listing *self, const char *name, bool listed);

/// Replaces the directory's list; an empty one is removed. False with errno.
bool own_listing_write(int directory, const struct own_listing *self);

/// Removes the list itself; afterwards no file of the directory is ours.
void own_listing_forget(int directory);

/// The proof that a file of this directory is ours.
struct own_proof own_listing_proof(const struct own_listing *self);

void own_listing_free(struct own_listing *self);

#ifdef __cplusplus
}
#endif

#endif
