// SPDX-License-Identifier: Apache-2.0
// For x86 processors with AVX2.
#if defined(__x86_64__)
#define SUBPIXEL_LOOPS subpixel_avx2_loops
#include "stereo/subpixel_text.h"
#endif
