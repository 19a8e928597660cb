// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <string.h>

#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"
#include "stereo/geometry/calibration_grammar.h"
#include "stereo/geometry/calibration_text.h"
#include "stereo/geometry/geometry.h"
#include "stereo/zoom/zoom_calibration.h"
#include "stereo/zoom/zoom_grammar.h"

// Calls `each` for every field in the order of the text, until it returns an error.
typedef int each_field(const struct zoom_field *field, int side,
                       struct zoom_calibration *calibration, void *context);

static int visit(struct zoom_calibration *calibration, each_field *each, void *context) {
    int count, code = ERROR_OK;
    const struct zoom_field *fields = zoom_grammar_fields(&count);
    int first_camera = 0, end = 0;
    while (fields[first_camera].part == ZOOM_FIELD_RIG) {
        first_camera++;
    }
    for (end = first_camera; fields[end].part == ZOOM_FIELD_CAMERA;) {
        end++;
    }
    INVARIANT(first_camera > 0 && end > first_camera && end < count);
    for (int i = 0; i < first_camera && code == ERROR_OK; i++) {
        code = each(&fields[i], 0, calibration, context);
    }
    for (int side = 0; side < 2; side++) {
        for (int i = first_camera; i < end && code == ERROR_OK; i++) {
            code = each(&fields[i], side, calibration, context);
        }
    }
    for (int i = end; i < count && code == ERROR_OK; i++) {
        code = each(&fields[i], 0, calibration, context);
    }
    return code;
}

// The line's values after its name.
static int open_line(struct calibration_reader *reader, const char *expected,
                     struct calibration_span *rest, bool *more) {
    const int code = calibration_next_line(reader, rest);
    if (code != ERROR_OK) {
        reader->fault.field = expected;
        return code;
    }
    const struct calibration_span name = calibration_cut_word(rest, more);
    return calibration_span_is(name, expected)
               ? ERROR_OK
               : calibration_refuse(reader, ERROR_MISSING, expected,
                                    "the field is missing here, or out of order");
}

static int parse_number(struct calibration_reader *reader, const char *name,
                        struct calibration_span *rest, bool *more, int decimals, int64_t min,
                        int64_t max, double *value) {
    INVARIANT(min < max);
    if (!*more) {
        return calibration_refuse(reader, ERROR_SYNTAX, name, "too few values");
    }
    return calibration_parse_decimal(reader, name, calibration_cut_word(rest, more), decimals, min,
                                     max, value);
}

static int parse_function(struct calibration_reader *reader, const struct zoom_field *field,
                          const char *name, struct calibration_span rest, bool more,
                          struct zoom_function *function) {
    int code = parse_number(reader, name, &rest, &more, field->decimals, 0, field->max,
                            &function->irregularity);
    for (function->terms = 0; code == ERROR_OK && more; function->terms++) {
        if (function->terms == ZOOM_TERMS_MAX) {
            return calibration_refuse(reader, ERROR_SYNTAX, name, "too many terms");
        }
        code = parse_number(reader, name, &rest, &more, field->decimals, field->min, field->max,
                            &function->term[function->terms]);
    }
    return code;
}

static int parse_numbers(struct calibration_reader *reader, const struct zoom_field *field,
                         const char *name, struct calibration_span rest, bool more, void *address) {
    INVARIANT(field->count > 0);
    for (int i = 0; i < field->count; i++) {
        double value;
        const int code = parse_number(reader, name, &rest, &more, field->decimals, field->min,
                                      field->max, &value);
        if (code != ERROR_OK) {
            return code;
        }
        if (field->kind == ZOOM_FIELD_INTEGERS) {
            ((int *)address)[i] = (int)value;
        } else {
            ((double *)address)[i] = value;
        }
    }
    return more ? calibration_refuse(reader, ERROR_SYNTAX, name, "too many values") : ERROR_OK;
}

static size_t text_bytes(enum zoom_field_kind kind) {
    switch (kind) {
        case ZOOM_FIELD_ID:
            return CALIBRATION_ID_BYTES;
        case ZOOM_FIELD_DATE:
            return sizeof((struct zoom_calibration *)0)->date;
        case ZOOM_FIELD_NOTE:
            return CALIBRATION_NOTE_BYTES;
        default:
            return CALIBRATION_NAME_BYTES;
    }
}

struct parsing {
    struct calibration_reader reader;
    int version;
};

