// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_request.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "core/error.h"
#include "daemon/base/workers.h"
#include "daemon/cli/options.h"
#include "daemon/files/input_file.h"
#include "daemon/images/image_file.h"
#include "daemon/surface/length_check.h"
#include "daemon/surface/result/compact.h"
#include "daemon/surface/result/result_format.h"
#include "stereo/image/image.h"
#include "stereo/match/match.h"

#define FIELD(name) offsetof(struct reconstruct_request, name)

/// The first RECONSTRUCT_SHARED are also those of the console's command.
// clang-format off
const struct command_argument reconstruct_arguments[] = {
    {.name = "pair", .kind = COMMAND_INTEGER, .offset = FIELD(pair), .value_name = "N",
     .min = 1, .max = 1000000,
     .help = "Number of the pair in the session, from 1. Default: the last."},
    {.name = "with-pair", .kind = COMMAND_INTEGER, .offset = FIELD(with_pair), .value_name = "N",
     .min = 1, .max = 1000000,
     .help = "Pair N of the session, before or after zooming with pan and scene untouched, helps to find where the "
             "cameras are: what a wide pair shows of pan holds for a tele pair, which hardly shows it. Requires a "
             "calibration of all zooms."},
    {.name = "near", .kind = COMMAND_NUMBER, .offset = FIELD(depth_mm[0]), .value_name = "MM",
     .unit = "mm", .min = 1e-3, .max = 1e6,
     .help = "Minimum depth to search, from the left camera. No point lies outside near to far unless keep-all "
             "is set. Default: the calibration's range, else around the point where the cameras' axes meet, else "
             "disparities up to a quarter of the width."},
    {.name = "far", .kind = COMMAND_NUMBER, .offset = FIELD(depth_mm[1]), .value_name = "MM",
     .unit = "mm", .min = 1e-3, .max = INFINITY,
     .help = "Maximum depth to search; requires near. Default with near: inf."},
    {.name = "disparity", .kind = COMMAND_INTEGER, .offset = FIELD(disparity), .value_name = "MIN:COUNT",
     .min = -MATCH_DISPARITY_LIMIT, .max = MATCH_DISPARITY_LIMIT, .count = 2, .separator = ':',
     .help = "Disparities to search instead of depths, in pixels of the rectified images: MIN to "
             "MIN+COUNT-1. MIN may be negative."},
    {.name = "region", .kind = COMMAND_INTEGER, .offset = FIELD(region_px), .value_name = "X,Y,W,H",
     .min = 0, .max = IMAGE_MAX_SIDE_PX, .count = 4, .separator = ',',
     .help = "Reconstruct only this window of the rectified left image, in its pixels."},
    {.name = "scale", .kind = COMMAND_NUMBER, .offset = FIELD(scale), .value_name = "S",
     .min = 0.01, .max = 4,
     .help = "Size of the rectified images relative to the raw ones. Default: 1. Images above the maximum of "
             "4096 x 4096 pixels require a smaller scale."},
    {.name = "preset", .kind = COMMAND_CHOICE, .offset = FIELD(preset), .value_name = "NAME",
     .choices = "fast standard best board paper",
     .help = "Matcher effort: fast (every other row), standard, best (all disparities "
             "everywhere: thin objects and repeating texture), board (as on the instrument), paper "
             "(the original greedy path). Default: standard."},
    {.name = "no-refine", .kind = COMMAND_FLAG, .offset = FIELD(no_refine),
     .help = "Skip the sub-pixel refinement and its predicted deviation."},
    {.name = "keep-all", .kind = COMMAND_FLAG, .offset = FIELD(keep_all),
     .help = "Keep every match, however doubtful: for evaluating the matcher."},
    {.name = "fill", .kind = COMMAND_FLAG, .offset = FIELD(fill),
     .help = "Give pixels that could not be measured the most plausible surface around them, if there is any within "
             "64 px: in meshes only, marked, and not counted as measured. Maps and points.pcd stay as measured."},
    {.name = "accept-mismatch", .kind = COMMAND_FLAG, .offset = FIELD(accept_mismatch),
     .help = "Accept a calibration made at another pan, zoom, focus or iris, with "
             "other cameras, or with another window than those of SESSION: lengths are then wrong, and every "
             "result says so."},
    {.name = "speckle", .kind = COMMAND_INTEGER, .offset = FIELD(speckle_px), .value_name = "N",
     .min = 0, .max = 1000000,
     .help = "Reject regions of fewer than N pixels. Default: 60."},
    {.name = "files", .kind = COMMAND_TEXT, .offset = FIELD(files), .value_name = "LIST",
     .min = 1, .max = 200,
     .help = "Write only these results, e.g. disparity.pfm,result.json: the mesh takes most of the memory and "
             "space. Other results of an earlier run in the same directory are removed. Default: all."},
    {.name = "calibration", .kind = COMMAND_TEXT, .offset = FIELD(calibration_path), .value_name = "FILE",
     .help = "The calibration of the pair, in Vergence's own format or one that \"vergence info\" "
             "lists (OpenCV, ROS, Kalibr, mrcal, Middlebury, KITTI). Required unless --rectified is given "
             "or the session contains one."},
    {.name = "out", .kind = COMMAND_TEXT, .offset = FIELD(out_path), .value_name = "DIR",
     .help = "Directory for the results; created if missing. Results of an earlier run in it, which "
             "its hidden list .vergence-files names, are replaced; a file of another origin with a "
             "result's name is refused. Required."},
    {.name = "all", .kind = COMMAND_FLAG, .offset = FIELD(all),
     .help = "Measure all pairs of SESSION, or of all sessions in that directory, in one process: into 0001, 0002 ... "
             "in DIR (or SESSION/0001 ...), with a table in pairs.json. The same command again keeps results that "
             "would be the same and makes the rest. A pair that cannot be measured does not stop the others; the exit "
             "code is the first one's."},
    {.name = "threads", .kind = COMMAND_INTEGER, .offset = FIELD(threads), .value_name = "N",
     .min = 1, .max = WORKERS_MAX_THREADS,
     .help = "Number of threads; the result does not depend on it. Default: all processors."},
    {.name = "rectified", .kind = COMMAND_FLAG, .offset = FIELD(rectified),
     .help = "The images are already rectified. With --calibration the file's rectified cameras are "
             "used. Without it the geometry comes from --focal and --baseline, or is assumed: "
             "shapes are then correct only up to a stretch in depth and lengths are meaningless; the "
             "results say so."},
    {.name = "focal", .kind = COMMAND_NUMBER, .offset = FIELD(focal_px), .value_name = "PX",
     .min = 1, .max = 1e6,
     .help = "With --rectified and no calibration: focal length in pixels of the images in the files."},
    {.name = "baseline", .kind = COMMAND_NUMBER, .offset = FIELD(baseline_mm), .value_name = "MM",
     .min = 1e-3, .max = 1e5,
     .help = "With --rectified and no calibration: distance between the cameras in mm."},
    {.name = "unit", .kind = COMMAND_CHOICE, .offset = FIELD(unit), .value_name = "UNIT",
     .choices = "mm cm m",
     .help = "Unit of length of an imported calibration. Default: what its format prescribes, mm where it "
             "prescribes none. Options and results are always in mm. Without it a baseline below 5 mm "
             "or above 10 m or a depth below 10 mm is rejected, as the unit is probably another one; "
             "--unit mm accepts lengths in options."},
    {.name = "first-camera", .kind = COMMAND_INTEGER, .offset = FIELD(first_camera), .value_name = "N",
     .min = 0, .max = 8,
     .help = "Number of the left camera in a calibration of several pairs (KITTI: 0 grey, 2 colour)."},
    {.name = "bayer", .kind = COMMAND_CHOICE, .offset = FIELD(bayer), .value_name = "PATTERN",
     .choices = "none grbg",
     .help = "Whether grey images are mosaics of a colour sensor. Default: grbg for .raw files, "
             "none for all others."},
    {.name = "bits", .kind = COMMAND_INTEGER, .offset = FIELD(bits), .value_name = "N",
     .min = 8, .max = 16,
     .help = "Significant bits of a pixel. Default: as the file states; 10 for .raw files."},
    {.name = "raw", .kind = COMMAND_INTEGER, .offset = FIELD(raw_px), .value_name = "WxH",
     .min = 1, .max = IMAGE_FILE_MAX_SIDE_PX, .count = 2, .separator = 'x',
     .help = "Size of .raw files (16 bit little-endian words without a header). Default: 2048x1536."},
    {.name = "triangles", .kind = COMMAND_INTEGER, .offset = FIELD(triangles), .value_name = "N",
     .min = 1, .max = INT_MAX,
     .help = "Maximum number of triangles in mesh.glb and mesh.ply: simplified where it changes the surface "
             "least, in pixels. Holes stay open. Default: mesh.glb is simplified within half of the predicted "
             "deviation and a tenth of a pixel, mesh.ply contains every point. Not on the board."},
    {.name = "error", .kind = COMMAND_NUMBER, .offset = FIELD(error_mm), .value_name = "MM",
     .min = 1e-3, .max = 1e6,
     .help = "Use the fewest triangles in mesh.glb and mesh.ply that keep 99 % of the measured points within MM of "
             "the surface; result.json states the distances. Not on the board."},
    {.name = "compress", .kind = COMMAND_FLAG, .offset = FIELD(compress),
     .help = "Compress mesh.glb (EXT_meshopt_compression): about a third of the size, for three.js, "
             "Babylon.js and other viewers with the decoder; Blender before 5.2 cannot open it. Not on the board."},
    {.name = "mesh-unit", .kind = COMMAND_CHOICE, .offset = FIELD(mesh_unit), .value_name = "UNIT",
     .choices = "mm cm m",
     .help = "Unit of length in mesh.ply and points.pcd. Default: mm. (mesh.glb is in metres, as glTF requires.)"},
    {.name = "ground-truth", .kind = COMMAND_TEXT, .offset = FIELD(ground_truth_path), .value_name = "FILE",
     .help = "True disparities of the rectified left image, for the error map of the report."},
    {.name = "mask", .kind = COMMAND_TEXT, .offset = FIELD(mask_path), .value_name = "FILE",
     .help = "With --ground-truth: which pixels count (255 visible in both, 128 occluded, 0 unknown)."},
    {.name = "ground-truth-scale", .kind = COMMAND_NUMBER, .offset = FIELD(ground_truth_scale), .value_name = "S",
     .min = 1e-3, .max = 1e6,
     .help = "With --ground-truth: factor by which the values of an 8 bit image were multiplied."},
    {.name = "debug", .kind = COMMAND_TEXT, .offset = FIELD(debug_path), .value_name = "DIR",
     .help = "Also write an image of each matching stage and a page that "
             "explains them (debug.html) into this directory. The results do not change. "
             "Not on the board."},
    {.name = "debug-row", .kind = COMMAND_INTEGER, .offset = FIELD(debug_row), .value_name = "N",
     .min = 0, .max = IMAGE_MAX_SIDE_PX - 1,
     .help = "With --debug: the row of the rectified left image whose costs are drawn. "
             "Default: the middle one."},
    {.name = "json", .kind = COMMAND_FLAG, .offset = FIELD(json),
     .help = "Print result.json to standard output instead of the summary."},
    {.name = "quiet", .kind = COMMAND_FLAG, .offset = FIELD(quiet),
     .help = "Print no summary, warnings or progress."},
};
// clang-format on
const size_t reconstruct_argument_count =
    sizeof reconstruct_arguments / sizeof reconstruct_arguments[0];

