// SPDX-License-Identifier: Apache-2.0
/// The grammar of the zoom calibration's text as data: one entry per line. The text begins with
/// ZOOM_GRAMMAR_FIRST_LINE; then come the fields of the rig, those of the left and of the right
/// camera, and those of the end; then `parameters N` and, for each parameter, a line `sigma` with
/// its standard deviation and its correlations with the parameters before it; then the checksum.
#ifndef VERGENCE_STEREO_ZOOM_ZOOM_GRAMMAR_H
#define VERGENCE_STEREO_ZOOM_ZOOM_GRAMMAR_H

#include <stddef.h>
#include <stdint.h>

#include "stereo/zoom/zoom_calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

#define ZOOM_GRAMMAR_MAGIC "vergence-zoom-calibration "
#define ZOOM_GRAMMAR_FIRST_LINE ZOOM_GRAMMAR_MAGIC "2"
#define ZOOM_GRAMMAR_PARAMETERS "parameters"
#define ZOOM_GRAMMAR_SIGMA "sigma"

enum {
    ZOOM_GRAMMAR_VERSION = 2,  // version 1 has other names for the focus; it is read, never written
    ZOOM_SIGMA_DECIMALS = 12,
    ZOOM_CORRELATION_DECIMALS = 12,
    ZOOM_SIGMA_MAX = 1000,
};

enum zoom_field_part { ZOOM_FIELD_RIG, ZOOM_FIELD_CAMERA, ZOOM_FIELD_END };

enum zoom_field_kind {
    ZOOM_FIELD_ID,
    ZOOM_FIELD_DATE,
    ZOOM_FIELD_NOTE,
    ZOOM_FIELD_NAME,
    ZOOM_FIELD_INTEGERS,
    ZOOM_FIELD_DECIMALS,
    ZOOM_FIELD_FUNCTION,  // irregularity, then 0 to ZOOM_TERMS_MAX terms
};

struct zoom_field {
    const char *name[2];  // of a camera: left, right; else the first
    enum zoom_field_part part;
    enum zoom_field_kind kind;
    int count;         // number of values, which lie next to each other
    int decimals;      // exact number of digits after the point
    int64_t min, max;  // legal range of each value, in whole units, both ends included
    const char *unit;  // "" if it has none
    const char *meaning;
    size_t offset;  // in struct zoom_calibration, of a camera: in struct zoom_camera
};

/// All fields in the order of the text; static storage.
const struct zoom_field *zoom_grammar_fields(int *count);

/// Name of a field in a text of a version, 1 to ZOOM_GRAMMAR_VERSION; static storage.
const char *zoom_grammar_name(const struct zoom_field *field, int side, int version);

/// Address of a field's first value; `side` is 0 except for cameras.
void *zoom_grammar_address(const struct zoom_field *field, int side,
                           struct zoom_calibration *calibration);

#ifdef __cplusplus
}
#endif

#endif
