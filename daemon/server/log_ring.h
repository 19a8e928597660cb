// SPDX-License-Identifier: Apache-2.0
/// The log: the last lines in memory; the event loop sends each line to a file or to standard
/// error, so that a full disk or a stalled reader blocks no writer. Repetitions of a line are
/// counted instead: the count follows when another line comes.
#ifndef VERGENCE_DAEMON_SERVER_LOG_RING_H
#define VERGENCE_DAEMON_SERVER_LOG_RING_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/log.h"

enum { LOG_RING_LINES = 256, LOG_RING_LINE_BYTES = 240 };

struct log_ring_line {
    int64_t time_us;  ///< microseconds since 1970
    enum hal_log_level level;
    char text[LOG_RING_LINE_BYTES];
};

/// Any thread may write; only the event loop opens, flushes and closes.
struct log_ring {
    pthread_mutex_t lock;
    struct log_ring_line lines[LOG_RING_LINES];
    uint64_t written;               ///< number of lines since the start
    uint64_t sent;                  ///< number of the next line to send to the file
    uint64_t lost;                  ///< lines overwritten before they were sent, not yet reported
    enum hal_log_level last_level;  ///< the last line, without the counts of repetitions
    char last[LOG_RING_LINE_BYTES];
    uint64_t repeats;  ///< repetitions of `last` that are not yet logged
    int level;         ///< hal_log_level of the least important lines to keep
    int fd;
    const char *path;   ///< "": standard error
    bool systemd;       ///< standard error is the journal: lines start with <LEVEL>
    int failed_number;  ///< errno if the last line did not reach the file, else 0
};

/// Opens the file at `path` for appending, and creates it if necessary; "": standard error. `path`
/// must outlive the log. Returns 0 or errno.
int log_ring_open(struct log_ring *self, const char *path, int level);
void log_ring_close(struct log_ring *self);
/// Opens the file again by its name, after a log rotation has renamed it.
void log_ring_reopen(struct log_ring *self);

struct hal_log log_ring_log(struct log_ring *self);

/// Writes a line formatted as by printf.
void log_ring_print(struct log_ring *self, enum hal_log_level level, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/// Sends new lines to the file until it would block.
void log_ring_flush(struct log_ring *self);

/// Logs how often the last line was repeated, if it was.
void log_ring_count_repeats(struct log_ring *self);

/// Copies the `back`-th line from the end (0: the last). False: no such line in memory.
bool log_ring_line(struct log_ring *self, uint64_t back, struct log_ring_line *line);

/// The name of a level: "error", "warning", "notice", "info", "debug". Static storage.
const char *log_ring_level_name(enum hal_log_level level);

/// Formats microseconds since 1970 in UTC, as "2026-01-31 12:00:00.123", into `text` (32 bytes).
void log_ring_time_text(int64_t time_us, char *text);

#endif
