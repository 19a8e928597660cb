// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/calibration.h"

#include <math.h>
#include <string.h>

#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/calibration_grammar.h"
#include "stereo/geometry/calibration_text.h"
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

// Length of a text that ends within `size` bytes; else `size`.
static size_t text_length(const char *text, size_t size) {
    size_t length = 0;
    while (length < size && text[length] != '\0') {
        length++;
    }
    return length;
}

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

bool calibration_id_is_legal(const char *id) {
    const size_t length = text_length(id, CALIBRATION_ID_BYTES);
    if (length == 0 || length == CALIBRATION_ID_BYTES) {
        return false;
    }
    for (size_t i = 0; i < length; i++) {
        const char c = id[i];
        const bool letter = (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
        if (!letter && !is_digit(c) && c != '.' && c != '_' && c != '-') {
            return false;
        }
    }
    return true;
}

// Whether 10 characters have the form YYYY-MM-DD.
static bool has_date_form(const char *date) {
    for (int i = 0; i < 10; i++) {
        if (i == 4 || i == 7 ? date[i] != '-' : !is_digit(date[i])) {
            return false;
        }
    }
    return true;
}

bool calibration_date_is_legal(const char *date, size_t size) {
    const size_t length = text_length(date, size);
    if (length == 0) {
        return true;
    }
    if (length != 10 || !has_date_form(date)) {
        return false;
    }
    const int year =
        (date[0] - '0') * 1000 + (date[1] - '0') * 100 + (date[2] - '0') * 10 + (date[3] - '0');
    const int month = (date[5] - '0') * 10 + (date[6] - '0');
    const int day = (date[8] - '0') * 10 + (date[9] - '0');
    static const int days_of_month[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    if (month < 1 || month > 12) {
        return false;
    }
    const bool leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    return day >= 1 && day <= days_of_month[month - 1] + (leap && month == 2 ? 1 : 0);
}

// Printable ASCII without blanks at the ends, shorter than `bytes`; may be empty.
bool calibration_line_is_legal(const char *note, size_t bytes) {
    const size_t length = text_length(note, bytes);
    if (length == bytes) {
        return false;
    }
    for (size_t i = 0; i < length; i++) {
        if (note[i] < ' ' || note[i] > '~') {
            return false;
        }
    }
    // Editors easily lose blanks at the ends, and then the checksum fails.
    return length == 0 || (note[0] != ' ' && note[length - 1] != ' ');
}

static int validate_texts(const struct calibration *calibration, struct calibration_fault *fault) {
    if (!calibration_id_is_legal(calibration->id)) {
        return refuse(fault, ERROR_SYNTAX, "id",
                      "must be 1 to 47 letters, digits, dots, underlines or hyphens");
    }
    if (!calibration_date_is_legal(calibration->date, sizeof calibration->date)) {
        return refuse(fault, ERROR_SYNTAX, "date", "must be a date YYYY-MM-DD, or unknown");
    }
    if (!calibration_line_is_legal(calibration->note, CALIBRATION_NOTE_BYTES)) {
        return refuse(fault, ERROR_SYNTAX, "note",
                      "must be at most 239 printable ASCII characters without blanks at the ends");
    }
    return ERROR_OK;
}

static bool window_is_legal(const struct calibration_window *window, int max) {
    return window->column_px >= 0 && window->row_px >= 0 && window->skip >= 0 &&
           window->column_px <= max && window->row_px <= max && window->skip <= max;
}

static bool axis_is_legal(const struct calibration_axis *axis,
                          const struct calibration_field *field) {
    const double min = (double)field->min, max = (double)field->max;
    return axis->mean >= min && axis->mean <= max && axis->spread >= 0 && axis->spread <= max;
}

// Validates what is not a number in the field list: names, windows, axes.
static int validate_origin(const struct calibration *calibration, struct calibration_fault *fault) {
    int count;
    const struct calibration_field *fields = calibration_grammar_fields(&count);
    struct calibration copy = *calibration;  // the accessor of the grammar also serves writers
    for (int i = 0; i < count; i++) {
        const struct calibration_field *field = &fields[i];
        if (field->kind == CALIBRATION_FIELD_NAME &&
            !calibration_line_is_legal(calibration_grammar_name(field, &copy),
                                       CALIBRATION_NAME_BYTES)) {
            return refuse(fault, ERROR_SYNTAX, field->name,
                          "must be at most 63 printable ASCII characters without blanks at the "
                          "ends");
        }
        if (field->kind == CALIBRATION_FIELD_WINDOW) {
            if (!window_is_legal(calibration_grammar_window(field, &copy), (int)field->max)) {
                return refuse(fault, ERROR_RANGE, field->name, "");
            }
        }
        if (field->kind == CALIBRATION_FIELD_AXIS &&
            !axis_is_legal(calibration_grammar_axis(field, &copy), field)) {
            return refuse(fault, ERROR_RANGE, field->name, "");
        }
    }
    return ERROR_OK;
}

static int validate_ranges(const struct calibration *calibration, struct calibration_fault *fault) {
    int count;
    const struct calibration_field *fields = calibration_grammar_fields(&count);
    for (int i = 0; i < count; i++) {
        const struct calibration_field *field = &fields[i];
        if (field->kind != CALIBRATION_FIELD_INTEGERS &&
            field->kind != CALIBRATION_FIELD_DECIMALS) {
            continue;
        }
        for (int j = 0; j < field->count; j++) {
            const double value = calibration_grammar_value(field, j, calibration);
            // Written so that a NaN fails too.
            if (!(value >= (double)field->min && value <= (double)field->max)) {
                return refuse(fault, ERROR_RANGE, field->name, "");
            }
        }
    }
    return validate_origin(calibration, fault);
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
    int code = validate_texts(calibration, fault);
    if (code == ERROR_OK) {
        code = validate_ranges(calibration, fault);
    }
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

static double rounded(const struct calibration_field *field, double value) {
    int64_t scaled;
    const int fits = decimal_from_double(value, field->decimals, &scaled);
    INVARIANT(fits == ERROR_OK);
    return decimal_to_double(scaled, field->decimals);
}

int calibration_round(struct calibration *calibration) {
    const int code = validate_ranges(calibration, NULL);
    if (code != ERROR_OK) {
        return code;
    }
    int count;
    const struct calibration_field *fields = calibration_grammar_fields(&count);
    for (int i = 0; i < count; i++) {
        const struct calibration_field *field = &fields[i];
        for (int j = 0; field->kind == CALIBRATION_FIELD_DECIMALS && j < field->count; j++) {
            const double value = calibration_grammar_value(field, j, calibration);
            calibration_grammar_set(field, j, rounded(field, value), calibration);
        }
        if (field->kind == CALIBRATION_FIELD_AXIS) {
            struct calibration_axis *axis = calibration_grammar_axis(field, calibration);
            axis->mean = rounded(field, axis->mean);
            axis->spread = rounded(field, axis->spread);
        }
    }
    return ERROR_OK;
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
