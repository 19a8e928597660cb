// SPDX-License-Identifier: Apache-2.0
/// The image of a fake camera: a file of pixels, read again for every frame, so that a test changes
/// the scene by replacing the file (by rename). A file of several equal pictures, one behind the
/// other as Netpbm allows, is a scene that moves: one of them each frame, over and over.
#ifndef VERGENCE_TESTS_FAKE_PICTURE_H
#define VERGENCE_TESTS_FAKE_PICTURE_H

#include <stddef.h>
#include <stdint.h>

/// Fills `data` (capacity `*bytes`) with the image of frame `sequence` in the V4L2 format, and sets
/// `*bytes`. GREY and SGRBG10 need a PGM (8 bits, or 16 big-endian bits), YUYV an 8-bit PPM, of
/// exactly this size; for MJPEG the file is the frame. On an error it ends the program with a
/// message.
void fake_picture_paint(const char *path, uint32_t fourcc, uint32_t width_px, uint32_t height_px,
                        uint32_t sequence, uint8_t *data, size_t *bytes);

/// Makes a frame of GREY or YUYV so many times as bright in light; its values have a gamma of 2.
void fake_picture_expose(uint32_t fourcc, double light, uint8_t *data, size_t bytes);

/// The size of a PGM or PPM file; ends the program with a message if it is not one.
void fake_picture_size(const char *path, uint32_t *width_px, uint32_t *height_px);

#endif
