// SPDX-License-Identifier: Apache-2.0
/// Portable float maps: one float a pixel, the format of disparity.pfm and of ground truth.
/// Source: P. Debevec, "PFM Portable FloatMap Image Format"; Middlebury's files say +inf where
/// the truth is unknown.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_PFM_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_PFM_HPP

#include <cstddef>
#include <string>
#include <vector>

/// Largest side that the reader accepts, in pixels: no header can ask for more than 1 GiB.
enum { PFM_MAX_SIDE_PX = 16384 };

/// One float a pixel, rows from the top (the file stores them from the bottom).
struct pfm_image {
    int width_px = 0, height_px = 0;
    std::vector<float> values;
};

/// Parses a grey map ("Pf") of either byte order. Values are taken as they are: the scale factor of
/// the header says the byte order only, as Middlebury's and OpenCV's readers have it. On failure
/// returns false, says in `message` what is wrong (no file name) and leaves `image` untouched.
bool pfm_parse(const unsigned char *data, std::size_t length, pfm_image *image,
               std::string *message);

/// Reads a file; `message` then names it.
bool pfm_read(const std::string &path, pfm_image *image, std::string *message);

#endif
