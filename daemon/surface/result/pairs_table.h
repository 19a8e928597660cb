// SPDX-License-Identifier: Apache-2.0
/// The table of the results of many pairs, `pairs.json` in the directory above them. It says what
/// they were made of and with, so that a later run keeps those that would be the same.
#ifndef VERGENCE_DAEMON_SURFACE_RESULT_PAIRS_TABLE_H
#define VERGENCE_DAEMON_SURFACE_RESULT_PAIRS_TABLE_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "daemon/base/message.h"
#include "daemon/session/session_read.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PAIRS_TABLE_NAME "pairs.json"
enum { PAIRS_NAME_BYTES = 300, PAIRS_MADE_OF_BYTES = 40 };

struct pairs_row {
    char session[SESSION_READ_PATH_BYTES];  // its path
    char name[PAIRS_NAME_BYTES];            // of the results, below the output directory
    uint32_t number;                        // of the pair; 0: the session cannot be read (further)
    char made_of[PAIRS_MADE_OF_BYTES];  // checksums of both images and the session's calibrations
    bool kept;                          // the results of an earlier run are these
    bool done;
    int error;
    struct message message;  // if there is an error
    uint32_t points;
    double depth_mm, sigma_mm;  // medians; NAN: none
    double seconds;
    int notes;
};

struct pairs_table {
    char *settings;  // what all results depend on besides their pairs; allocated, as the rows
    struct pairs_row *rows;
    int count, room;
};

/// Appends a row without results; NULL: out of memory.
struct pairs_row *pairs_table_add(struct pairs_table *self);

void pairs_table_free(struct pairs_table *self);

/// Prints the document; the stream's error indicator shows whether it was written.
void pairs_table_print(const struct pairs_table *self, FILE *stream);

/// Replaces the table in the directory `out`, whole or not at all. Without any result there is no
/// directory, and nothing to do. 0, or ERROR_BUFFER (ERROR_FULL: no space) with `message` set.
int pairs_table_save(const struct pairs_table *self, const char *out, struct message *message);

/// Marks as kept what an earlier run with the same settings made of the same pairs in `out`, if its
/// results are still there. A table that cannot be read keeps nothing.
void pairs_table_keep(struct pairs_table *self, const char *out);

#ifdef __cplusplus
}
#endif

#endif
