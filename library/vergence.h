/* SPDX-License-Identifier: Apache-2.0 */
/* libvergence: from two images and a calibration to a measured surface, in one process.
 *
 *     vergence_reconstruct_files("left.png", "right.png", rig, options, NULL, &result, &error)
 *
 * - What the program `vergence` does, by the same code: the same bytes come out. `options` are the
 * words of its command line, e.g. {"--near", "500", "--far", "4000", NULL}; see "vergence help
 * reconstruct". NULL: none.
 * - Lengths are in mm. The camera's frame is the left camera's: x right, y down, z forward. Pixel
 * (0,0) is the centre of the top-left pixel. Maps have the size of the rectified left image.
 * - A function that returns int returns 0, or a negative code with one line in `error` (NULL: not
 *   wanted), in the words of the program; outputs are then unchanged.
 * - What a function gives out belongs to the caller, who frees it by the function named there. What
 * an accessor returns belongs to its object and stays valid until that is freed. Arguments are not
 * kept.
 * - Different objects may be used by different threads at the same time; one object may be read by
 *   several threads once it is made. Nothing is printed, no signal is caught.
 * - The functions of version 1 stay as they are; structs of this header do not change within it. */
#ifndef VERGENCE_H
#define VERGENCE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define VERGENCE_API __attribute__((visibility("default")))
#else
#define VERGENCE_API
#endif

/* "0.1.0", and the build: `git describe`, or "unknown". */
VERGENCE_API const char *vergence_version(void);
VERGENCE_API const char *vergence_build(void);

/* The codes are those of firmware/core/error.h. */
struct vergence_error {
    int code;
    char text[1024];
};
/* "SYNTAX", "SIZE_MISMATCH", "NO_SURFACE", "CANCELLED", ...; static storage. */
VERGENCE_API const char *vergence_error_name(int code);

/* Who watches a long call. All functions are called on the thread that called the library. */
struct vergence_observer {
    /* `stage` (static storage) is in progress, and `share` of the whole is done, 0 to 1. NULL:
     * none. */
    void (*progress)(void *self, const char *stage, double share);
    /* Not 0: end soon, with the code CANCELLED. NULL: never. */
    int (*should_stop)(void *self);
    void *self;
};

/* ---- Images ---- */

enum vergence_layout {
    VERGENCE_GREY = 1,
    VERGENCE_RGB = 2,
    VERGENCE_BGR = 3,
    VERGENCE_BAYER_GRBG = 4 /* a mosaic, linear; even rows G R, odd rows B G */
};

/* An image in the caller's memory, which stays unchanged during the call. */
struct vergence_image {
    const void *data;    /* first value of the first row */
    ptrdiff_t row_bytes; /* from one row to the next; may be negative */
    int width_px, height_px;
    int value_bytes; /* 1: uint8_t, 2: uint16_t */
    int bits;        /* significant ones; 0: 8 or 16 */
    enum vergence_layout layout;
    const char *name; /* for messages; NULL: "left" or "right" */
};

/* ---- Calibrations ---- */

typedef struct vergence_calibration vergence_calibration;

/* Any calibration that "vergence info" lists. Options: --size, --unit, --rectified, --first-camera,
 * and --at STATE of a calibration of all zooms. Free with vergence_calibration_free. */
VERGENCE_API int vergence_calibration_load(const char *path, const char *const *options,
                                           vergence_calibration **calibration,
                                           struct vergence_error *error);
/* Our own text. */
VERGENCE_API int vergence_calibration_parse(const char *text, size_t length,
                                            vergence_calibration **calibration,
                                            struct vergence_error *error);

/* `words`: the operands and options of "vergence calibrate". Without --out nothing is written. A
 * calibration that is not good is still given out, see vergence_calibration_is_good. */
VERGENCE_API int vergence_calibrate(const char *const *words,
                                    const struct vergence_observer *observer,
                                    vergence_calibration **calibration,
                                    struct vergence_error *error);

