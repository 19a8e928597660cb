// SPDX-License-Identifier: Apache-2.0
#include "daemon/images/image_file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/raw_memory.h"
#include "daemon/files/input_file.h"

/// Size limit of a file that is loaded as a whole: 16 bit colour at the core's limit is 100 MB;
/// larger images that are to be shrunk still fit.
enum { IMAGE_FILE_MAX_BYTES = 1 << 30 };

/// Integer factor by which an image larger than the core's maximum is shrunk: the largest that
/// leaves the resolution that --scale asks for.
static int choose_shrink(double scale) {
    if (!(scale > 0.0 && scale < 1.0)) {
        return 1;
    }
    // A scale of 1/3 given with a few digits must still mean 3.
    const double factor = 1.0 / scale + 1e-3;
    return factor < 64.0 ? (int)factor : 64;
}

/// Converts the file's axes to those of the shown image: first mirror, then swap.
struct turn {
    bool mirrors_x, mirrors_y, swaps;
};

static struct turn turn_of(int orientation) {
    static const struct turn turns[] = {
        {false, false, false}, {false, false, false}, {true, false, false},
        {true, true, false},   {false, true, false},  {false, false, true},
        {false, true, true},   {true, true, true},    {true, false, true},
    };
    INVARIANT(orientation >= 0 && orientation <= 8);
    return turns[orientation];
}

static int refuse_size(const struct image_file *file, int width_px, int height_px,
                       struct message *message) {
    const int side = width_px > height_px ? width_px : height_px;
    const int needed = (side + IMAGE_MAX_SIDE_PX - 1) / IMAGE_MAX_SIDE_PX;
    return message_set(
        message, ERROR_TOO_LARGE,
        "%s: %dx%d exceeds the maximum of %dx%d pixels (shrink it with --scale %.4g or less)",
        file->path, width_px, height_px, IMAGE_MAX_SIDE_PX, IMAGE_MAX_SIDE_PX, 1.0 / needed);
}

/// Checks the size in the file and chooses how much the image is shrunk.
static int choose_factor(struct image_file *file, int width_px, int height_px, bool mosaic,
                         struct message *message) {
    if (width_px < 1 || height_px < 1 || width_px > IMAGE_FILE_MAX_SIDE_PX ||
        height_px > IMAGE_FILE_MAX_SIDE_PX) {
        return message_set(message, ERROR_TOO_LARGE,
                           "%s: invalid size %dx%d (width and height must be from 1 to %d)",
                           file->path, width_px, height_px, IMAGE_FILE_MAX_SIDE_PX);
    }
    file->file_width_px = width_px;
    file->file_height_px = height_px;
    file->shrink = 1;
    if (width_px > IMAGE_MAX_SIDE_PX || height_px > IMAGE_MAX_SIDE_PX) {
        if (mosaic) {
            return message_set(message, ERROR_TOO_LARGE,
                               "%s: %dx%d exceeds the maximum of %dx%d pixels, and a Bayer mosaic "
                               "cannot be shrunk",
                               file->path, width_px, height_px, IMAGE_MAX_SIDE_PX,
                               IMAGE_MAX_SIDE_PX);
        }
        file->shrink = choose_shrink(file->request->scale);
    }
    return ERROR_OK;
}

static int refuse_memory(const struct image_file *file, struct message *message) {
    return message_set(message, ERROR_MEMORY, "%s: out of memory for %dx%d pixels", file->path,
                       file->image.width_px, file->image.height_px);
}

/// Sets the size of the image in memory.
static int choose_size(struct image_file *file, int width_px, int height_px, bool mosaic,
                       struct message *message) {
    const int error = choose_factor(file, width_px, height_px, mosaic, message);
    if (error != ERROR_OK) {
        return error;
    }
    // Incomplete blocks at the right and lower edge of the shown image are dropped.
    const struct turn turn = turn_of(file->orientation);
    file->skip_x_px = turn.mirrors_x ? width_px % file->shrink : 0;
    file->skip_y_px = turn.mirrors_y ? height_px % file->shrink : 0;
    file->image.width_px = width_px / file->shrink;
    file->image.height_px = height_px / file->shrink;
    if (file->image.width_px > IMAGE_MAX_SIDE_PX || file->image.height_px > IMAGE_MAX_SIDE_PX) {
        return refuse_size(file, width_px, height_px, message);
    }
    if (file->image.width_px < 1 || file->image.height_px < 1) {
        return message_set(message, ERROR_TOO_SMALL, "%s: too small: %dx%d pixels at 1/%d",
                           file->path, width_px, height_px, file->shrink);
    }
    return ERROR_OK;
}

