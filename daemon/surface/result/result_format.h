// SPDX-License-Identifier: Apache-2.0
/// The files of a result directory. Programs, help and checks read this one table.
#ifndef VERGENCE_DAEMON_SURFACE_RESULT_RESULT_FORMAT_H
#define VERGENCE_DAEMON_SURFACE_RESULT_RESULT_FORMAT_H

#include <stdbool.h>

#include "daemon/base/message.h"
#include "daemon/surface/result/compact.h"
#include "daemon/surface/result/reconstruct_context.h"
#include "daemon/surface/result/write.h"

#ifdef __cplusplus
extern "C" {
#endif

/// X(name, file name, program that writes it (SYSTEM, HOST or BOTH), whether it needs real
/// millimetres, whether it describes a surface, room to be had for each pixel of the rectified
/// image (0: unknown), what it holds). Files are written in this order; the last one closes the
/// set.
// clang-format off
#define RESULT_FORMAT_LIST(X)                                                                      \
    X(DISPARITY_PFM, "disparity.pfm", BOTH, false, false, WRITE_PFM_PIXEL_BYTES,                   \
      "disparities in pixels")                                                                     \
    X(DISPARITY_PNG, "disparity.png", HOST, false, false, 0, "the same in KITTI's format")         \
    X(DEPTH_PNG, "depth.png", HOST, true, false, 0, "depths in mm")                                \
    X(REASONS_PGM, "reasons.pgm", SYSTEM, false, false, 1, "why pixels have no disparity")          \
    X(REASONS_PNG, "reasons.png", HOST, false, false, 0, "why pixels have no disparity")           \
    X(LEFT_PNG, "left_rectified.png", HOST, false, false, 0, "the rectified left image")           \
    X(RIGHT_PNG, "right_rectified.png", HOST, false, false, 0, "the rectified right image")        \
    X(POINTS_PCD, "points.pcd", BOTH, false, true, WRITE_PCD_PIXEL_BYTES,                          \
      "points for the Point Cloud Library")                                                        \
    X(MESH_PLY, "mesh.ply", BOTH, false, true, WRITE_PLY_PIXEL_BYTES, "the surface, every point")  \
    X(MESH_GLB, "mesh.glb", HOST, false, true, 0,                                                  \
      "the simplified surface with texture, for browsers and Blender")                             \
    X(REPORT_HTML, "report.html", HOST, false, false, 0, "a report for people")                    \
    X(COMPACT, "surface.compact", BOTH, false, false, COMPACT_PIXEL_BYTES,                         \
      "what was measured; \"vergence reconstruct\" makes the other files of it")                   \
    X(RESULT_JSON, "result.json", BOTH, false, false, 0, "all figures")
// clang-format on

enum result_format_name {
#define RESULT_FORMAT_ENUM(name, ...) RESULT_##name,
    RESULT_FORMAT_LIST(RESULT_FORMAT_ENUM)
#undef RESULT_FORMAT_ENUM
        RESULT_FORMATS
};

/// Text for a help page, in one literal: ", NAME (what it holds)" for each file.
#define RESULT_FORMAT_HELP RESULT_FORMAT_LIST(RESULT_FORMAT_HELP_LINE)
#define RESULT_FORMAT_HELP_LINE(name, file, program, metric, surface, bytes, holds) \
    ", " file " (" holds RESULT_FORMAT_PROGRAM_##program ")"
#define RESULT_FORMAT_PROGRAM_BOTH ""
#define RESULT_FORMAT_PROGRAM_HOST "; not on the board"
#define RESULT_FORMAT_PROGRAM_SYSTEM "; on the board"

/// The names of the system's files, in one literal, each with a comma behind it.
#define RESULT_FORMAT_SYSTEM_NAMES RESULT_FORMAT_LIST(RESULT_FORMAT_SYSTEM_NAME)
#define RESULT_FORMAT_SYSTEM_NAME(name, file, program, ...) RESULT_FORMAT_ON_##program(file)
#define RESULT_FORMAT_ON_BOTH(file) file ", "
#define RESULT_FORMAT_ON_SYSTEM(file) file ", "
#define RESULT_FORMAT_ON_HOST(file)

struct result_format {
    const char *file_name;
    bool metric_only, of_surface;
    int pixel_bytes;
};

extern const struct result_format result_formats[RESULT_FORMATS];

/// Writes the file; returns 0, or a negative error code with `message` set. May leave a partial
/// file on failure: its directory is then removed.
typedef int result_writer(const struct reconstruct_context *context, const char *path,
                          struct message *message);

/// Whether `list`, the value of the option files (names separated by commas; NULL: all), names the
/// file.
bool result_format_listed(const char *list, const char *file_name);

/// 0, or ERROR_ARGUMENT with `message` naming a file that a program with these writers (NULL: not
/// written) does not write.
int result_format_check(const char *list, result_writer *const writers[RESULT_FORMATS],
                        struct message *message);

#ifdef __cplusplus
}
#endif

#endif
