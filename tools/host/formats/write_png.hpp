// SPDX-License-Identifier: Apache-2.0
/// The PNG files of a result; each is a `result_writer`'s function. An accepted mismatch is stored
/// as their comment (tEXt). Source: W3C, "Portable Network Graphics", second edition.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_WRITE_PNG_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_WRITE_PNG_HPP

#include <vector>

#include "daemon/surface/result/reconstruct_context.h"
#include "tools/host/formats/colormap.hpp"

/// disparity.png: 16 bit, 256 (x_left - x_right), 0 where invalid (KITTI's scale). The format
/// cannot hold disparities of 0 and less: they become 0 as well; disparity.pfm has them.
int write_png_disparity(const reconstruct_context *context, const char *path, message *message);

/// depth.png: 16 bit, z in the left camera's frame in mm, 0 where invalid or beyond 65535 mm.
int write_png_depth(const reconstruct_context *context, const char *path, message *message);

/// reasons.png: palette (`colormap_reasons`); the index is enum reason.
int write_png_reasons(const reconstruct_context *context, const char *path, message *message);

/// left_rectified.png and right_rectified.png: 8 bit colour, black where the camera sees nothing.
int write_png_left(const reconstruct_context *context, const char *path, message *message);
int write_png_right(const reconstruct_context *context, const char *path, message *message);

/// A picture of palette indices, one row after the other. Returns as a `result_writer`'s function.
int write_png_palette(int width_px, int height_px, const std::vector<uint8_t> &indices,
                      const colormap_table &palette, const char *path, message *message);

/// The same as the bytes of a file, with a transparent index; empty when memory is short.
std::vector<uint8_t> write_png_bytes(int width_px, int height_px,
                                     const std::vector<uint8_t> &indices,
                                     const colormap_table &palette, int transparent);

#endif
