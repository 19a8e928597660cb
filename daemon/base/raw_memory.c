// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/raw_memory.h"

#include <stdlib.h>

#include "core/invariant.h"
#include "daemon/base/memory.h"

uint16_t *raw_memory_allocate(struct raw_image *image) {
    INVARIANT(image->width_px > 0 && image->height_px > 0);
    const size_t row_values = raw_image_row_values(image);
    const size_t bytes = row_values * (size_t)image->height_px * sizeof(uint16_t);
    uint16_t *pixels =
        memory_available_bytes() >= bytes + RAW_MEMORY_RESERVE_BYTES ? malloc(bytes) : NULL;
    image->data = pixels;
    image->stride = (ptrdiff_t)row_values;
    image->release = pixels != NULL ? free : NULL;
    image->owner = pixels;
    return pixels;
}
