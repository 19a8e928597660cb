// SPDX-License-Identifier: Apache-2.0
/// Readers of image files. A reader determines size and depth, calls `image_file_begin`, which
/// checks every limit before it allocates, and then passes rows in file order. Range checks,
/// shrinking and turning are done here once for all formats.
#ifndef VERGENCE_DAEMON_IMAGES_IMAGE_FILE_H
#define VERGENCE_DAEMON_IMAGES_IMAGE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "daemon/base/message.h"
#include "stereo/reconstruct.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Limit for the image in a file, even if it is to be shrunk; and the bytes that a probe gets.
enum { IMAGE_FILE_MAX_SIDE_PX = 32768, IMAGE_FILE_HEAD_BYTES = 16 };

enum image_bayer { IMAGE_BAYER_BY_FORMAT, IMAGE_BAYER_NONE, IMAGE_BAYER_GRBG };

/// What the command line states about the files.
struct image_request {
    int bits;  // significant bits, 8..16; 0: as the file states
    enum image_bayer bayer;
    int raw_width_px, raw_height_px;  // size of headerless images; 0: the sensor's 2048x1536
    double scale;  // a scale below 1 shrinks images larger than the core's maximum
    bool indices;  // read a palette image as a grey image of its indices
};

/// An image being read, and afterwards the image.
struct image_file {
    struct raw_image image;             // no pixels before image_file_begin
    uint16_t *pixels;                   // those of `image`, for its readers
    int file_width_px, file_height_px;  // size of the image as displayed, after turning
    int shrink;                         // integer factor, 1: not shrunk
    uint16_t brightest;                 // largest value seen in the file
    /// Position of the file's first row and column in the shown image, numbered as in EXIF and
    /// TIFF: 1 top left (also 0: not stated), 2 top right, 3 bottom right, 4 bottom left; 5 to 8
    /// the same with rows running down: left top, right top, right bottom, left bottom. Readers set
    /// it before image_file_begin.
    int orientation;

    const char *path;  // the file's name in messages
    const struct image_request *request;
    int channels, rows_done;
    uint32_t *sums;  // sums of one row of blocks while shrinking
    // Pixels to be skipped at the start of the file's rows and columns, so that the incomplete
    // blocks are cut at the right and lower edge of the shown image.
    int skip_x_px, skip_y_px;
};

struct image_format {
    const char *name;        // "PNG"
    const char *extensions;  // lower case, separated by spaces, without dots
    /// Whether a file that begins with these bytes has this format; NULL: by extension only.
    bool (*probe)(const unsigned char *head, size_t length);
    /// Reads the whole file into `file`. Returns 0, or a negative error code with `message` set.
    int (*read)(const char *path, const struct image_request *request, struct image_file *file,
                struct message *message);
};

/// Opens `path`, detects its format among `formats`, reads it and turns it as its orientation says,
/// like viewers and OpenCV's imread. On success the caller frees `file` with `image_file_free`; on
/// error nothing needs to be freed. ERROR_TOO_LARGE, ERROR_SYNTAX, ERROR_MEMORY, ERROR_RANGE,
/// ERROR_ARGUMENT; `message` names the file.
int image_file_read(const char *path, const struct image_format *formats, int format_count,
                    const struct image_request *request, struct image_file *file,
                    struct message *message);

/// For readers: starts the image. `channels` is 1 (grey, or a mosaic if the request or `layout`
/// says so) or 3 (colour); `bits` of the values is 8..16. Checks limits and allocates.
int image_file_begin(struct image_file *file, int width_px, int height_px, int channels, int bits,
                     enum raw_layout layout, struct message *message);

/// For readers: adds the next row of the file, width * channels values.
int image_file_row(struct image_file *file, const uint16_t *values, struct message *message);

/// For sources other than files: takes over an image as if it had been read, shrunk if it must be;
/// else without a copy. `image` owns its pixels no more, whatever is returned.
int image_file_take(struct image_file *file, struct raw_image *image, struct message *message);

/// Parser of a whole file in memory.
typedef int image_file_parser(const unsigned char *data, size_t length, struct image_file *file,
                              struct message *message);

/// Loads `path` and passes its bytes to `parse`. Returns what `parse` returns, or ERROR_ARGUMENT,
/// ERROR_TOO_LARGE (larger than any legal image), ERROR_SYNTAX or ERROR_MEMORY with `message` set.
int image_file_load(const char *path, image_file_parser *parse, struct image_file *file,
                    struct message *message);

/// Frees the pixels. A zeroed struct is allowed.
void image_file_free(struct image_file *file);

#ifdef __cplusplus
}
#endif

#endif
