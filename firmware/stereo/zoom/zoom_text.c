// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/geometry.h"
#include "stereo/zoom/zoom_calibration.h"
#include "stereo/zoom/zoom_grammar.h"

static int open_line(struct keyed_reader *reader, const char *name, struct keyed_span *values,
                     bool *more) {
    return keyed_text_open_line(&zoom_grammar, reader, name, values, more);
}

static int parse_parameters(struct keyed_reader *reader, int *parameters) {
    struct keyed_span rest;
    bool more;
    double value;
    int code = open_line(reader, ZOOM_GRAMMAR_PARAMETERS, &rest, &more);
    if (code == ERROR_OK) {
        code = keyed_parse_number(reader, ZOOM_GRAMMAR_PARAMETERS, &rest, &more, 0, 0,
                                  ZOOM_PARAMETERS_MAX, &value);
    }
    if (code == ERROR_OK) {
        *parameters = (int)value;
    }
    return code == ERROR_OK && more
               ? keyed_refuse(reader, ERROR_SYNTAX, ZOOM_GRAMMAR_PARAMETERS, "too many values")
               : code;
}

// Row i of the covariance: its standard deviation, then its correlations.
static int parse_sigma(struct keyed_reader *reader, int i, double sigma[ZOOM_PARAMETERS_MAX],
                       double *row) {
    struct keyed_span rest;
    bool more;
    int code = open_line(reader, ZOOM_GRAMMAR_SIGMA, &rest, &more);
    if (code == ERROR_OK) {
        code = keyed_parse_number(reader, ZOOM_GRAMMAR_SIGMA, &rest, &more, ZOOM_SIGMA_DECIMALS, 0,
                                  ZOOM_SIGMA_MAX, &sigma[i]);
    }
    for (int j = 0; j < i && code == ERROR_OK; j++) {
        double correlation = 0;
        code = keyed_parse_number(reader, ZOOM_GRAMMAR_SIGMA, &rest, &more,
                                  ZOOM_CORRELATION_DECIMALS, -1, 1, &correlation);
        row[j] = correlation * sigma[i] * sigma[j];
        if (code == ERROR_OK && correlation != 0 && sigma[i] * sigma[j] == 0) {
            code = keyed_refuse(reader, ERROR_RANGE, ZOOM_GRAMMAR_SIGMA,
                                "a correlation with a parameter that is exact");
        }
    }
    if (code != ERROR_OK) {
        return code;
    }
    INVARIANT(sigma[i] >= 0 && sigma[i] <= ZOOM_SIGMA_MAX);
    row[i] = sigma[i] * sigma[i];
    return more ? keyed_refuse(reader, ERROR_SYNTAX, ZOOM_GRAMMAR_SIGMA, "too many values")
                : ERROR_OK;
}

static int parse_covariance(struct keyed_reader *reader, const struct watch *watch,
                            struct zoom_calibration *calibration) {
    double sigma[ZOOM_PARAMETERS_MAX], *parameter[ZOOM_PARAMETERS_MAX];
    int code = parse_parameters(reader, &calibration->parameters);
    if (code == ERROR_OK && calibration->parameters != 0 &&
        calibration->parameters != zoom_parameter_list(calibration->camera, parameter)) {
        return keyed_refuse(reader, ERROR_RANGE, ZOOM_GRAMMAR_PARAMETERS,
                            "must be the number of terms and mounts above, or 0");
    }
    for (int i = 0; i < calibration->parameters && code == ERROR_OK; i++) {
        watch_serve(watch);
        code = parse_sigma(reader, i, sigma, &calibration->covariance[i * (i + 1) / 2]);
    }
    return code;
}

bool zoom_calibration_is_text(const char *text, size_t length) {
    return keyed_text_is(&zoom_grammar, text, length);
}

