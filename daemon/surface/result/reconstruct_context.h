// SPDX-License-Identifier: Apache-2.0
/// All that a writer of results may say about a reconstruction: the result itself, what it was made
/// from, what was assumed and what it cost. Nothing is owned; all lives until every writer is done.
#ifndef VERGENCE_DAEMON_SURFACE_RESULT_RECONSTRUCT_CONTEXT_H
#define VERGENCE_DAEMON_SURFACE_RESULT_RECONSTRUCT_CONTEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"
#include "daemon/session/capture_stamp.h"
#include "daemon/session/session.h"
#include "stereo/image/picture_stats.h"
#include "stereo/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RECONSTRUCT_CONTEXT_WARNINGS = 16 };

/// What messages tell people to change, in their own words: options of the command line, or
/// arguments at the console.
struct reconstruct_words {
    const char *scale;    // what sizes the rectified images
    const char *smaller;  // all that makes them smaller
    const char *depth;    // what says where to search
    const char *search;   // all that does
    const char *accept;   // what goes on with a calibration that does not belong to the pair
};

/// Units of mesh.ply and points.pcd; as the option --mesh-unit names them.
enum reconstruct_unit { RECONSTRUCT_MM, RECONSTRUCT_CM, RECONSTRUCT_M };

/// The surface with fewer triangles. Its vertices are points of the full surface.
struct reconstruct_mesh {
    struct reconstruct_result result;  // the full one but for points, pixels, normals, triangles
    bool requested;                    // by --triangles or --error: mesh.ply holds it as well
    double median_mm, p99_mm, max_mm;  // distances of the full surface's points from it
    uint32_t uncovered;                // of these points: outside its borders
};

struct reconstruct_context {
    const struct reconstruct_words *words;
    const struct reconstruct_result *result;
    const struct calibration *calibration;      // in force; of the shrunk images when `shrink` > 1
    const struct reconstruct_options *options;  // in force
    struct reconstruct_image left, right;       // raw images as the core got them
    struct picture_stats picture[2];            // of left and right, as they are judged

    const char *left_path, *right_path;
    struct capture_stamp capture;    // of a session's pair; its `session` is NULL for other images
    const char *calibration_path;    // NULL: none was given (--rectified)
    const char *calibration_format;  // e.g. "vergence", "OpenCV", "assumed"; never NULL
    const char *ground_truth_path;   // NULL: none
    const char *mask_path;           // of the ground truth; NULL: none
    double ground_truth_scale;       // disparity = value / scale in 8 bit truth; 0: not stated

    /// In words, where the calibration does not belong to the pair and was accepted; "" else.
    struct message mismatch;
    bool axes_compared;  // the calibration and the pair both say where all axes stood
    /// Of the instrument that took the pair; `has_instrument` false: it is not known.
    bool has_instrument;
    struct session_instrument instrument;

    /// Standard deviation that all depths share, at the median depth: see
    /// calibration_match_sigma_mm. Negative: not known.
    double depth_sigma_common_mm;

    bool metric;  // false: focal length or baseline are assumed, lengths are not real millimetres
    int shrink;   // integer factor by which the reader shrank the files' images; 1: not at all
    const struct reconstruct_mesh *mesh;  // NULL: not simplified
    bool compress;                        // mesh.glb
    enum reconstruct_unit mesh_unit;

    struct message warnings[RECONSTRUCT_CONTEXT_WARNINGS];  // what is assumed or doubtful
    int warning_count;

    int threads;
    uint64_t read_us;       // reading images and calibration
    uint64_t total_us;      // from start to the end of the last stage, without writing
    size_t arena_bytes;     // lent to the pipeline; result->arena_peak_bytes were used
    size_t rss_peak_bytes;  // of the process when the last stage ended
    const char *version, *build_id;
};

/// Adds a warning as printf would; those beyond the last place are dropped.
void reconstruct_context_warn(struct reconstruct_context *context, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/// The surface as mesh.ply holds it.
const struct reconstruct_result *reconstruct_context_ply(const struct reconstruct_context *context);

/// The unit of mesh.ply and points.pcd: its name, and how many micrometres it has.
const char *reconstruct_context_unit_name(const struct reconstruct_context *context);
float reconstruct_context_unit_um(const struct reconstruct_context *context);

/// One file of a result directory.
struct result_writer {
    const char *file_name;
    bool metric_only;  // left out when lengths are not real millimetres
    /// Writes the file; returns 0, or a negative error code with `message` set. May leave a partial
    /// file on failure: the directory it stands in is then removed as a whole.
    int (*write)(const struct reconstruct_context *context, const char *path,
                 struct message *message);
};

#ifdef __cplusplus
}
#endif

#endif
