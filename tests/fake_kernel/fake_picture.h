// SPDX-License-Identifier: Apache-2.0
/// What a fake camera sees: a file of pixels, looked at again for every frame, so that a test
/// changes the scene by replacing the file (by a rename).
#ifndef VERGENCE_TESTS_FAKE_PICTURE_H
#define VERGENCE_TESTS_FAKE_PICTURE_H

#include <stddef.h>
#include <stdint.h>

/// Fills `data` (room for `*bytes`) with the picture in the format of V4L2, and sets `*bytes`.
/// GREY and SGRBG10 need a PGM (8 bits; of 16 big-endian bits for more), YUYV a PPM of 8 bits, of
/// this very size; of MJPEG the file is the frame. Ends the program with a line when it cannot.
void fake_picture_paint(const char *path, uint32_t fourcc, uint32_t width_px, uint32_t height_px,
                        uint8_t *data, size_t *bytes);

/// The size of a PGM or PPM file; ends the program with a line when it is none.
void fake_picture_size(const char *path, uint32_t *width_px, uint32_t *height_px);

#endif