int zoom_calibration_parse(const char *text, size_t length, const struct watch *watch,
                           struct zoom_calibration *result, struct calibration_fault *fault) {
    struct keyed_reader reader = {
        .text = text, .length = length, .fault = {.field = "", .reason = ""}};
    memset(result, 0, sizeof *result);
    const int version = keyed_text_parse(&zoom_grammar, &reader, result);
    int code = version < 0 ? version : parse_covariance(&reader, watch, result);
    if (code == ERROR_OK) {
        code = keyed_text_parse_end(&zoom_grammar, &reader);
    }
    if (code == ERROR_OK) {
        code = zoom_calibration_validate(result, &reader.fault);
        if (code != ERROR_OK) {
            reader.fault.line = keyed_text_line(&zoom_grammar, reader.fault.field);
        }
    }
    if (code != ERROR_OK && fault != NULL) {
        *fault = reader.fault;
    }
    return code;
}

// The standard deviation as the text states it.
static double stated_sigma(double variance) {
    return keyed_text_rounded(sqrt(variance), ZOOM_SIGMA_DECIMALS);
}

static double correlation(const double *covariance, int i, int j) {
    const double value = covariance[i * (i + 1) / 2 + j] /
                         sqrt(covariance[i * (i + 1) / 2 + i] * covariance[j * (j + 1) / 2 + j]);
    INVARIANT(fabs(value) < 1.001);  // was validated
    return math_clamp(value, -1, 1);
}

static void print_sigmas(struct keyed_writer *writer, const struct zoom_calibration *calibration) {
    INVARIANT(calibration->parameters >= 0 && calibration->parameters <= ZOOM_PARAMETERS_MAX);
    keyed_put(writer, ZOOM_GRAMMAR_PARAMETERS);
    keyed_put_number(writer, 0, calibration->parameters);
    keyed_put(writer, "\n");
    double sigma[ZOOM_PARAMETERS_MAX];
    for (int i = 0; i < calibration->parameters; i++) {
        const double *row = &calibration->covariance[i * (i + 1) / 2];
        sigma[i] = stated_sigma(row[i]);
        keyed_put(writer, ZOOM_GRAMMAR_SIGMA);
        keyed_put_number(writer, ZOOM_SIGMA_DECIMALS, sigma[i]);
        for (int j = 0; j < i; j++) {
            keyed_put_number(
                writer, ZOOM_CORRELATION_DECIMALS,
                sigma[i] * sigma[j] > 0 ? correlation(calibration->covariance, i, j) : 0);
        }
        keyed_put(writer, "\n");
    }
}

int zoom_calibration_print(const struct zoom_calibration *calibration, char *text,
                           size_t size_bytes) {
    int code = zoom_calibration_validate(calibration, NULL);
    if (code != ERROR_OK) {
        return code;
    }
    struct keyed_writer writer = {text, size_bytes, 0};
    keyed_text_print(&zoom_grammar, ZOOM_GRAMMAR_VERSION, calibration, &writer);
    print_sigmas(&writer, calibration);
    INVARIANT(writer.length < ZOOM_TEXT_MAX_BYTES);
    return keyed_put_crc(&writer);
}

static int set_fault(struct calibration_fault *fault, int code, const char *field,
                     const char *reason) {
    if (fault != NULL) {
        *fault = (struct calibration_fault){.field = field, .reason = reason};
    }
    return code;
}

static int check_ranges(const struct zoom_camera *camera, int side,
                        struct calibration_fault *fault) {
    static const char *const names[2][5] = {
        {"left_zoom_counts", "left_focus_counts", "left_log_focal_range", "left_pan_rad",
         "left_pixel_mm"},
        {"right_zoom_counts", "right_focus_counts", "right_log_focal_range", "right_pan_rad",
         "right_pixel_mm"}};
    INVARIANT(side == 0 || side == 1);
    const struct zoom_range *ranges[3] = {&camera->zoom, &camera->focus, &camera->log_focal};
    for (int i = 0; i < 3; i++) {
        if (ranges[i]->min >= ranges[i]->max) {
            return set_fault(fault, ERROR_RANGE, names[side][i], "must be smallest, then largest");
        }
    }
    if (camera->pan_rad.min > camera->pan_rad.max) {
        return set_fault(fault, ERROR_RANGE, names[side][3], "must be smallest, then largest");
    }
    return camera->pixel_mm > 0 ? ERROR_OK
                                : set_fault(fault, ERROR_RANGE, names[side][4], "must not be 0");
}

