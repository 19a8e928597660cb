// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/calibration.h"

#include <math.h>
#include <string.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/calibration_grammar.h"
#include "stereo/geometry/geometry.h"

static const double baseline_min_mm = 1e-3;
static const double baseline_max_mm = 1e5;           // limit of triangulation's fixed point
static const double angle_max_rad = MATH_PI + 1e-9;  // pi, as rounded to the text's decimals

static int refuse(struct calibration_fault *fault, int code, const char *field,
                  const char *reason) {
    INVARIANT(code < 0 && field != NULL && reason != NULL);
    if (fault != NULL) {
        *fault = (struct calibration_fault){.field = field, .reason = reason};
    }
    return code;
}

static int validate_pose(const struct calibration *calibration, struct calibration_fault *fault) {
    if (geometry_norm(calibration->rotation_right_left_rad) > angle_max_rad) {
        return refuse(fault, ERROR_ROTATION, "rotation_right_left_rad",
                      "the angle must not be larger than pi");
    }
    const double baseline_mm = calibration_baseline_mm(calibration);
    if (baseline_mm < baseline_min_mm) {
        return refuse(fault, ERROR_BASELINE, "translation_right_left_mm", "");
    }
    if (baseline_mm > baseline_max_mm) {
        return refuse(fault, ERROR_RANGE, "translation_right_left_mm",
                      "the baseline must not be longer than 100 m");
    }
    const double near_mm = calibration->depth_near_mm, far_mm = calibration->depth_far_mm;
    if (!(near_mm == 0 && far_mm == 0) && !(near_mm > 0 && far_mm > near_mm)) {
        return refuse(fault, ERROR_DEPTH_RANGE, "depth_range_mm",
                      "must be 0 < nearest < farthest, or 0 0");
    }
    return ERROR_OK;
}

// Whether two ideal cameras have the same rows and the same scale.
static bool rows_agree(const struct lens *left, const struct lens *right) {
    return left->width_px == right->width_px && left->height_px == right->height_px &&
           left->fx_px == right->fx_px && left->fy_px == right->fy_px &&
           left->cy_px == right->cy_px;
}

static int validate_rectified(const struct calibration *calibration,
                              struct calibration_fault *fault) {
    const struct lens *left = &calibration->left, *right = &calibration->right;
    if (!lens_is_ideal(left) || !lens_is_ideal(right)) {
        return refuse(fault, ERROR_RANGE, "rectified",
                      "a rectified pair has no distortion: all coefficients must be 0");
    }
    if (!rows_agree(left, right)) {
        return refuse(fault, ERROR_RANGE, "rectified",
                      "the cameras of a rectified pair must agree in size, fx, fy and cy");
    }
    const double *r_rad = calibration->rotation_right_left_rad;
    const double *t_mm = calibration->translation_right_left_mm;
    if (r_rad[0] != 0 || r_rad[1] != 0 || r_rad[2] != 0 || t_mm[1] != 0 || t_mm[2] != 0 ||
        t_mm[0] > 0) {
        return refuse(fault, ERROR_RANGE, "rectified",
                      "a rectified pair has rotation 0 0 0 and translation -BASELINE 0 0");
    }
    return ERROR_OK;
}

int calibration_validate(const struct calibration *calibration, struct calibration_fault *fault) {
    int code = keyed_text_check(&calibration_grammar, calibration, fault);
    if (code == ERROR_OK) {
        code = validate_pose(calibration, fault);
    }
    if (code != ERROR_OK) {
        return code;
    }
    code = lens_validate(&calibration->left);
    if (code != ERROR_OK) {
        return refuse(fault, code, "left", "");
    }
    code = lens_validate(&calibration->right);
    if (code != ERROR_OK) {
        return refuse(fault, code, "right", "");
    }
    return calibration->rectified ? validate_rectified(calibration, fault) : ERROR_OK;
}

int calibration_round(struct calibration *calibration) {
    const int code = keyed_text_check(&calibration_grammar, calibration, NULL);
    if (code != ERROR_OK) {
        return code;
    }
    keyed_text_round(&calibration_grammar, calibration);
    for (int i = 0; i < 2 * CALIBRATION_AXES; i++) {
        struct calibration_axis *axis =
            &calibration->origin.side[i / CALIBRATION_AXES].axis[i % CALIBRATION_AXES];
        axis->mean = keyed_text_rounded(axis->mean, CALIBRATION_AXIS_DECIMALS);
        axis->spread = keyed_text_rounded(axis->spread, CALIBRATION_AXIS_DECIMALS);
    }
    return ERROR_OK;
}

