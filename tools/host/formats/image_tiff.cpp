// SPDX-License-Identifier: Apache-2.0
#include <tiffio.h>

#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>
#include <vector>

#include "core/error.h"
#include "tools/host/formats/image_formats.hpp"

namespace {

/// Limit in bytes of one row of tiles, and of one strip: a header may state any size.
constexpr uint64_t band_max_bytes = uint64_t{1} << 28;

struct tiff_closer {
    void operator()(TIFF *tiff) const { TIFFClose(tiff); }
};
using tiff_handle = std::unique_ptr<TIFF, tiff_closer>;

/// libtiff's handlers have no context, so its last message is kept here.
char last_complaint[160];

__attribute__((format(printf, 2, 0))) void on_error(const char *, const char *format,
                                                    va_list arguments) {
    std::vsnprintf(last_complaint, sizeof last_complaint, format, arguments);
}

struct layout {
    uint32_t width = 0, height = 0;
    uint16_t bits = 1, samples = 1, photometric = 0, planes = PLANARCONFIG_CONTIG;
    uint16_t format = SAMPLEFORMAT_UINT, compression = COMPRESSION_NONE;
    uint16_t orientation = ORIENTATION_TOPLEFT;
    int channels = 1;
};

int damaged(const image_file *file, message *message) {
    return message_set(message, ERROR_SYNTAX, "%s: damaged or truncated TIFF (%s)", file->path,
                       last_complaint[0] != '\0' ? last_complaint : "unknown reason");
}

bool is_grey(const layout &image) {
    return image.photometric == PHOTOMETRIC_MINISBLACK ||
           image.photometric == PHOTOMETRIC_MINISWHITE;
}

/// Whether libtiff delivers red, green and blue.
bool is_colour(const layout &image) {
    return image.photometric == PHOTOMETRIC_RGB ||
           (image.photometric == PHOTOMETRIC_YCBCR && image.compression == COMPRESSION_JPEG);
}

/// Why this file cannot be read; NULL if it can.
const char *find_obstacle(const layout &image) {
    if (image.format != SAMPLEFORMAT_UINT) {
        return "its values are not unsigned integers";
    }
    if (image.bits != 8 && image.bits != 16) {
        return "only 8 and 16 bits per value are supported";
    }
    if (image.planes != PLANARCONFIG_CONTIG && image.samples > 1) {
        return "its colours are stored as separate planes";
    }
    const bool grey = is_grey(image), colour = is_colour(image);
    if ((!grey && !colour) || (colour && image.samples < 3) || image.samples > 8) {
        return "it is neither grey nor RGB";
    }
    return nullptr;
}

int read_layout(TIFF *tiff, const image_file *file, layout *image, message *message) {
    if (TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &image->width) == 0 ||
        TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &image->height) == 0) {
        return damaged(file, message);
    }
    TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &image->bits);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &image->samples);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &image->planes);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &image->format);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &image->compression);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_ORIENTATION, &image->orientation);
    if (TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &image->photometric) == 0) {
        image->photometric = image->samples >= 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK;
    }
    const char *obstacle = find_obstacle(*image);
    if (obstacle != nullptr) {
        return message_set(message, ERROR_SYNTAX,
                           "%s: this kind of TIFF cannot be read: %s; save it as PNG", file->path,
                           obstacle);
    }
    if (image->photometric == PHOTOMETRIC_YCBCR) {
        TIFFSetField(tiff, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
    }
    const bool grey = image->photometric == PHOTOMETRIC_MINISBLACK ||
                      image->photometric == PHOTOMETRIC_MINISWHITE;
    image->channels = grey ? 1 : 3;
    return ERROR_OK;
}

/// Extracts grey or colour from `pixels` pixels as stored (with alpha, 8 or 16 bit).
void unpack(const layout &image, const unsigned char *bytes, size_t pixels, uint16_t *row) {
    const bool inverted = image.photometric == PHOTOMETRIC_MINISWHITE;
    const uint16_t full = image.bits == 16 ? 65535 : 255;
    for (size_t x = 0; x < pixels; x++) {
        for (size_t c = 0; c < static_cast<size_t>(image.channels); c++) {
            const size_t at = x * image.samples + c;
            uint16_t value = bytes[image.bits == 16 ? 2 * at : at];
            if (image.bits == 16) {
                std::memcpy(&value, bytes + 2 * at, sizeof value);
            }
            row[x * static_cast<size_t>(image.channels) + c] =
                inverted ? static_cast<uint16_t>(full - value) : value;
        }
    }
}

