// SPDX-License-Identifier: Apache-2.0
#include <png.h>

#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "core/error.h"
#include "tools/host/formats/image_formats.hpp"

namespace {

/// Bytes of an interlaced image, which has to be decoded as a whole.
constexpr size_t interlaced_max_bytes = size_t{1} << 30;

/// Everything that must survive a longjmp out of libpng. Plain data only: a longjmp skips
/// destructors.
struct png_job {
    image_file *file;
    message *text;
    FILE *stream;
    png_structp png;
    png_infop info;
    unsigned char *bytes;  // one row, or all rows of an interlaced image
    uint16_t *row;
    int error;
};

[[noreturn]] void on_error(png_structp png, png_const_charp what) {
    auto *job = static_cast<png_job *>(png_get_error_ptr(png));
    job->error = message_set(job->text, ERROR_SYNTAX, "%s: damaged or truncated PNG (%s)",
                             job->file->path, what);
    png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

[[noreturn]] void give_up(png_job *job, int error) {
    job->error = error;
    png_longjmp(job->png, 1);
}

/// Makes libpng deliver 8 or 16 bit grey or colour without alpha, in the native byte order.
void set_transformations(png_job *job) {
    const png_byte type = png_get_color_type(job->png, job->info);
    if (type == PNG_COLOR_TYPE_PALETTE && job->file->request->indices) {
        png_set_packing(job->png);
    } else if (type == PNG_COLOR_TYPE_PALETTE) {
        png_set_palette_to_rgb(job->png);
    } else if (type == PNG_COLOR_TYPE_GRAY && png_get_bit_depth(job->png, job->info) < 8) {
        png_set_expand_gray_1_2_4_to_8(job->png);
    }
    // Drops alpha channels and the alpha of transparent palette colours.
    png_set_strip_alpha(job->png);
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    png_set_swap(job->png);
#endif
}

void deliver(png_job *job, const unsigned char *bytes, size_t count, bool wide) {
    if (wide) {
        std::memcpy(job->row, bytes, count * sizeof *job->row);
    } else {
        for (size_t i = 0; i < count; i++) {
            job->row[i] = bytes[i];
        }
    }
    const int error = image_file_row(job->file, job->row, job->text);
    if (error != ERROR_OK) {
        give_up(job, error);
    }
}

void allocate(png_job *job, size_t row_bytes, size_t rows, size_t count) {
    if (rows > 1 && row_bytes > interlaced_max_bytes / rows) {
        give_up(job, message_set(job->text, ERROR_TOO_LARGE,
                                 "%s: an interlaced PNG of this size cannot be read; save it "
                                 "without interlacing",
                                 job->file->path));
    }
    job->bytes = static_cast<unsigned char *>(std::calloc(rows, row_bytes));
    job->row = static_cast<uint16_t *>(std::malloc(count * sizeof *job->row));
    if (job->bytes == nullptr || job->row == nullptr) {
        give_up(job, message_set(job->text, ERROR_MEMORY, "%s: out of memory", job->file->path));
    }
}

/// From an eXIf chunk before the pixels.
int orientation_of(png_job *job) {
#ifdef PNG_eXIf_SUPPORTED
    png_uint_32 length = 0;
    png_bytep exif = nullptr;
    if (png_get_eXIf_1(job->png, job->info, &length, &exif) != 0) {
        return exif_orientation(exif, length);
    }
#endif
    return 0;
}

void read_rows(png_job *job) {
    const png_uint_32 width = png_get_image_width(job->png, job->info);
    const png_uint_32 height = png_get_image_height(job->png, job->info);
    const bool interlaced = png_get_interlace_type(job->png, job->info) != PNG_INTERLACE_NONE;
    set_transformations(job);
    job->file->orientation = orientation_of(job);
    const int passes = interlaced ? png_set_interlace_handling(job->png) : 1;
    png_read_update_info(job->png, job->info);
    const int channels = png_get_channels(job->png, job->info);
    const bool wide = png_get_bit_depth(job->png, job->info) == 16;
    const int error =
        image_file_begin(job->file, static_cast<int>(width), static_cast<int>(height), channels,
                         wide ? 16 : 8, channels == 3 ? RAW_RGB : RAW_GREY, job->text);
    if (error != ERROR_OK) {
        give_up(job, error);
    }
    const size_t row_bytes = png_get_rowbytes(job->png, job->info);
    const size_t count = size_t{width} * static_cast<size_t>(channels);
    allocate(job, row_bytes, interlaced ? height : 1, count);
    for (int pass = 1; pass < passes; pass++) {
        for (png_uint_32 y = 0; y < height; y++) {
            png_read_row(job->png, job->bytes + y * row_bytes, nullptr);
        }
    }
    for (png_uint_32 y = 0; y < height; y++) {
        unsigned char *bytes = job->bytes + (interlaced ? y * row_bytes : 0);
        png_read_row(job->png, bytes, nullptr);
        deliver(job, bytes, count, wide);
    }
    png_read_end(job->png, nullptr);
}

void read_png(png_job *job) {
    job->png = png_create_read_struct(PNG_LIBPNG_VER_STRING, job, on_error, on_warning);
    job->info = job->png != nullptr ? png_create_info_struct(job->png) : nullptr;
    if (job->info == nullptr) {
        job->error = message_set(job->text, ERROR_MEMORY, "%s: out of memory", job->file->path);
        return;
    }
    if (setjmp(png_jmpbuf(job->png)) == 0) {
        png_set_user_limits(job->png, IMAGE_FILE_MAX_SIDE_PX, IMAGE_FILE_MAX_SIDE_PX);
        png_set_chunk_malloc_max(job->png, 16 << 20);
        png_init_io(job->png, job->stream);
        png_read_info(job->png, job->info);
        read_rows(job);
    }
}

}  // namespace

bool image_png_probe(const unsigned char *head, size_t length) {
    return length >= 8 && png_sig_cmp(head, 0, 8) == 0;
}

int image_png_read(const char *path, const image_request *, image_file *file, message *message) {
    png_job job{};
    job.file = file;
    job.text = message;
    job.stream = std::fopen(path, "rb");
    if (job.stream == nullptr) {
        return message_set(message, ERROR_ARGUMENT, "%s: %s", path, std::strerror(errno));
    }
    read_png(&job);
    png_destroy_read_struct(&job.png, &job.info, nullptr);
    std::free(job.bytes);
    std::free(job.row);
    std::fclose(job.stream);
    return job.error;
}
