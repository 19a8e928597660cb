// SPDX-License-Identifier: Apache-2.0
// For all processors; the others' results are compared with these.
#define SUBPIXEL_LOOPS subpixel_plain_loops
#include "stereo/subpixel_text.h"