VERGENCE_API void vergence_calibration_free(vergence_calibration *calibration);

/* Our own text, with its checksum. */
VERGENCE_API const char *vergence_calibration_text(const vergence_calibration *calibration);
/* Name of the format that it was read from: "vergence", "OpenCV", ... */
VERGENCE_API const char *vergence_calibration_format(const vergence_calibration *calibration);
/* Of vergence_calibrate: 1, or 0 with the reason in the verdict; of others 1 and "". */
VERGENCE_API int vergence_calibration_is_good(const vergence_calibration *calibration);
VERGENCE_API const char *vergence_calibration_verdict(const vergence_calibration *calibration);
/* calibration.json of vergence_calibrate; else "". */
VERGENCE_API const char *vergence_calibration_json(const vergence_calibration *calibration);
/* What was assumed or left out: note 0, 1, ...; NULL after the last. */
VERGENCE_API const char *vergence_calibration_note(const vergence_calibration *calibration,
                                                   size_t number);

enum vergence_lens { VERGENCE_BROWN_CONRADY = 1, VERGENCE_RATIONAL = 2, VERGENCE_EQUIDISTANT = 3 };

struct vergence_camera {
    int width_px, height_px;
    double fx_px, fy_px, cx_px, cy_px;
    enum vergence_lens lens;
    /* In OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6; of an equidistant lens k1 k2 k3 k4. */
    double coefficients[8];
};
/* `side`: 0 left, 1 right. */
VERGENCE_API void vergence_calibration_camera(const vergence_calibration *calibration, int side,
                                              struct vergence_camera *camera);
/* point_right = R point_left + t_mm; R by rows. */
VERGENCE_API void vergence_calibration_pose(const vergence_calibration *calibration, double R[9],
                                            double t_mm[3]);
/* As OpenCV's stereoRectify returns them, for rectified images of the raw images' size. */
struct vergence_rectified {
    double R1[9], R2[9], P1[12], P2[12];
};
VERGENCE_API int vergence_calibration_rectify(const vergence_calibration *calibration,
                                              struct vergence_rectified *rectified,
                                              struct vergence_error *error);
/* Writes our own text; an existing file is replaced once the new one is whole. */
VERGENCE_API int vergence_calibration_save(const vergence_calibration *calibration,
                                           const char *path, struct vergence_error *error);
/* The files of another program ("opencv", "ros", "kalibr", "mrcal") into a directory. */
VERGENCE_API int vergence_calibration_export(const vergence_calibration *calibration,
                                             const char *format, const char *directory,
                                             struct vergence_error *error);

/* ---- Reconstruction ---- */

typedef struct vergence_result vergence_result;

/* `calibration` NULL: the options name one, or say --rectified. No --out: see
 * vergence_result_write. Free with vergence_result_free. NO_SURFACE: nothing could be measured. */
VERGENCE_API int vergence_reconstruct(const struct vergence_image *left,
                                      const struct vergence_image *right,
                                      const vergence_calibration *calibration,
                                      const char *const *options,
                                      const struct vergence_observer *observer,
                                      vergence_result **result, struct vergence_error *error);
/* The same of files; `right` NULL: `left` is a recorded session, which may have a calibration. */
VERGENCE_API int vergence_reconstruct_files(const char *left, const char *right,
                                            const vergence_calibration *calibration,
                                            const char *const *options,
                                            const struct vergence_observer *observer,
                                            vergence_result **result, struct vergence_error *error);

VERGENCE_API void vergence_result_free(vergence_result *result);

/* The files of "vergence reconstruct" into a directory, whole or not at all. Options: --files,
 * --triangles, --error, --compress, --mesh-unit. Not at the same time as any other use of the
 * result. */
VERGENCE_API int vergence_result_write(vergence_result *result, const char *directory,
                                       const char *const *options,
                                       const struct vergence_observer *observer,
                                       struct vergence_error *error);

