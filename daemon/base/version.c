// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/version.h"

// Written into the build directory by build_id.cmake.
#include "build_id.h"

const char *version_text(void) {
    return VERGENCE_VERSION;
}

const char *version_build_id(void) {
    return VERGENCE_BUILD_ID;
}

const char *version_build_date(void) {
    return VERGENCE_BUILD_DATE;
}
