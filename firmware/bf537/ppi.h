// SPDX-License-Identifier: Apache-2.0
/// The parallel peripheral interface with its DMA channel as a camera port: frames of the camera
/// that the bridge has selected.
#ifndef VERGENCE_BF537_PPI_H
#define VERGENCE_BF537_PPI_H

#include <stddef.h>
#include <stdint.h>

#include "hal/camera.h"

enum { BF537_FRAMES = 4 };

/// Gives the port `bytes` bytes of memory, for up to BF537_FRAMES frames at a time. Static storage.
const struct hal_camera *bf537_ppi_open(void *memory, size_t bytes);

#endif