static const struct option_page page = {
    .command = "vergence reconstruct",
    .operands = "LEFT RIGHT | SESSION | COMPACT",
    .summary = "measure a surface from a pair of images",
    .description =
        "Rectifies the pair, finds the disparity of every pixel of the left image, or the reason "
        "why there is none, and writes the surface in millimetres in the frame of the left camera "
        "(x right, y down, z forward), as files:\n"
        ".vergence-files (which files these are)" RESULT_FORMAT_HELP
        ".\n"
        "SESSION is a directory written by \"capture\" or \"record\" of vergenced: its last pair "
        "is measured with the session's calibration, unless --calibration names another; "
        "--all measures all pairs.\n"
        "COMPACT is the surface.compact of an earlier run, here or on the instrument: the same "
        "files are made of it without the images, but for right_rectified.png and the report's.\n"
        "The directory of results appears once everything is written; before that, and after any "
        "failure, nothing of this run exists under its name. Ctrl-C stops within a second.",
    .examples =
        "vergence reconstruct left.png right.png --calibration rig.txt --out result\n"
        "vergence reconstruct l.pgm r.pgm --calibration intrinsics.yml --near 400 --far 900 "
        "--out result\n"
        "vergence reconstruct files/scene --calibration calibrated/rig.calibration --out result\n"
        "vergence reconstruct files --all --calibration calibrated/rig.calibration --out results\n"
        "vergence reconstruct result/surface.compact --triangles 100000 --out web\n"
        "vergence reconstruct im0.png im1.png --rectified --disparity 0:128 --out result\n"
        "vergence reconstruct im0.png im1.png --rectified --disparity 0:64 --out result "
        "--debug why",
    .options = reconstruct_arguments,
    .option_count = sizeof reconstruct_arguments / sizeof reconstruct_arguments[0],
    .operands_min = 1,
    .operands_max = 2,
};

