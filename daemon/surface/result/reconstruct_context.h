// SPDX-License-Identifier: Apache-2.0
/// Everything that a writer of results may use: the result, its inputs, the assumptions and the
/// cost. Owns nothing; all pointers stay valid until the last writer is done.
#ifndef VERGENCE_DAEMON_SURFACE_RESULT_RECONSTRUCT_CONTEXT_H
#define VERGENCE_DAEMON_SURFACE_RESULT_RECONSTRUCT_CONTEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"
#include "daemon/session/capture_info.h"
#include "daemon/session/session.h"
#include "daemon/surface/result/result_figures.h"
#include "stereo/image/picture_stats.h"
#include "stereo/reconstruct.h"
#include "stereo/zoom/wide_pair.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RECONSTRUCT_CONTEXT_WARNINGS = 16 };

struct reconstruct_context;
struct reconstruct_inputs;
struct reconstruct_request;

/// Who runs a reconstruction: how it is spoken to, where its inputs come from and who observes it.
/// All functions are called on the thread that runs the job.
struct reconstruct_caller {
    // Names of what the user can change, for messages: options of the command line, or arguments at
    // the console.
    const char *scale;    // sets the size of the rectified images
    const char *smaller;  // everything that makes them smaller
    const char *depth;    // sets the depth range
    const char *search;   // everything that sets the search range
    const char *accept;   // accepts a calibration that does not belong to the pair
    /// Provides what the request asks for and adds assumptions and doubts to the context's
    /// warnings. Returns 0, or a negative error code with `message` set and nothing to free. What
    /// `source` points to stays valid until the job ends.
    int (*read)(void *source, const struct reconstruct_request *request,
                struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                struct message *message);
    void *source;
    /// True: the job should end soon with ERROR_CANCELLED. NULL: only signals end it.
    bool (*should_stop)(void *self);
    /// Relative work of the stages 0 to `stages` - 1, before they begin. NULL: not wanted.
    void (*expect)(void *self, const double *work_ns, int stages);
    /// `done` of `total` parts of a stage are done; `what` has static storage.
    void (*progress)(void *self, int stage, const char *what, int done, int total);
    void *self;
};

/// Unit of mesh.ply and points.pcd, in the order of the option --mesh-unit.
enum reconstruct_unit { RECONSTRUCT_MM, RECONSTRUCT_CM, RECONSTRUCT_M };

struct reconstruct_context {
    const struct reconstruct_caller *caller;
    const struct reconstruct_result *result;
    const struct calibration *calibration;      // the one in use; for shrunk images if `shrink` > 1
    const struct reconstruct_options *options;  // the options in use
    struct raw_image left, right;               // raw images as passed to the core
    struct picture_stats picture[2];            // statistics of left and right

    const char *left_path, *right_path;
    struct capture_info capture;     // its `session` is NULL for images from elsewhere
    const char *decisions;           // of `measure`, which took the pair, a line each; NULL: none
    const char *calibration_path;    // NULL: not given (--rectified)
    const char *calibration_format;  // e.g. "vergence", "OpenCV", "assumed"; never NULL
    const char *ground_truth_path;   // NULL: not given
    const char *mask_path;           // mask of the ground truth; NULL: not given
    double ground_truth_scale;       // disparity = value / scale in 8 bit truth; 0: not stated

    /// Description of an accepted mismatch between calibration and pair; "": no mismatch.
    struct message mismatch;
    bool axes_compared;  // calibration and pair both record the positions of all axes
    /// Of the instrument that took the pair, and where its axes were; `has_instrument` false:
    /// unknown.
    bool has_instrument;
    struct pair_instrument instrument;
    struct calibration_origin axes;

    /// The calibration was corrected by what the pair shows; `self_calibration` describes how far.
    bool self_calibrated;
    struct adjust_report self_calibration;
    uint32_t with_pair;   // number of the second pair that helps with this one; 0: none
    bool with_pair_used;  // the second pair did help
    struct wide_pair_report wide_pair;
    int target_points;                    // of a thing of known size that helped, too; 0: none
    struct adjust_report without_target;  // what the pictures alone gave then

    /// Standard deviation that all depths share, at the median depth: see
    /// calibration_match_sigma_mm. Negative: unknown.
    double depth_sigma_common_mm;

    bool has_spread;  // `spread` is that of the result; else it is computed where it is needed
    struct surface_figures_spread spread;

    bool metric;  // false: focal length or baseline are assumed, lengths are not real millimetres
    int shrink;   // integer factor by which the reader shrank the images; 1: not shrunk
    /// The simplified surface, with its own points, pixels, normals and triangles; its vertices are
    /// points of the full surface. NULL: not simplified.
    const struct reconstruct_result *mesh;
    bool mesh_requested;  // --triangles or --error was given: mesh.ply contains the mesh too
    double mesh_median_mm, mesh_p99_mm, mesh_max_mm;  // distance of the full surface's points
    uint32_t mesh_uncovered;                          // points outside its borders
    bool compress;                                    // mesh.glb is compressed
    enum reconstruct_unit mesh_unit;

    struct message warnings[RECONSTRUCT_CONTEXT_WARNINGS];  // assumptions and doubts
    int warning_count;
    int notes_measured;  // the first so many are on the surface, the others on files made of it

    /// Called by the writer of surface.compact, the last one: the rows above `rows` of the result's
    /// maps are not read again. NULL: they may be.
    void (*rows_written)(void *owner, int rows);
    void *owner;

    int threads;
    uint64_t read_us;       // reading images and calibration
    uint64_t total_us;      // time until the end of the last stage, without writing
    size_t arena_bytes;     // given to the pipeline; result->arena_peak_bytes were used
    size_t rss_peak_bytes;  // peak memory of the process when the last stage ended
    const char *version, *build_id;
};

/// Adds a warning, formatted as by printf; dropped if there are already too many.
void reconstruct_context_warn(struct reconstruct_context *context, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/// Quantiles of the result, which must have points, as by result_figures_spread.
bool reconstruct_context_spread(const struct reconstruct_context *context,
                                struct surface_figures_spread *spread);

/// The surface as written to mesh.ply.
const struct reconstruct_result *reconstruct_context_ply(const struct reconstruct_context *context);

/// The unit of mesh.ply and points.pcd: its name, and its length in micrometres.
const char *reconstruct_context_unit_name(const struct reconstruct_context *context);
float reconstruct_context_unit_um(const struct reconstruct_context *context);

#ifdef __cplusplus
}
#endif

#endif