/* Maps: one value, or three, for each pixel; row after row. Values without a measurement are NaN.
 */
enum vergence_map {
    VERGENCE_DISPARITY_PX = 1, /* float: x_left - x_right */
    VERGENCE_DEPTH_MM = 2,     /* float: z in the left camera's frame; metric results only */
    VERGENCE_SIGMA_MM = 3, /* float: predicted deviation along the ray, without the common part */
    VERGENCE_REASON = 4,   /* uint8_t: why there is no disparity, see vergence_reason_text */
    VERGENCE_LEFT_RGB = 5, /* 3 uint8_t: the rectified left image */
    VERGENCE_RIGHT_RGB = 6 /* 3 uint8_t: the rectified right image */
};
/* UNSUPPORTED: a result that is not metric has no depths. */
VERGENCE_API int vergence_result_map(const vergence_result *result, enum vergence_map map,
                                     const void **data, struct vergence_error *error);
VERGENCE_API void vergence_result_size(const vergence_result *result, int *width_px,
                                       int *height_px);
/* Text of a value of VERGENCE_REASON; NULL: there is no such value. The valid ones are below 0 1.
 */
VERGENCE_API const char *vergence_reason_text(int reason);
VERGENCE_API int vergence_reason_has_disparity(int reason);

/* The points of the surface and its triangles. */
struct vergence_surface {
    size_t points, triangles;
    const float *position_mm;      /* 3 for each point */
    const float *normal;           /* 3 for each point */
    const uint8_t *colour;         /* 3 for each point: R G B */
    const float *sigma_mm;         /* along the ray, without the common part */
    const uint32_t *pixel;         /* y * width + x of the rectified left image */
    const uint32_t (*triangle)[3]; /* points, counter-clockwise seen from the camera */
};
VERGENCE_API int vergence_result_surface(const vergence_result *result,
                                         struct vergence_surface *surface,
                                         struct vergence_error *error);

/* result.json. */
VERGENCE_API const char *vergence_result_json(const vergence_result *result);
/* 1: lengths are real millimetres. 0: the geometry was assumed. */
VERGENCE_API int vergence_result_is_metric(const vergence_result *result);
/* Standard deviation that all depths share, at the median depth; < 0: not known. */
VERGENCE_API double vergence_result_common_sigma_mm(const vergence_result *result);
/* Assumptions and doubts: note 0, 1, ...; NULL after the last. */
VERGENCE_API const char *vergence_result_note(const vergence_result *result, size_t number);
/* The calibration in use, corrected by the pair where it was. Free with vergence_calibration_free.
 */
VERGENCE_API int vergence_result_calibration(const vergence_result *result,
                                             vergence_calibration **calibration,
                                             struct vergence_error *error);

/* ---- Many pairs ---- */

/* The pairs of sessions and what became of each, as `vergence reconstruct --all` keeps it in
 * pairs.json, for a program that distributes the work. One thread at a time. */
typedef struct vergence_pairs vergence_pairs;

struct vergence_pair {
    const char *session; /* its path */
    int number;          /* of the pair; 0: the session cannot be read (further) */
    const char *name;    /* of the directory of its results, below the one of all */
    int done;            /* 1: the results are there */
    int kept;            /* 1: an earlier run made them, and this one would make the same */
    const char *error;   /* why there are none; NULL: not known to fail */
    size_t points;
    int notes;
    double depth_mm, sigma_mm; /* medians; NaN: none */
    double seconds;
};
struct vergence_file {
    const char *name;
    const void *data;
    size_t bytes;
};
/* `paths`: sessions or directories of sessions, up to NULL. `directory`: of the results. The rest
 * as for vergence_reconstruct_files: all results depend on it. Free with vergence_pairs_free. */
VERGENCE_API int vergence_pairs_list(const char *const *paths, const char *directory,
                                     const vergence_calibration *calibration,
                                     const char *const *options, vergence_pairs **pairs,
                                     struct vergence_error *error);
