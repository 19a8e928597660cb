// SPDX-License-Identifier: Apache-2.0
/// The grammar of the calibration text as data: see keyed_text.h.
#ifndef VERGENCE_STEREO_GEOMETRY_CALIBRATION_GRAMMAR_H
#define VERGENCE_STEREO_GEOMETRY_CALIBRATION_GRAMMAR_H

#include "stereo/geometry/keyed_text.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CALIBRATION_GRAMMAR_MAGIC "vergence-calibration "
#define CALIBRATION_GRAMMAR_NO_AXIS "none"

enum { CALIBRATION_GRAMMAR_VERSIONS = 4, CALIBRATION_AXIS_DECIMALS = 3 };

enum calibration_field_kind {
    CALIBRATION_FIELD_WINDOW = KEYED_OTHER,  // three integers, or "unknown"
    CALIBRATION_FIELD_LENS,                  // name of an `enum lens_kind`
    CALIBRATION_FIELD_AXIS,  // mean and spread with `decimals` decimals, "none" or "unknown"
};

/// Of struct calibration.
extern const struct keyed_table calibration_grammar;

#ifdef __cplusplus
}
#endif

#endif