int read_strips(TIFF *tiff, const layout &image, image_file *file, message *message) {
    const tmsize_t line_bytes = TIFFScanlineSize(tiff);
    if (line_bytes <= 0 || TIFFStripSize64(tiff) > band_max_bytes) {
        return damaged(file, message);
    }
    std::vector<unsigned char> bytes(static_cast<size_t>(line_bytes));
    std::vector<uint16_t> row(size_t{image.width} * static_cast<size_t>(image.channels));
    if (bytes.size() < size_t{image.width} * image.samples * (image.bits / 8u)) {
        return damaged(file, message);
    }
    for (uint32_t y = 0; y < image.height; y++) {
        if (TIFFReadScanline(tiff, bytes.data(), y, 0) != 1) {
            return damaged(file, message);
        }
        unpack(image, bytes.data(), image.width, row.data());
        const int error = image_file_row(file, row.data(), message);
        if (error != ERROR_OK) {
            return error;
        }
    }
    return ERROR_OK;
}

/// Reads the tiles of one band of rows into `band` (tile_height rows of `image.width` pixels).
bool read_band(TIFF *tiff, const layout &image, uint32_t y, uint32_t tile_width,
               uint32_t tile_height, std::vector<unsigned char> *tile,
               std::vector<uint16_t> *band) {
    const size_t channels = static_cast<size_t>(image.channels);
    const size_t tile_row_bytes = size_t{tile_width} * image.samples * (image.bits / 8u);
    for (uint32_t x = 0; x < image.width; x += tile_width) {
        if (TIFFReadTile(tiff, tile->data(), x, y, 0, 0) < 0) {
            return false;
        }
        const uint32_t pixels = image.width - x < tile_width ? image.width - x : tile_width;
        for (uint32_t row = 0; row < tile_height && y + row < image.height; row++) {
            unpack(image, tile->data() + row * tile_row_bytes, pixels,
                   band->data() + (size_t{row} * image.width + x) * channels);
        }
    }
    return true;
}

/// Whether tiles of this size are legal and fit the limits.
bool is_tile_valid(TIFF *tiff, const layout &image, uint32_t width, uint32_t height) {
    const uint64_t sample_bytes = image.bits / 8u;
    const uint64_t tile_bytes = uint64_t{width} * height * image.samples * sample_bytes;
    return width != 0 && height != 0 && width <= IMAGE_FILE_MAX_SIDE_PX &&
           height <= IMAGE_FILE_MAX_SIDE_PX && tile_bytes <= band_max_bytes &&
           uint64_t{image.width} * height * static_cast<size_t>(image.channels) * 2 <=
               band_max_bytes &&
           static_cast<uint64_t>(TIFFTileSize64(tiff)) >= tile_bytes;
}

int read_tiles(TIFF *tiff, const layout &image, image_file *file, message *message) {
    uint32_t tile_width = 0, tile_height = 0;
    TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &tile_width);
    TIFFGetField(tiff, TIFFTAG_TILELENGTH, &tile_height);
    const size_t channels = static_cast<size_t>(image.channels);
    if (!is_tile_valid(tiff, image, tile_width, tile_height)) {
        return damaged(file, message);
    }
    std::vector<unsigned char> tile(static_cast<size_t>(TIFFTileSize(tiff)));
    std::vector<uint16_t> band(size_t{image.width} * tile_height * channels);
    for (uint32_t y = 0; y < image.height; y += tile_height) {
        if (!read_band(tiff, image, y, tile_width, tile_height, &tile, &band)) {
            return damaged(file, message);
        }
        for (uint32_t row = 0; row < tile_height && y + row < image.height; row++) {
            const int error =
                image_file_row(file, band.data() + size_t{row} * image.width * channels, message);
            if (error != ERROR_OK) {
                return error;
            }
        }
    }
    return ERROR_OK;
}

int read_tiff(const char *path, image_file *file, message *message) {
    const tiff_handle tiff(TIFFOpen(path, "rm"));
    layout image;
    if (!tiff) {
        return damaged(file, message);
    }
    int error = read_layout(tiff.get(), file, &image, message);
    if (error != ERROR_OK) {
        return error;
    }
    file->orientation = image.orientation <= 8 ? image.orientation : 0;
    const uint32_t limit = 1 << 30;
    error = image_file_begin(file, static_cast<int>(image.width < limit ? image.width : limit),
                             static_cast<int>(image.height < limit ? image.height : limit),
                             image.channels, image.bits, image.channels == 3 ? RAW_RGB : RAW_GREY,
                             message);
    if (error != ERROR_OK) {
        return error;
    }
    return TIFFIsTiled(tiff.get()) != 0 ? read_tiles(tiff.get(), image, file, message)
                                        : read_strips(tiff.get(), image, file, message);
}

}  // namespace

bool image_tiff_probe(const unsigned char *head, size_t length) {
    return length >= 4 &&
           ((head[0] == 'I' && head[1] == 'I' && head[2] <= 43 && head[2] >= 42 && head[3] == 0) ||
            (head[0] == 'M' && head[1] == 'M' && head[2] == 0 && head[3] <= 43 && head[3] >= 42));
}

int image_tiff_read(const char *path, const image_request *, image_file *file, message *message) {
    TIFFSetErrorHandler(on_error);
    TIFFSetWarningHandler(nullptr);
    last_complaint[0] = '\0';
    try {
        return read_tiff(path, file, message);
    } catch (const std::bad_alloc &) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", path);
    }
}
