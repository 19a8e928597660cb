// SPDX-License-Identifier: Apache-2.0
/// Memory for the pixels of images.
#ifndef VERGENCE_DAEMON_BASE_RAW_MEMORY_H
#define VERGENCE_DAEMON_BASE_RAW_MEMORY_H

#include "core/raw_image.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Allocates the pixels of an image whose size and layout are set, rows without gaps, and returns
/// where to write them; raw_image_release frees them. NULL if out of memory: the image has none.
/// Also if the system promises more than it has: RAW_MEMORY_RESERVE_BYTES stay available.
enum { RAW_MEMORY_RESERVE_BYTES = 1 << 20 };
uint16_t *raw_memory_allocate(struct raw_image *image);

#ifdef __cplusplus
}
#endif

#endif