VERGENCE_API void vergence_pairs_free(vergence_pairs *pairs);
VERGENCE_API size_t vergence_pairs_count(const vergence_pairs *pairs);
/* `number`: 0 to count - 1. */
VERGENCE_API void vergence_pairs_get(const vergence_pairs *pairs, size_t number,
                                     struct vergence_pair *pair);
/* Takes over what became of a pair, from `done` on but for `kept`, and saves pairs.json. */
VERGENCE_API int vergence_pairs_set(vergence_pairs *pairs, size_t number,
                                    const struct vergence_pair *pair, struct vergence_error *error);
/* Writes a pair's files, which were made elsewhere, where its results belong: all or none. */
VERGENCE_API int vergence_pairs_store(const vergence_pairs *pairs, size_t number,
                                      const struct vergence_file *files, size_t count,
                                      struct vergence_error *error);

/* ---- Lengths and shapes ---- */

/* `sigma`: one standard deviation. `sigma_common`: the part of it that all points share; < 0: not
 * known, and not part of `sigma`. */
struct vergence_value {
    double value, sigma, sigma_common;
};
struct vergence_plane {
    double normal[3], centre_mm[3];              /* the normal points towards the camera */
    struct vergence_value distance_mm, tilt_deg; /* of the left camera; against its axis */
    double normal_sigma_deg, rms_mm;
    size_t points, used; /* in the mask; without those that lie far off the plane */
};
struct vergence_cylinder {
    double axis[3], centre_mm[3];
    struct vergence_value radius_mm;
    double axis_sigma_deg, length_mm, rms_mm;
    size_t points, used;
};
/* At pixels of the maps, rounded to whole ones. MISSING: not measured there. */
VERGENCE_API int vergence_result_depth(const vergence_result *result, double x_px, double y_px,
                                       struct vergence_value *depth_mm,
                                       struct vergence_error *error);
VERGENCE_API int vergence_result_distance(const vergence_result *result, const double from_px[2],
                                          const double to_px[2], struct vergence_value *distance_mm,
                                          struct vergence_error *error);
/* `mask`: a value for each pixel of the maps, row after row; not 0: use its point. NULL: all
 * points. */
VERGENCE_API int vergence_result_plane(const vergence_result *result, const uint8_t *mask,
                                       struct vergence_plane *plane, struct vergence_error *error);
VERGENCE_API int vergence_result_cylinder(const vergence_result *result, const uint8_t *mask,
                                          struct vergence_cylinder *cylinder,
                                          struct vergence_error *error);

/* ---- Comparison with the truth ---- */

struct vergence_score {
    size_t pixels;
    double bad_percent[4]; /* off by more than 0.5, 1, 2, 4 px */
    double average_px, rms_px;
};
struct vergence_evaluation {
    struct vergence_score filled_all, measured_all, filled_visible, measured_visible;
    double density_all_percent, density_visible_percent;
};
/* As "vergence evaluate": maps of width x height, not finite where not measured or not known;
 * `mask`: 255 visible in both, 128 occluded, 0 unknown; NULL: none. MISSING: the truth has no known
 * pixel. */
VERGENCE_API int vergence_evaluate(const float *disparity_px, const float *truth_px,
                                   const uint8_t *mask, int width_px, int height_px,
                                   struct vergence_evaluation *evaluation,
                                   struct vergence_error *error);
/* Truth in a file (PFM, PNG), and its mask (NULL: none; *mask is then NULL). `scale` > 0: values
 * for one pixel of disparity. Free both with vergence_free. */
VERGENCE_API int vergence_truth_load(const char *path, const char *mask_path, double scale,
                                     int *width_px, int *height_px, float **truth_px,
                                     uint8_t **mask, struct vergence_error *error);
VERGENCE_API void vergence_free(void *memory);

#ifdef __cplusplus
}
#endif

#endif
