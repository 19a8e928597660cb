// SPDX-License-Identifier: Apache-2.0
/// surface.compact: a measured surface in one file, from which all other results but the pictures
/// of the right camera can be made again, on any machine, with the same bytes. It holds what was
/// measured (disparity, sigma, reason, confidence and colour of each pixel), not what is computed
/// from that (points, normals, triangles); daemon/surface.md describes the bytes.
#ifndef VERGENCE_DAEMON_SURFACE_RESULT_COMPACT_H
#define VERGENCE_DAEMON_SURFACE_RESULT_COMPACT_H

#include "core/parallel.h"
#include "daemon/files/output_file.h"
#include "daemon/surface/result/reconstruct_context.h"
#include "surface/compact_writer.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    // What is asked for in advance: measured surfaces deflate to 2.3 to 3.2 of 10. One that does
    // not fills the disk, and leaves nothing.
    COMPACT_PIXEL_BYTES = 5,
};

/// A surface that was read. `context` points to the other members and has no pixels of the raw
/// images; `result` has neither the right picture nor the grey ones.
struct compact {
    struct reconstruct_context context;
    struct reconstruct_options options;
    struct reconstruct_result result;
    struct calibration calibration;
    struct pair pair;
    struct pair_instrument instrument;
    char *head;    // the texts of `context`
    void *memory;  // of `result`
};

/// Writes the file (a `result_writer`), a band of rows at a time. ERROR_MEMORY, ERROR_RANGE: the
/// inputs cannot be described; those of output_file_close.
int compact_write(const struct reconstruct_context *context, const char *path,
                  struct message *message);

/// The same bytes to `sink`, as they are made.
int compact_send(const struct reconstruct_context *context, const struct output_sink *sink,
                 struct message *message);

/// Whether a plain file begins as one of any version.
bool compact_is(const char *path);

/// Reads a file and makes points, normals and triangles on `parallel`. 0, with `*compact` for
/// compact_free, or with `message` set ERROR_ARGUMENT (cannot be opened), ERROR_VERSION, ERROR_CRC
/// (truncated or damaged), ERROR_SYNTAX, ERROR_MEMORY.
int compact_read(const char *path, const struct parallel *parallel, struct compact **compact,
                 struct message *message);
void compact_free(struct compact *compact);

// ---- for compact*.c only

/// Writes the head, without the rows. ERROR_RANGE.
int compact_head_print(const struct reconstruct_context *context, struct compact_writer *writer);
/// Reads the head in the zero-terminated `compact->head`. Returns its length; 0: it is not one, and
/// `*line` is the number of the line that is wrong.
size_t compact_head_parse(struct compact *compact, int *line);

#ifdef __cplusplus
}
#endif

#endif
