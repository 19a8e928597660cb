// SPDX-License-Identifier: Apache-2.0
/// The log: the last lines in memory; the event loop sends each line to a file or to standard
/// error, so that a full disk or a stalled reader blocks no writer. Repeated lines are suppressed
/// (flood.h).
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

/// Any thread may write; only the event loop opens, flushes and closes.
struct logbook {
    pthread_mutex_t lock;
    struct logbook_line lines[LOGBOOK_LINES];
    uint64_t written;  ///< number of lines since the start
    uint64_t sent;     ///< number of the next line to send to the file
    uint64_t lost;     ///< lines overwritten before they were sent, not yet reported
    struct flood flood;
    int level;  ///< hal_log_level of the least important lines to keep
    int fd;
    const char *path;   ///< "": standard error
    bool systemd;       ///< standard error is the journal: lines start with <LEVEL>
    int failed_number;  ///< errno if the last line did not reach the file, else 0
};

/// Opens the file at `path` for appending, and creates it if necessary; "": standard error. `path`
/// must outlive the log. Returns 0 or errno.
int logbook_open(struct logbook *self, const char *path, int level);
void logbook_close(struct logbook *self);
/// Opens the file again by its name, after a log rotation has renamed it.
void logbook_reopen(struct logbook *self);

struct hal_log logbook_log(struct logbook *self);

/// Writes a line formatted as by printf.
void logbook_print(struct logbook *self, enum hal_log_level level, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/// Sends new lines to the file until it would block.
void logbook_flush(struct logbook *self);

/// Copies the `back`-th line from the end (0: the last). False: no such line in memory.
bool logbook_line(struct logbook *self, uint64_t back, struct logbook_line *line);

/// The name of a level: "error", "warning", "notice", "info", "debug". Static storage.
const char *logbook_level_name(enum hal_log_level level);

/// Formats microseconds since 1970 in UTC, as "2026-01-31 12:00:00.123", into `text` (32 bytes).
void logbook_time_text(int64_t time_us, char *text);

#ifdef __cplusplus
}
#endif

#endif