// The version of a calibration's text: the first one that has all that it says.
static int version_of(const struct calibration *calibration) {
    INVARIANT(calibration->left.kind < LENS_KINDS && calibration->right.kind < LENS_KINDS);
    if (calibration->left.kind != LENS_BROWN_CONRADY ||
        calibration->right.kind != LENS_BROWN_CONRADY) {
        return 4;
    }
    if (!calibration->has_origin) {
        return 1;
    }
    return calibration->axes_in_sigma ? 3 : 2;
}

static int parse_all(struct keyed_reader *reader, struct calibration *result) {
    const int version = keyed_text_parse(&calibration_grammar, reader, result);
    int code = version < 0 ? version : keyed_text_parse_end(&calibration_grammar, reader);
    if (code != ERROR_OK) {
        return code;
    }
    result->has_origin = version >= 2;
    if (version_of(result) != version) {
        reader->line = 1;
        return keyed_refuse(reader, ERROR_VERSION, "",
                            "an earlier version of the text has all of this");
    }
    code = calibration_validate(result, &reader->fault);
    if (code != ERROR_OK) {
        reader->fault.line = keyed_text_line(&calibration_grammar, reader->fault.field);
    }
    return code;
}

int calibration_parse(const char *text, size_t length, struct calibration *result,
                      struct calibration_fault *fault) {
    struct keyed_reader reader = {
        .text = text, .length = length, .fault = {.field = "", .reason = ""}};
    struct calibration parsed;
    memset(&parsed, 0, sizeof parsed);
    const int code = parse_all(&reader, &parsed);
    if (code == ERROR_OK) {
        *result = parsed;
    } else if (fault != NULL) {
        *fault = reader.fault;
    }
    return code;
}

int calibration_print(const struct calibration *calibration, char *text, size_t size_bytes) {
    struct calibration rounded = *calibration;
    int code = calibration_round(&rounded);
    if (code == ERROR_OK) {
        code = calibration_validate(&rounded, NULL);
    }
    if (code != ERROR_OK) {
        return code;
    }
    struct keyed_writer writer = {text, size_bytes, 0};
    keyed_text_print(&calibration_grammar, version_of(&rounded), &rounded, &writer);
    INVARIANT(writer.length < CALIBRATION_TEXT_MAX_BYTES);
    return keyed_put_crc(&writer);
}

uint32_t calibration_crc(const struct calibration *calibration) {
    char text[CALIBRATION_TEXT_MAX_BYTES];
    const int length = calibration_print(calibration, text, sizeof text);
    static const size_t crc_line_bytes = sizeof KEYED_LINE_CRC " 01234567\n" - 1;
    INVARIANT(length > (int)crc_line_bytes);
    return crc_update(0, text, (size_t)length - crc_line_bytes);
}

double calibration_depth_sigma_mm(const struct calibration *calibration, double depth_mm) {
    INVARIANT(depth_mm >= 0);
    const double by_scale_mm = calibration->scale_sigma * depth_mm;
    const double by_yaw_mm =
        calibration->yaw_sigma_rad * depth_mm * depth_mm / calibration_baseline_mm(calibration);
    return sqrt(by_scale_mm * by_scale_mm + by_yaw_mm * by_yaw_mm);
}

double calibration_baseline_mm(const struct calibration *calibration) {
    return geometry_norm(calibration->translation_right_left_mm);
}

double calibration_vergence_depth_mm(const struct calibration *calibration) {
    double R_right_left[9];
    geometry_rotation_from_vector(calibration->rotation_right_left_rad, R_right_left);
    // Both axes in the left frame: p_left = R^T (p_right - t).
    static const double origin_left_mm[3] = {0, 0, 0};
    static const double axis[3] = {0, 0, 1};
    double t_back_mm[3], axis_right[3];
    geometry_rotate_back(R_right_left, calibration->translation_right_left_mm, t_back_mm);
    geometry_rotate_back(R_right_left, axis, axis_right);
    const double origin_right_mm[3] = {-t_back_mm[0], -t_back_mm[1], -t_back_mm[2]};
    struct geometry_midpoint midpoint;
    if (!geometry_rays_midpoint(origin_left_mm, axis, origin_right_mm, axis_right, &midpoint) ||
        midpoint.s <= 0 || midpoint.t <= 0) {
        return -1;
    }
    return midpoint.s;
}