/// The layout that the request asks for, if the file's own is unknown; ERROR_ARGUMENT if it is not
/// possible for this file.
static int choose_layout(const struct image_file *file, int channels, enum raw_layout *layout,
                         struct message *message) {
    const enum image_bayer bayer = file->request->bayer;
    if (channels == 1 && bayer != IMAGE_BAYER_BY_FORMAT) {
        *layout = bayer == IMAGE_BAYER_GRBG ? RAW_BAYER_GRBG : RAW_GREY;
    }
    if (channels == 3 && bayer == IMAGE_BAYER_GRBG) {
        return message_set(message, ERROR_ARGUMENT,
                           "%s is a colour image, not a mosaic (leave out --bayer grbg)",
                           file->path);
    }
    if (*layout == RAW_BAYER_GRBG && file->orientation > 1) {
        return message_set(message, ERROR_ARGUMENT,
                           "%s has orientation %d, but a Bayer mosaic cannot be turned (save it "
                           "without an orientation)",
                           file->path, file->orientation);
    }
    return ERROR_OK;
}

/// Prepares for rows of the file: sums while shrinking, and the range of values.
static int prepare(struct image_file *file, int width_px, int height_px, int channels, int bits,
                   enum raw_layout layout, struct message *message) {
    INVARIANT(file->image.data == NULL && channels == (layout == RAW_RGB ? 3 : 1));
    INVARIANT(bits >= 8 && bits <= 16);
    int error = choose_layout(file, channels, &layout, message);
    if (error == ERROR_OK) {
        error = choose_size(file, width_px, height_px, layout == RAW_BAYER_GRBG, message);
    }
    if (error != ERROR_OK) {
        return error;
    }
    file->channels = channels;
    file->image.bits = file->request->bits != 0 ? file->request->bits : bits;
    file->image.layout = layout;
    const size_t row = raw_image_row_values(&file->image);
    file->sums = file->shrink > 1 ? calloc(row, sizeof *file->sums) : NULL;
    return file->shrink > 1 && file->sums == NULL ? refuse_memory(file, message) : ERROR_OK;
}

int image_file_begin(struct image_file *file, int width_px, int height_px, int channels, int bits,
                     enum raw_layout layout, struct message *message) {
    const int error = prepare(file, width_px, height_px, channels, bits, layout, message);
    if (error != ERROR_OK) {
        return error;
    }
    file->pixels = raw_memory_allocate(&file->image);
    return file->pixels != NULL ? ERROR_OK : refuse_memory(file, message);
}

static void shrink_row(struct image_file *file, const uint16_t *values) {
    const int factor = file->shrink, channels = file->channels;
    const int row_done = file->rows_done - file->skip_y_px;
    const int y = row_done / factor;
    if (row_done < 0 || y >= file->image.height_px) {
        return;
    }
    values += file->skip_x_px * channels;
    for (int x = 0; x < file->image.width_px; x++) {
        for (int i = 0; i < factor; i++) {
            for (int c = 0; c < channels; c++) {
                file->sums[x * channels + c] += values[(x * factor + i) * channels + c];
            }
        }
    }
    if (row_done % factor == factor - 1) {
        const uint32_t area = (uint32_t)(factor * factor);
        uint16_t *row = file->pixels + (ptrdiff_t)y * file->image.stride;
        for (ptrdiff_t i = 0; i < file->image.stride; i++) {
            row[i] = (uint16_t)((file->sums[i] + area / 2) / area);
            file->sums[i] = 0;
        }
    }
}