/// What is wrong with images and session; NULL: nothing.
static const char *check_images(const struct reconstruct_request *request) {
    if (request->session_path == NULL && request->right_path == NULL) {
        return "missing RIGHT (expected two images, a recorded session or a surface.compact)";
    }
    if (request->session_path == NULL && request->pair != 0) {
        return "--pair requires a recorded session";
    }
    if (request->session_path == NULL && request->with_pair != 0) {
        return "--with-pair requires a recorded session";
    }
    if (request->session_path != NULL &&
        (request->bits != 0 || request->bayer >= 0 || request->raw_px[0] != 0)) {
        return "--bits, --bayer and --raw are for images (a session states its own frame format)";
    }
    return NULL;
}

/// What is wrong with the request for all pairs; NULL: nothing.
static const char *check_all(const struct reconstruct_request *request) {
    if (!request->all) {
        return NULL;
    }
    if (request->session_path == NULL) {
        return "--all requires a recorded session, or a directory of them";
    }
    const bool one_pair = request->pair != 0 || request->with_pair != 0 ||
                          request->debug_path != NULL || request->ground_truth_path != NULL;
    return one_pair ? "--all cannot be combined with --pair, --with-pair, --debug or --ground-truth"
                    : NULL;
}

/// What is wrong with the calibration; NULL: nothing.
static const char *check_calibration(const struct reconstruct_request *request) {
    if (request->session_path == NULL && request->calibration_path == NULL && !request->rectified) {
        return "missing --calibration FILE (or --rectified for a rectified pair without one)";
    }
    if ((!request->rectified || request->calibration_path != NULL) &&
        (request->focal_px > 0 || request->baseline_mm > 0)) {
        return "--focal and --baseline require --rectified and no --calibration";
    }
    if (request->calibration_path == NULL && request->first_camera >= 0) {
        return "--first-camera requires --calibration";
    }
    if (request->calibration_path == NULL && request->unit > 0) {
        return "--unit cm and --unit m require --calibration";
    }
    return NULL;
}