static int parse_field(const struct zoom_field *field, int side,
                       struct zoom_calibration *calibration, void *context) {
    struct parsing *parsing = context;
    struct calibration_reader *reader = &parsing->reader;
    const char *name = zoom_grammar_name(field, side, parsing->version);
    struct calibration_span rest;
    bool more;
    const int code = open_line(reader, name, &rest, &more);
    if (code != ERROR_OK) {
        return code;
    }
    void *address = zoom_grammar_address(field, side, calibration);
    if (field->kind == ZOOM_FIELD_FUNCTION) {
        return parse_function(reader, field, name, rest, more, address);
    }
    if (field->kind == ZOOM_FIELD_INTEGERS || field->kind == ZOOM_FIELD_DECIMALS) {
        return parse_numbers(reader, field, name, rest, more, address);
    }
    if (more ? rest.length == 0 : field->kind != ZOOM_FIELD_NOTE) {
        return calibration_refuse(reader, ERROR_SYNTAX, name, "the value is missing");
    }
    const bool unknown = field->kind != ZOOM_FIELD_NOTE && field->kind != ZOOM_FIELD_ID &&
                         calibration_span_is(rest, CALIBRATION_GRAMMAR_UNKNOWN);
    return calibration_copy_text(reader, name, unknown ? (struct calibration_span){"", 0} : rest,
                                 address, text_bytes(field->kind));
}

static int parse_parameters(struct calibration_reader *reader, int *parameters) {
    struct calibration_span rest;
    bool more;
    double value;
    int code = open_line(reader, ZOOM_GRAMMAR_PARAMETERS, &rest, &more);
    if (code == ERROR_OK) {
        code = parse_number(reader, ZOOM_GRAMMAR_PARAMETERS, &rest, &more, 0, 0,
                            ZOOM_PARAMETERS_MAX, &value);
    }
    if (code == ERROR_OK) {
        *parameters = (int)value;
    }
    return code == ERROR_OK && more ? calibration_refuse(reader, ERROR_SYNTAX,
                                                         ZOOM_GRAMMAR_PARAMETERS, "too many values")
                                    : code;
}

// Row i of the covariance: its standard deviation, then its correlations.
static int parse_sigma(struct calibration_reader *reader, int i, double sigma[ZOOM_PARAMETERS_MAX],
                       double *row) {
    struct calibration_span rest;
    bool more;
    int code = open_line(reader, ZOOM_GRAMMAR_SIGMA, &rest, &more);
    if (code == ERROR_OK) {
        code = parse_number(reader, ZOOM_GRAMMAR_SIGMA, &rest, &more, ZOOM_SIGMA_DECIMALS, 0,
                            ZOOM_SIGMA_MAX, &sigma[i]);
    }
    for (int j = 0; j < i && code == ERROR_OK; j++) {
        double correlation = 0;
        code = parse_number(reader, ZOOM_GRAMMAR_SIGMA, &rest, &more, ZOOM_CORRELATION_DECIMALS, -1,
                            1, &correlation);
        row[j] = correlation * sigma[i] * sigma[j];
        if (code == ERROR_OK && correlation != 0 && sigma[i] * sigma[j] == 0) {
            code = calibration_refuse(reader, ERROR_RANGE, ZOOM_GRAMMAR_SIGMA,
                                      "a correlation with a parameter that is exact");
        }
    }
    if (code != ERROR_OK) {
        return code;
    }
    INVARIANT(sigma[i] >= 0 && sigma[i] <= ZOOM_SIGMA_MAX);
    row[i] = sigma[i] * sigma[i];
    return more ? calibration_refuse(reader, ERROR_SYNTAX, ZOOM_GRAMMAR_SIGMA, "too many values")
                : ERROR_OK;
}

static int parse_covariance(struct calibration_reader *reader,
                            struct zoom_calibration *calibration) {
    double sigma[ZOOM_PARAMETERS_MAX], *parameter[ZOOM_PARAMETERS_MAX];
    int code = parse_parameters(reader, &calibration->parameters);
    if (code == ERROR_OK && calibration->parameters != 0 &&
        calibration->parameters != zoom_parameter_list(calibration->camera, parameter)) {
        return calibration_refuse(reader, ERROR_RANGE, ZOOM_GRAMMAR_PARAMETERS,
                                  "must be the number of terms and mounts above, or 0");
    }
    for (int i = 0; i < calibration->parameters && code == ERROR_OK; i++) {
        code = parse_sigma(reader, i, sigma, &calibration->covariance[i * (i + 1) / 2]);
    }
    return code;
}