/// Checks the values of the next row of the file.
static int check_row(struct image_file *file, const uint16_t *values, struct message *message) {
    const size_t count = (size_t)file->file_width_px * (size_t)file->channels;
    INVARIANT(file->image.data != NULL && file->rows_done < file->file_height_px);
    uint16_t brightest = file->brightest;
    for (size_t i = 0; i < count; i++) {
        brightest = values[i] > brightest ? values[i] : brightest;
    }
    file->brightest = brightest;
    if (brightest >> file->image.bits != 0) {
        return message_set(
            message, ERROR_RANGE,
            "%s: row %d has the value %d, too large for %d bits (give the right --bits)",
            file->path, file->rows_done, brightest, file->image.bits);
    }
    return ERROR_OK;
}

int image_file_row(struct image_file *file, const uint16_t *values, struct message *message) {
    const int error = check_row(file, values, message);
    if (error != ERROR_OK) {
        return error;
    }
    if (file->shrink > 1) {
        shrink_row(file, values);
    } else {
        memcpy(file->pixels + (ptrdiff_t)file->rows_done * file->image.stride, values,
               raw_image_row_values(&file->image) * sizeof *values);
    }
    file->rows_done++;
    return ERROR_OK;
}

int image_file_take(struct image_file *file, struct raw_image *image, struct message *message) {
    int error = prepare(file, image->width_px, image->height_px, image->layout == RAW_RGB ? 3 : 1,
                        image->bits, image->layout, message);
    struct raw_image from = *image;
    image->release = NULL;
    if (error == ERROR_OK && file->shrink == 1) {
        file->image.data = from.data;
        file->image.stride = from.stride;
        file->image.release = from.release;
        file->image.owner = from.owner;
        for (; error == ERROR_OK && file->rows_done < from.height_px; file->rows_done++) {
            error = check_row(file, raw_image_row(&from, file->rows_done), message);
        }
        return error;
    }
    if (error == ERROR_OK) {
        file->pixels = raw_memory_allocate(&file->image);
        error = file->pixels != NULL ? ERROR_OK : refuse_memory(file, message);
    }
    for (int y = 0; error == ERROR_OK && y < from.height_px; y++) {
        error = image_file_row(file, raw_image_row(&from, y), message);
    }
    raw_image_release(&from);
    return error;
}

/// Copies the pixels of `file`, turned, to `turned`, whose size is given.
static void copy_turned(const struct image_file *file, const struct turn *turn, int width_px,
                        int height_px, uint16_t *turned) {
    const struct raw_image *image = &file->image;
    // Steps in memory from a pixel to its right and lower neighbours in the shown image.
    const ptrdiff_t step_x = turn->mirrors_x ? -file->channels : file->channels;
    const ptrdiff_t step_y = turn->mirrors_y ? -image->stride : image->stride;
    const ptrdiff_t right = turn->swaps ? step_y : step_x, down = turn->swaps ? step_x : step_y;
    const uint16_t *first = image->data +
                            (turn->mirrors_x ? (image->width_px - 1) * file->channels : 0) +
                            (turn->mirrors_y ? (image->height_px - 1) * image->stride : 0);
    for (int y = 0; y < height_px; y++) {
        for (int x = 0; x < width_px; x++) {
            const uint16_t *from = first + y * down + x * right;
            for (int c = 0; c < file->channels; c++) {
                *turned++ = from[c];
            }
        }
    }
}

/// Turns the image in memory to the way it is to be shown.
static int turn_image(struct image_file *file, struct message *message) {
    const struct turn turn = turn_of(file->orientation);
    if (!turn.mirrors_x && !turn.mirrors_y && !turn.swaps) {
        return ERROR_OK;
    }
    struct raw_image *image = &file->image;
    const int width_px = turn.swaps ? image->height_px : image->width_px;
    const int height_px = turn.swaps ? image->width_px : image->height_px;
    struct raw_image turned = *image;
    turned.width_px = width_px;
    turned.height_px = height_px;
    uint16_t *pixels = raw_memory_allocate(&turned);
    if (pixels == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", file->path);
    }
    copy_turned(file, &turn, width_px, height_px, pixels);
    raw_image_release(image);
    *image = turned;
    file->pixels = pixels;
    if (turn.swaps) {
        const int side_px = file->file_width_px;
        file->file_width_px = file->file_height_px;
        file->file_height_px = side_px;
    }
    return ERROR_OK;
}

