// SPDX-License-Identifier: Apache-2.0
/// The property of an importer, for every text.
#ifndef VERGENCE_TESTS_FUZZ_IMPORT_PROPERTY_HPP
#define VERGENCE_TESTS_FUZZ_IMPORT_PROPERTY_HPP

#include <cmath>
#include <cstring>
#include <string>

#include "core/error.h"
#include "fuzz_check.hpp"
#include "tools/host/convert/import.hpp"

inline import_options fuzz_import_options() {
    import_options options;
    options.width_px = 640;
    options.height_px = 480;
    return options;
}

/// `import` either throws an import_failure with a code and a reason, or gives a pair whose numbers
/// are finite and which, where it is valid, survives our own text.
template <typename Import>
void check_import(Import import) {
    import_pair pair;
    try {
        pair = import();
    } catch (const import_failure &failure) {
        FUZZ_CHECK(failure.code < 0 && !failure.message.empty());
        return;
    }
    FUZZ_CHECK(std::isfinite(pair.value.left.fx_px) && std::isfinite(pair.value.right.cx_px));
    FUZZ_CHECK(!pair.format.empty() && !pair.tag.empty());
    std::strcpy(pair.value.id, "fuzz");
    // A lens with distortion takes long to validate, and that is tested elsewhere.
    for (lens *camera : {&pair.value.left, &pair.value.right}) {
        camera->k1 = camera->k2 = camera->p1 = camera->p2 = camera->k3 = 0;
        camera->k4 = camera->k5 = camera->k6 = 0;
    }
    char text[CALIBRATION_TEXT_MAX_BYTES];
    const int length = calibration_print(&pair.value, text, sizeof text);
    calibration parsed;
    FUZZ_CHECK(length < 0 ||
               calibration_parse(text, static_cast<size_t>(length), &parsed, nullptr) == ERROR_OK);
}

#endif