bool zoom_calibration_is_text(const char *text, size_t length) {
    static const size_t magic_length = sizeof ZOOM_GRAMMAR_MAGIC - 1;
    return length >= magic_length && memcmp(text, ZOOM_GRAMMAR_MAGIC, magic_length) == 0;
}

// Returns the version, or a negative code.
static int parse_first_line(struct calibration_reader *reader) {
    static const size_t magic_length = sizeof ZOOM_GRAMMAR_MAGIC - 1;
    if (!zoom_calibration_is_text(reader->text, reader->length)) {
        reader->line = 1;
        return calibration_refuse(reader, ERROR_SYNTAX, "",
                                  "the first line must be " ZOOM_GRAMMAR_FIRST_LINE);
    }
    struct calibration_span line;
    const int code = calibration_next_line(reader, &line);
    if (code != ERROR_OK) {
        return code;
    }
    const int version = line.length == magic_length + 1 ? line.text[magic_length] - '0' : 0;
    return version >= 1 && version <= ZOOM_GRAMMAR_VERSION
               ? version
               : calibration_refuse(reader, ERROR_VERSION, "", "unknown version (expected 1 or 2)");
}

int zoom_calibration_parse(const char *text, size_t length, struct zoom_calibration *result,
                           struct calibration_fault *fault) {
    struct parsing parsing = {
        .reader = {.text = text, .length = length, .fault = {.field = "", .reason = ""}}};
    struct calibration_reader *reader = &parsing.reader;
    memset(result, 0, sizeof *result);
    parsing.version = parse_first_line(reader);
    int code = parsing.version < 0 ? parsing.version : visit(result, parse_field, &parsing);
    if (code == ERROR_OK) {
        code = parse_covariance(reader, result);
    }
    if (code == ERROR_OK) {
        struct calibration_span name;
        code = calibration_parse_crc(reader, &name);
    }
    if (code == ERROR_OK) {
        code = zoom_calibration_validate(result, &reader->fault);
    }
    if (code != ERROR_OK && fault != NULL) {
        *fault = reader->fault;
    }
    return code;
}

static int print_field(const struct zoom_field *field, int side,
                       struct zoom_calibration *calibration, void *context) {
    struct calibration_writer *writer = context;
    INVARIANT(field->count > 0 && field->decimals >= 0);
    const void *address = zoom_grammar_address(field, side, calibration);
    calibration_put(writer, field->name[side]);
    switch (field->kind) {
        case ZOOM_FIELD_ID:
            calibration_put_value(writer, address);
            break;
        case ZOOM_FIELD_NOTE:
            if (((const char *)address)[0] != '\0') {
                calibration_put_value(writer, address);
            }
            break;
        case ZOOM_FIELD_DATE:
        case ZOOM_FIELD_NAME:
            calibration_put_known(writer, address);
            break;
        case ZOOM_FIELD_INTEGERS:
            for (int i = 0; i < field->count; i++) {
                calibration_put_number(writer, 0, ((const int *)address)[i]);
            }
            break;
        case ZOOM_FIELD_DECIMALS:
            for (int i = 0; i < field->count; i++) {
                calibration_put_number(writer, field->decimals, ((const double *)address)[i]);
            }
            break;
        case ZOOM_FIELD_FUNCTION: {
            const struct zoom_function *function = address;
            calibration_put_number(writer, field->decimals, function->irregularity);
            for (int i = 0; i < function->terms; i++) {
                calibration_put_number(writer, field->decimals, function->term[i]);
            }
            break;
        }
    }
    calibration_put(writer, "\n");
    return ERROR_OK;
}

// The standard deviation as the text states it.
static double stated_sigma(double variance) {
    int64_t scaled;
    const int fits = decimal_from_double(sqrt(variance), ZOOM_SIGMA_DECIMALS, &scaled);
    INVARIANT(fits == ERROR_OK);
    return decimal_to_double(scaled, ZOOM_SIGMA_DECIMALS);
}

static double correlation(const double *covariance, int i, int j) {
    const double value = covariance[i * (i + 1) / 2 + j] /
                         sqrt(covariance[i * (i + 1) / 2 + i] * covariance[j * (j + 1) / 2 + j]);
    INVARIANT(fabs(value) < 1.001);  // was validated
    return value > 1 ? 1 : value < -1 ? -1 : value;
}