/// What is wrong with the depths, which it completes; NULL: nothing.
static const char *check_depths(struct reconstruct_request *request) {
    double *depth_mm = request->depth_mm;
    if (depth_mm[0] == 0 && depth_mm[1] > 0) {
        return "far requires near";
    }
    if (depth_mm[0] > 0 && depth_mm[1] == 0) {
        depth_mm[1] = INFINITY;
    }
    if (depth_mm[1] > 0 && !(depth_mm[0] < depth_mm[1])) {
        return "near must be less than far";
    }
    if (depth_mm[1] > 0 && request->disparity[1] != INT_MIN) {
        return "near and far cannot be combined with disparity";
    }
    return NULL;
}

const char *reconstruct_request_check_search(struct reconstruct_request *request) {
    const char *wrong = check_depths(request);
    if (wrong != NULL) {
        return wrong;
    }
    if (request->disparity[1] < 1 && request->disparity[1] != INT_MIN) {
        return "disparity MIN:COUNT is empty (COUNT must be at least 1)";
    }
    if (request->region_px[2] == 0 || request->region_px[3] == 0) {
        return "region X,Y,W,H is empty (W and H must be at least 1)";
    }
    return NULL;
}

/// What is wrong with the outputs; NULL: nothing.
static const char *check_outputs(const struct reconstruct_request *request) {
    if (request->triangles > 0 && request->error_mm > 0) {
        return "--triangles and --error cannot be combined";
    }
    if (request->ground_truth_path == NULL &&
        (request->mask_path != NULL || request->ground_truth_scale > 0)) {
        return "--mask and --ground-truth-scale require --ground-truth";
    }
    if (request->debug_path == NULL && request->debug_row >= 0) {
        return "--debug-row requires --debug";
    }
    return NULL;
}