// As short as that of a pair may be.
static int check_baseline(const struct zoom_calibration *calibration,
                          struct calibration_fault *fault) {
    static const double least_mm = 1e-3;
    const double *left_mm = &calibration->camera[0].mount[ZOOM_POSITION_X];
    const double *right_mm = &calibration->camera[1].mount[ZOOM_POSITION_X];
    const double apart_mm[3] = {right_mm[0] - left_mm[0], right_mm[1] - left_mm[1],
                                right_mm[2] - left_mm[2]};
    return geometry_norm(apart_mm) >= least_mm
               ? ERROR_OK
               : set_fault(fault, ERROR_RANGE, "right_position_mm",
                           "both cameras are in the same place: a baseline of 0");
}

// The lens must be legal over its ranges of zoom and focus.
static int check_lenses(const struct zoom_calibration *calibration,
                        struct calibration_fault *fault) {
    for (int i = 0; i < 9; i++) {
        struct zoom_state state;
        memset(&state, 0, sizeof state);
        for (int side = 0; side < 2; side++) {
            const struct zoom_camera *camera = &calibration->camera[side];
            const struct zoom_range *zoom = &camera->zoom, *focus = &camera->focus;
            state.side[side].zoom_counts = zoom->min + (zoom->max - zoom->min) * (i / 8.0);
            state.side[side].focus_counts = i % 2 == 0 ? focus->min : focus->max;
            state.side[side].pan_rad = camera->pan_rad.min;
        }
        struct zoom_pair pair;
        zoom_pair_at(calibration->camera, &state, &pair);
        for (int side = 0; side < 2; side++) {
            const int code = lens_validate(&pair.side[side].lens);
            if (code != ERROR_OK) {
                return set_fault(fault, code, side == 0 ? "left_focal" : "right_focal",
                                 "the lens is not defined over its ranges of zoom and focus");
            }
        }
    }
    return ERROR_OK;
}

// Written so that a NaN fails too.
static bool covariance_is_legal(const double *covariance, int i, int j) {
    INVARIANT(j >= 0 && j <= i && i < ZOOM_PARAMETERS_MAX);
    const double own = covariance[i * (i + 1) / 2 + i], other = covariance[j * (j + 1) / 2 + j];
    const double value = covariance[i * (i + 1) / 2 + j];
    return own >= 0 && own <= (double)ZOOM_SIGMA_MAX * ZOOM_SIGMA_MAX &&
           value * value <= own * other * (1 + 1e-9);
}

static int check_covariance(const struct zoom_calibration *calibration,
                            struct calibration_fault *fault) {
    // The list is of addresses; nothing is changed.
    struct zoom_calibration *listed = (struct zoom_calibration *)(uintptr_t)calibration;
    double *parameter[ZOOM_PARAMETERS_MAX];
    const int count = calibration->parameters;
    if (count != 0 && count != zoom_parameter_list(listed->camera, parameter)) {
        return set_fault(fault, ERROR_RANGE, ZOOM_GRAMMAR_PARAMETERS, "");
    }
    for (int i = 0; i < count; i++) {
        for (int j = 0; j <= i; j++) {
            if (!covariance_is_legal(calibration->covariance, i, j)) {
                return set_fault(fault, ERROR_RANGE, ZOOM_GRAMMAR_SIGMA,
                                 "no correlation may be larger than 1");
            }
        }
    }
    return ERROR_OK;
}

int zoom_calibration_validate(const struct zoom_calibration *calibration,
                              struct calibration_fault *fault) {
    int code = keyed_text_check(&zoom_grammar, calibration, fault);
    for (int side = 0; side < 2 && code == ERROR_OK; side++) {
        code = check_ranges(&calibration->camera[side], side, fault);
    }
    if (code == ERROR_OK) {
        code = check_baseline(calibration, fault);
    }
    if (code == ERROR_OK) {
        code = check_covariance(calibration, fault);
    }
    return code == ERROR_OK ? check_lenses(calibration, fault) : code;
}