static void print_sigmas(struct calibration_writer *writer,
                         const struct zoom_calibration *calibration) {
    INVARIANT(calibration->parameters >= 0 && calibration->parameters <= ZOOM_PARAMETERS_MAX);
    calibration_put(writer, ZOOM_GRAMMAR_PARAMETERS);
    calibration_put_number(writer, 0, calibration->parameters);
    calibration_put(writer, "\n");
    double sigma[ZOOM_PARAMETERS_MAX];
    for (int i = 0; i < calibration->parameters; i++) {
        const double *row = &calibration->covariance[i * (i + 1) / 2];
        sigma[i] = stated_sigma(row[i]);
        calibration_put(writer, ZOOM_GRAMMAR_SIGMA);
        calibration_put_number(writer, ZOOM_SIGMA_DECIMALS, sigma[i]);
        for (int j = 0; j < i; j++) {
            calibration_put_number(
                writer, ZOOM_CORRELATION_DECIMALS,
                sigma[i] * sigma[j] > 0 ? correlation(calibration->covariance, i, j) : 0);
        }
        calibration_put(writer, "\n");
    }
}

int zoom_calibration_print(const struct zoom_calibration *calibration, char *text,
                           size_t size_bytes) {
    int code = zoom_calibration_validate(calibration, NULL);
    if (code != ERROR_OK) {
        return code;
    }
    struct calibration_writer writer = {text, size_bytes, 0};
    calibration_put(&writer, ZOOM_GRAMMAR_FIRST_LINE "\n");
    // The addresses of the grammar serve readers, too; nothing is changed.
    visit((struct zoom_calibration *)(uintptr_t)calibration, print_field, &writer);
    print_sigmas(&writer, calibration);
    INVARIANT(writer.length < ZOOM_TEXT_MAX_BYTES);
    return calibration_put_crc(&writer);
}

static int set_fault(struct calibration_fault *fault, int code, const char *field,
                     const char *reason) {
    if (fault != NULL) {
        *fault = (struct calibration_fault){.field = field, .reason = reason};
    }
    return code;
}

// Written so that a NaN fails too.
static bool fits(double value, int64_t min, int64_t max) {
    return value >= (double)min && value <= (double)max;
}

static bool numbers_fit(const struct zoom_field *field, const void *address) {
    bool fit = true;
    if (field->kind == ZOOM_FIELD_FUNCTION) {
        const struct zoom_function *function = address;
        fit = function->terms >= 0 && function->terms <= ZOOM_TERMS_MAX &&
              fits(function->irregularity, 0, field->max);
        for (int i = 0; fit && i < function->terms; i++) {
            fit = fits(function->term[i], field->min, field->max);
        }
        return fit;
    }
    for (int i = 0; i < field->count; i++) {
        const double value = field->kind == ZOOM_FIELD_INTEGERS ? ((const int *)address)[i]
                                                                : ((const double *)address)[i];
        fit = fit && fits(value, field->min, field->max);
    }
    return fit;
}

static int check_field(const struct zoom_field *field, int side,
                       struct zoom_calibration *calibration, void *context) {
    struct calibration_fault *fault = context;
    const void *address = zoom_grammar_address(field, side, calibration);
    const char *name = field->name[side];
    switch (field->kind) {
        case ZOOM_FIELD_ID:
            return calibration_id_is_legal(address)
                       ? ERROR_OK
                       : set_fault(fault, ERROR_SYNTAX, name,
                                   "must be 1 to 47 letters, digits, dots, underlines or hyphens");
        case ZOOM_FIELD_DATE:
            return calibration_date_is_legal(address, text_bytes(field->kind))
                       ? ERROR_OK
                       : set_fault(fault, ERROR_SYNTAX, name,
                                   "must be a date YYYY-MM-DD, or unknown");
        case ZOOM_FIELD_NOTE:
        case ZOOM_FIELD_NAME:
            return calibration_line_is_legal(address, text_bytes(field->kind))
                       ? ERROR_OK
                       : set_fault(fault, ERROR_SYNTAX, name,
                                   "must be printable ASCII characters without blanks at the ends");
        default:
            return numbers_fit(field, address) ? ERROR_OK : set_fault(fault, ERROR_RANGE, name, "");
    }
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
    int code = visit((struct zoom_calibration *)(uintptr_t)calibration, check_field, fault);
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
