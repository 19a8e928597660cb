// SPDX-License-Identifier: Apache-2.0
/// The grammar of the zoom calibration's text as data: see stereo/geometry/keyed_text.h. Its fields
/// are those of the rig, of the left and of the right camera, and of the validation; then come
/// `parameters N` and, for each parameter, a line `sigma` with its standard deviation and its
/// correlations with the parameters before it; then the checksum.
#ifndef VERGENCE_STEREO_ZOOM_ZOOM_GRAMMAR_H
#define VERGENCE_STEREO_ZOOM_ZOOM_GRAMMAR_H

#include "stereo/geometry/keyed_text.h"
#include "stereo/zoom/zoom_calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

#define ZOOM_GRAMMAR_MAGIC "vergence-zoom-calibration "
#define ZOOM_GRAMMAR_PARAMETERS "parameters"
#define ZOOM_GRAMMAR_SIGMA "sigma"

enum {
    ZOOM_GRAMMAR_VERSION = 2,  // version 1 has other names for the focus; it is read, never written
    ZOOM_SIGMA_DECIMALS = 12,
    ZOOM_CORRELATION_DECIMALS = 12,
    ZOOM_SIGMA_MAX = 1000,
};

enum zoom_field_kind {
    ZOOM_FIELD_FUNCTION = KEYED_OTHER,  // irregularity, then 0 to ZOOM_TERMS_MAX terms
};

/// Of struct zoom_calibration.
extern const struct keyed_table zoom_grammar;

#ifdef __cplusplus
}
#endif

#endif
