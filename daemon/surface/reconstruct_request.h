// SPDX-License-Identifier: Apache-2.0
/// The command line of `vergence reconstruct`.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_REQUEST_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_REQUEST_H

#include <stdbool.h>

#include "console/command.h"
#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

struct reconstruct_request {
    const char *left_path, *right_path;
    const char *session_path;  // a session directory instead; NULL: not given
    const char *compact_path;  // a surface already measured instead; NULL: not given
    bool all;                  // all pairs of the session, or of the sessions in the directory
    int pair;                  // number of the pair in the session, from 1; 0: not given
    int with_pair;             // pair at another zoom; 0: not given
    const char *calibration_path, *out_path;
    double depth_mm[2];  // nearest and farthest depth; 0 0: not given
    int disparity[2];    // minimum, count; count INT_MIN: not given
    int region_px[4];    // x, y, width, height; width -1: not given
    double scale;
    int threads;  // 0: all processors
    bool rectified;
    double focal_px, baseline_mm;  // values of a rectified pair without calibration; 0: not given
    int unit;                      // index into "mm cm m"; -1: not given
    int first_camera;              // -1: not given
    int bayer;                     // index into "none grbg"; -1: not given
    int bits;                      // 0: as the files state
    int raw_px[2];                 // width, height; 0 0: not given
    int preset;                    // an enum match_preset; -1: not given
    bool no_refine, keep_all, fill;
    bool accept_mismatch;  // accept a calibration of other axes or cameras
    int speckle_px;        // -1: not given
    int triangles;         // maximum number in the mesh files; 0: not given
    double error_mm;       // allowed distance of the mesh from the points; 0: not given
    bool compress;         // mesh.glb is compressed
    int mesh_unit;         // unit of mesh.ply and points.pcd (reconstruct_unit); -1: not given
    const char *files;     // results to write, separated by commas; NULL: all
    const char *ground_truth_path, *mask_path;
    double ground_truth_scale;  // 0: not given
    const char *debug_path;     // NULL: no images
    int debug_row;              // -1: not given
    bool json, quiet;
};

/// The options, with offsets into the request. The first RECONSTRUCT_SHARED are those of the
/// console's command `reconstruct`, too.
enum { RECONSTRUCT_SHARED = 14 };
extern const struct command_argument reconstruct_arguments[];
extern const size_t reconstruct_argument_count;

/// The request with all defaults.
struct reconstruct_request reconstruct_request_defaults(void);

/// Parses and checks the command line. Returns OPTIONS_CONTINUE or the exit code to end with, see
/// options.h.
int reconstruct_request_parse(int argc, char **argv, struct reconstruct_request *request);

/// The same for a caller of a library: nothing is printed, --out may be missing. 0, or
/// ERROR_ARGUMENT or ERROR_MISSING with `message` set.
int reconstruct_request_read(int argc, char **argv, struct reconstruct_request *request,
                             struct message *message);

/// What is wrong with the depths, disparities and the region to search, in one line; NULL: nothing.
/// Completes them: near without far searches to infinity.
const char *reconstruct_request_check_search(struct reconstruct_request *request);

/// "mm", "cm", "m", or NULL if --unit was not given.
const char *reconstruct_request_unit(const struct reconstruct_request *request);

#ifdef __cplusplus
}
#endif

#endif
