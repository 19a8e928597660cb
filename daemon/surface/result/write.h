// SPDX-License-Identifier: Apache-2.0
/// The results that every build of the client can write; each function is a `result_writer`'s.
#ifndef VERGENCE_DAEMON_SURFACE_RESULT_WRITE_H
#define VERGENCE_DAEMON_SURFACE_RESULT_WRITE_H

#include <stdio.h>

#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Maximum sizes for each pixel, as in result_writer: a vertex has at most two triangles.
enum {
    WRITE_PFM_PIXEL_BYTES = 4,
    WRITE_PCD_PIXEL_BYTES = 5 * 4,
    WRITE_PLY_VERTEX_BYTES = 6 * 4 + 3 + 2 * 4 + 1,
    WRITE_PLY_FACE_BYTES = 1 + 3 * 4,
    WRITE_PLY_PIXEL_BYTES = WRITE_PLY_VERTEX_BYTES + 2 * WRITE_PLY_FACE_BYTES,
};

/// disparity.pfm: x_left - x_right in pixels of the rectified left image; +inf where rejected.
/// Source: P. Debevec, "PFM Portable FloatMap Image Format".
int write_pfm(const struct reconstruct_context *context, const char *path, struct message *message);

/// mesh.ply, binary little-endian: position in the left camera's frame, normal, colour, predicted
/// standard deviation along the ray (sigma) and distance of the rays (miss); with filled points
/// also which these are (filled: 1). Lengths are in mm unless the context states another unit.
/// Source: G. Turk, "The PLY Polygon File Format", 1994.
int write_ply(const struct reconstruct_context *context, const char *path, struct message *message);

/// points.pcd, binary, of the measured points: x y z in the same unit, rgb packed as the Point
/// Cloud Library does, sigma. Source: Point Cloud Library, "The PCD file format", version 0.7.
int write_pcd(const struct reconstruct_context *context, const char *path, struct message *message);

/// reasons.pgm: enum reason of every pixel of the rectified left image.
int write_reasons(const struct reconstruct_context *context, const char *path,
                  struct message *message);

/// result.json: all figures.
int write_result(const struct reconstruct_context *context, const char *path,
                 struct message *message);

/// What a result was made from, as comment lines that begin with `mark`: build, calibration, and
/// the capture of a session's pair. The stream's error indicator shows whether all was written.
void write_comments(const struct reconstruct_context *context, const char *mark, FILE *stream);

#ifdef __cplusplus
}
#endif

#endif