void image_file_free(struct image_file *file) {
    raw_image_release(&file->image);
    free(file->sums);
    file->pixels = NULL;
    file->sums = NULL;
}

/// Reads the bytes of a whole file, which the caller frees.
static int load_bytes(FILE *stream, const char *path, unsigned char **bytes, size_t *length,
                      struct message *message) {
    struct stat status;
    if (fstat(fileno(stream), &status) != 0) {
        return message_set(message, ERROR_ARGUMENT, "%s: %s", path, strerror(errno));
    }
    if (status.st_size > IMAGE_FILE_MAX_BYTES) {
        return message_set(message, ERROR_TOO_LARGE, "%s: too large for an image file", path);
    }
    *length = (size_t)status.st_size;
    *bytes = malloc(*length + 1);
    if (*bytes == NULL) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", path);
    }
    if (fread(*bytes, 1, *length, stream) != *length) {
        return message_set(message, ERROR_SYNTAX, "%s: cannot be read: %s", path,
                           ferror(stream) ? strerror(errno) : "it was truncated while being read");
    }
    return ERROR_OK;
}

int image_file_load(const char *path, image_file_parser *parse, struct image_file *file,
                    struct message *message) {
    FILE *stream = input_file_open(path, message);
    if (stream == NULL) {
        return ERROR_ARGUMENT;
    }
    unsigned char *bytes = NULL;
    size_t length = 0;
    int error = load_bytes(stream, path, &bytes, &length, message);
    fclose(stream);
    if (error == ERROR_OK) {
        error = parse(bytes, length, file, message);
    }
    free(bytes);
    return error;
}

static bool has_extension(const char *path, const char *extensions) {
    const char *dot = strrchr(path, '.');
    if (dot == NULL) {
        return false;
    }
    const size_t length = strlen(dot + 1);
    for (const char *at = extensions; *at != '\0' && length > 0;) {
        const size_t word = strcspn(at, " ");
        if (word == length && strncasecmp(at, dot + 1, length) == 0) {
            return true;
        }
        at += word + strspn(at + word, " ");
    }
    return false;
}

/// Decides by the contents; by the name only for formats without a signature.
static const struct image_format *find_format(const char *path, const unsigned char *head,
                                              size_t head_length,
                                              const struct image_format *formats,
                                              int format_count) {
    for (int i = 0; i < format_count; i++) {
        if (formats[i].probe != NULL && formats[i].probe(head, head_length)) {
            return &formats[i];
        }
    }
    for (int i = 0; i < format_count; i++) {
        if (formats[i].probe == NULL && has_extension(path, formats[i].extensions)) {
            return &formats[i];
        }
    }
    return NULL;
}

static int refuse_format(const char *path, const struct image_format *formats, int format_count,
                         struct message *message) {
    char names[128] = "";
    for (int i = 0; i < format_count; i++) {
        const size_t used = strlen(names);
        snprintf(names + used, sizeof names - used, "%s%s", i > 0 ? ", " : "", formats[i].name);
    }
    return message_set(message, ERROR_SYNTAX, "%s: unknown image format (expected %s)", path,
                       names);
}

int image_file_read(const char *path, const struct image_format *formats, int format_count,
                    const struct image_request *request, struct image_file *file,
                    struct message *message) {
    unsigned char head[IMAGE_FILE_HEAD_BYTES];
    size_t head_length = 0;
    int error = input_file_read(path, head, sizeof head, &head_length, message);
    if (error != ERROR_OK) {
        return error;
    }
    const struct image_format *format = find_format(path, head, head_length, formats, format_count);
    if (format == NULL) {
        return refuse_format(path, formats, format_count, message);
    }
    memset(file, 0, sizeof *file);
    file->path = path;
    file->request = request;
    error = format->read(path, request, file, message);
    if (error == ERROR_OK) {
        INVARIANT(file->rows_done == file->file_height_px);
        error = turn_image(file, message);
    }
    if (error == ERROR_OK) {
        free(file->sums);
        file->sums = NULL;
    } else {
        image_file_free(file);
    }
    return error;
}
