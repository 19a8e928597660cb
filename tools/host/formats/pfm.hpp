// SPDX-License-Identifier: Apache-2.0
/// Portable float maps: one float per pixel, the format of disparity.pfm and of ground truth.
/// Source: P. Debevec, "PFM Portable FloatMap Image Format"; in Middlebury's files +inf means that
/// the truth is unknown.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_PFM_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_PFM_HPP

#include <cstddef>
#include <string>
#include <vector>

/// Largest side that the reader accepts, in pixels: no header can request more than 1 GiB.
enum { PFM_MAX_SIDE_PX = 16384 };

/// One float per pixel, rows from the top (the file stores them from the bottom).
struct pfm_image {
    int width_px = 0, height_px = 0;
    std::vector<float> values;
};

/// Parses a grey map ("Pf") of either byte order. Values are unscaled: the scale factor of the
/// header gives only the byte order, as in Middlebury's and OpenCV's readers. On failure returns
/// false, sets `message` to what is wrong (without a file name) and leaves `image` untouched.
bool pfm_parse(const unsigned char *data, std::size_t length, pfm_image *image,
               std::string *message);

/// Reads a file; `message` then names it.
bool pfm_read(const std::string &path, pfm_image *image, std::string *message);

#endif