/// What is wrong with the options for a surface that was measured already: only files are made of
/// it. NULL: nothing.
static const char *check_compact(const struct reconstruct_request *request) {
    static const char of_files[] =
        "files out threads triangles error compress mesh-unit ground-truth mask ground-truth-scale "
        "json quiet";
    const struct reconstruct_request defaults = reconstruct_request_defaults();
    static char wrong[128];
    const char *other = options_find_other(&page, of_files, request, &defaults);
    snprintf(wrong, sizeof wrong, "--%.30s needs the images, which COMPACT does not have",
             other != NULL ? other : "");
    return other != NULL ? wrong : check_outputs(request);
}

/// Contradictions that the option table cannot express; NULL if there are none.
static const char *find_contradiction(struct reconstruct_request *request) {
    if (request->compact_path != NULL) {
        return check_compact(request);
    }
    const char *wrong = check_images(request);
    wrong = wrong != NULL ? wrong : check_all(request);
    wrong = wrong != NULL ? wrong : check_calibration(request);
    wrong = wrong != NULL ? wrong : reconstruct_request_check_search(request);
    return wrong != NULL ? wrong : check_outputs(request);
}

/// Rejects lengths that look like metres; returns 0, or an error code with `message` set.
static int check_lengths(const struct reconstruct_request *request, struct message *message) {
    if (request->unit == 0) {
        return ERROR_OK;
    }
    const int error =
        length_check_depth(request->depth_mm[0], request->depth_mm[1], "--near and --far",
                           ", or confirm with --unit mm", message);
    if (error != ERROR_OK || request->baseline_mm == 0) {
        return error;
    }
    return length_check_baseline(request->baseline_mm, "--baseline", "confirm with --unit mm",
                                 message);
}

struct reconstruct_request reconstruct_request_defaults(void) {
    return (struct reconstruct_request){.scale = 1,
                                        .disparity = {0, INT_MIN},
                                        .region_px = {0, 0, -1, -1},
                                        .unit = -1,
                                        .first_camera = -1,
                                        .bayer = -1,
                                        .speckle_px = -1,
                                        .preset = -1,
                                        .mesh_unit = -1,
                                        .debug_row = -1};
}

/// Sets what the operands name, and checks the whole request. ERROR_MISSING: no such file;
/// ERROR_ARGUMENT: wrong usage; with `message` set.
static int complete(struct reconstruct_request *request, const char *const *operands, int count,
                    struct message *message) {
    if (count == 1 && access(operands[0], F_OK) != 0) {
        return message_set(message, ERROR_MISSING, "%s: %s", operands[0], strerror(errno));
    }
    if (count == 1 && input_file_is_directory(operands[0])) {
        request->session_path = operands[0];
    } else if (count == 1 && compact_is(operands[0])) {
        request->compact_path = operands[0];
    } else {
        request->left_path = operands[0];
        request->right_path = operands[1];
    }
    const char *contradiction = find_contradiction(request);
    if (contradiction != NULL) {
        return message_set(message, ERROR_ARGUMENT, "%s", contradiction);
    }
    return check_lengths(request, message) == ERROR_OK ? ERROR_OK : ERROR_ARGUMENT;
}

int reconstruct_request_read(int argc, char **argv, struct reconstruct_request *request,
                             struct message *message) {
    *request = reconstruct_request_defaults();
    const char *operands[2] = {NULL, NULL};
    int operand_count = 0;
    const int error = options_read(&page, argc, argv, request, operands, &operand_count, message);
    return error != ERROR_OK ? error : complete(request, operands, operand_count, message);
}

int reconstruct_request_parse(int argc, char **argv, struct reconstruct_request *request) {
    *request = reconstruct_request_defaults();
    const char *operands[2] = {NULL, NULL};
    int operand_count = 0;
    options_rename(argc, argv, "--bracket", "--with-pair");
    const int exit_code = options_parse(&page, argc, argv, request, operands, &operand_count);
    if (exit_code != OPTIONS_CONTINUE) {
        return exit_code;
    }
    struct message message;
    const int error = request->out_path == NULL
                          ? message_set(&message, ERROR_ARGUMENT, "missing --out DIR")
                          : complete(request, operands, operand_count, &message);
    if (error != ERROR_OK) {
        fprintf(stderr, "vergence reconstruct: %s\n", message.text);
        return error == ERROR_MISSING ? CLIENT_BAD_INPUT : CLIENT_USAGE;
    }
    return OPTIONS_CONTINUE;
}

const char *reconstruct_request_unit(const struct reconstruct_request *request) {
    static const char *const units[] = {"mm", "cm", "m"};
    return request->unit >= 0 ? units[request->unit] : NULL;
}
