// SPDX-License-Identifier: Apache-2.0
/// Readers of image files. A reader finds out size and depth, calls `image_file_begin`, which
/// checks every limit before it allocates, and then hands over rows as the file has them; range
/// checks, shrinking and turning happen there, in one place for all formats.
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

/// No file's image may be larger, even when it is to be shrunk. A probe sees this many first bytes.
enum { IMAGE_FILE_MAX_SIDE_PX = 32768, IMAGE_FILE_HEAD_BYTES = 16 };

enum image_bayer { IMAGE_BAYER_BY_FORMAT, IMAGE_BAYER_NONE, IMAGE_BAYER_GRBG };

/// What the command line says about the files.
struct image_request {
    int bits;  // significant bits, 8..16; 0: what the file says
    enum image_bayer bayer;
    int raw_width_px, raw_height_px;  // of headerless files; 0: the sensor's 2048x1536
    double scale;                     // below 1, images larger than the core's maximum are shrunk
    bool indices;                     // a palette image counts as the grey image of its indices
};

/// An image in memory: owns its pixels.
struct image_file {
    struct reconstruct_image image;     // points to `pixels`
    uint16_t *pixels;                   // NULL before image_file_begin
    int file_width_px, file_height_px;  // as the image is shown, so after turning
    int shrink;                         // integer factor, 1: not shrunk
    uint16_t brightest;                 // largest value seen in the file
    /// Where the file's first row and column are to be seen, as EXIF and TIFF number it: 1 top left
    /// (or 0: the file does not say), 2 top right, 3 bottom right, 4 bottom left; 5 to 8 the same
    /// with rows running down: left top, right top, right bottom, left bottom. Set by readers
    /// before image_file_begin.
    int orientation;

    const char *path;  // for messages
    const struct image_request *request;
    int channels, rows_done;
    uint32_t *sums;            // one row of areas while shrinking
    int skip_x_px, skip_y_px;  // of the file, so that the shown image loses pixels right and below
};

struct image_format {
    const char *name;        // "PNG"
    const char *extensions;  // lower case, separated by spaces, without dots
    /// Whether a file that begins with these bytes is of this format; NULL: goes by extension only.
    bool (*probe)(const unsigned char *head, size_t length);
    /// Reads the whole file into `file`. Returns 0 or a negative error code with `message` set.
    int (*read)(const char *path, const struct image_request *request, struct image_file *file,
                struct message *message);
};

/// Opens `path`, finds its format among `formats`, reads it and turns it the way up that it says,
/// as viewers and OpenCV's imread do. On success the caller frees `file` with `image_file_free`; on
/// error nothing is left to free. ERROR_TOO_LARGE, ERROR_SYNTAX, ERROR_MEMORY, ERROR_RANGE,
/// ERROR_ARGUMENT; `message` names the file.
int image_file_read(const char *path, const struct image_format *formats, int format_count,
                    const struct image_request *request, struct image_file *file,
                    struct message *message);

/// For readers: announces the image. `channels` 1 (grey, or a mosaic when the request says so
/// or `layout` does) or 3 (colour); `bits` of the values, 8..16. Checks limits and allocates.
int image_file_begin(struct image_file *file, int width_px, int height_px, int channels, int bits,
                     enum pixel_layout layout, struct message *message);

/// For readers: the next row of the file, width * channels values.
int image_file_row(struct image_file *file, const uint16_t *values, struct message *message);

/// For readers of whole files in memory: what makes an image of the bytes.
typedef int image_file_parser(const unsigned char *data, size_t length, struct image_file *file,
                              struct message *message);

/// Loads `path` and lets `parse` have its bytes. Returns what `parse` does, or ERROR_ARGUMENT,
/// ERROR_TOO_LARGE (than any legal image), ERROR_SYNTAX or ERROR_MEMORY with `message` set.
int image_file_load(const char *path, image_file_parser *parse, struct image_file *file,
                    struct message *message);

/// Frees the pixels; harmless for a zeroed struct.
void image_file_free(struct image_file *file);

#ifdef __cplusplus
}
#endif

#endif
