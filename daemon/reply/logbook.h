// SPDX-License-Identifier: Apache-2.0
/// The log: its last lines in memory, and each line sent to a file or to standard error by the
/// event loop, so that a full disk or a reader that sleeps stops nobody. What comes again and again
/// is held back (flood.h).
#ifndef VERGENCE_DAEMON_REPLY_LOGBOOK_H
#define VERGENCE_DAEMON_REPLY_LOGBOOK_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/reply/flood.h"
#include "hal/log.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { LOGBOOK_LINES = 256, LOGBOOK_LINE_BYTES = 240 };

struct logbook_line {
    int64_t time_us;  ///< since 1970
    enum hal_log_level level;
    char text[LOGBOOK_LINE_BYTES];
};

/// Any thread may write; `logbook_flush` and what opens and closes is the event loop's.
struct logbook {
    pthread_mutex_t lock;
    struct logbook_line lines[LOGBOOK_LINES];
    uint64_t written;  ///< lines since the start
    uint64_t sent;     ///< of these, to the file
    uint64_t lost;     ///< of these, never sent
    struct flood flood;
    int level;  ///< the least important that is kept
    int fd;
    const char *path;   ///< "": standard error
    bool systemd;       ///< standard error is the journal: lines begin with <LEVEL>
    int failed_number;  ///< errno of the last line that did not reach the file, 0: it did
};

/// Opens the file (created, appended to). Returns 0 or errno.
int logbook_open(struct logbook *self, const char *path, int level);
void logbook_close(struct logbook *self);
/// Opens the file again by its name, after something has moved it away.
void logbook_reopen(struct logbook *self);

struct hal_log logbook_log(struct logbook *self);

/// Writes as printf would.
void logbook_print(struct logbook *self, enum hal_log_level level, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/// Sends what is new to the file, as much as it takes now.
void logbook_flush(struct logbook *self);

/// Copies the `back`-th line from the end (0: the last). False: there is none.
bool logbook_line(struct logbook *self, uint64_t back, struct logbook_line *line);

/// The name of a level: "error", "warning", "notice", "info", "debug". Static storage.
const char *logbook_level_name(enum hal_log_level level);

/// Time as people write it, in UTC: "2026-01-31 12:00:00.123", in `text` (32 bytes).
void logbook_time_text(int64_t time_us, char *text);

#ifdef __cplusplus
}
#endif

#endif
