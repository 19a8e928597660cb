// SPDX-License-Identifier: Apache-2.0
#include "tools/host/formats/image_formats.hpp"

#include "daemon/images/image_pnm.h"

namespace {

const image_format formats[] = {
    {"PNG", "png", image_png_probe, image_png_read},
    {"JPEG", "jpg jpeg", image_jpeg_probe, image_jpeg_read},
    {"PGM/PPM", "pgm ppm pnm", image_pnm_probe, image_pnm_read},
    {"TIFF", "tif tiff", image_tiff_probe, image_tiff_read},
    {"raw", "raw", nullptr, image_raw_read},
};

}  // namespace

image_format_list image_formats() {
    return {formats, sizeof formats / sizeof formats[0]};
}
