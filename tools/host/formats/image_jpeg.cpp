// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tools/host/formats/image_formats.hpp"

// After <cstdio>: the library's header needs FILE and size_t.
#include <jerror.h>
#include <jpeglib.h>

#include "core/error.h"
#include "daemon/base/process.h"

namespace {

/// Maximum number of scans, more than any camera writes: a file of a few kB could keep the decoder
/// busy for hours.
constexpr int max_scans = 200;

/// Plain data only: a longjmp out of the library skips destructors. `manager` is first, so that the
/// library's pointer to it is a pointer to this.
struct jpeg_job {
    jpeg_error_mgr manager;
    std::jmp_buf jump;
    jpeg_progress_mgr progress;
    image_file *file;
    message *text;
    uint16_t *row;
    unsigned char *bytes;
    int error;
};

jpeg_job *job_of(j_common_ptr jpeg) {
    return reinterpret_cast<jpeg_job *>(jpeg->err);
}

[[noreturn]] void give_up(jpeg_job *job, int error) {
    job->error = error;
    std::longjmp(job->jump, 1);
}

[[noreturn]] void on_error(j_common_ptr jpeg) {
    jpeg_job *job = job_of(jpeg);
    char what[JMSG_LENGTH_MAX];
    jpeg->err->format_message(jpeg, what);
    const bool memory = jpeg->err->msg_code == JERR_OUT_OF_MEMORY;
    give_up(job, message_set(job->text, memory ? ERROR_MEMORY : ERROR_SYNTAX,
                             "%s: damaged or unsupported JPEG (%s)", job->file->path, what));
}

/// The library calls this wherever it would repair data by guessing.
void on_message(j_common_ptr jpeg, int level) {
    if (level < 0 && jpeg->err->msg_code != JWRN_EXTRANEOUS_DATA) {
        on_error(jpeg);
    }
}

void on_progress(j_common_ptr jpeg) {
    jpeg_job *job = job_of(jpeg);
    const auto *decoder = reinterpret_cast<j_decompress_ptr>(jpeg);
    if (decoder->input_scan_number > max_scans) {
        give_up(job,
                message_set(job->text, ERROR_SYNTAX, "%s: too many scans in a JPEG (at most %d)",
                            job->file->path, max_scans));
    }
    if (interrupt_requested()) {
        give_up(job, message_set(job->text, ERROR_CANCELLED, "interrupted; nothing was written"));
    }
}

void set_up(jpeg_job *job) {
    jpeg_std_error(&job->manager);
    job->manager.error_exit = on_error;
    job->manager.emit_message = on_message;
    job->progress.progress_monitor = on_progress;
}

void choose_colours(jpeg_decompress_struct *jpeg, jpeg_job *job) {
    switch (jpeg->jpeg_color_space) {
        case JCS_GRAYSCALE:
            jpeg->out_color_space = JCS_GRAYSCALE;
            return;
        case JCS_RGB:
        case JCS_YCbCr:
            jpeg->out_color_space = JCS_RGB;
            return;
        default:
            give_up(job, message_set(job->text, ERROR_SYNTAX,
                                     "%s: unsupported colours (CMYK or unknown); save it "
                                     "as RGB",
                                     job->file->path));
    }
}

/// From the first APP1 marker with EXIF.
int orientation_of(const jpeg_decompress_struct &jpeg) {
    static const unsigned char mark[] = {'E', 'x', 'i', 'f', 0, 0};
    for (const jpeg_marker_struct *marker = jpeg.marker_list; marker != nullptr;
         marker = marker->next) {
        if (marker->data_length >= sizeof mark &&
            std::memcmp(marker->data, mark, sizeof mark) == 0) {
            return exif_orientation(marker->data + sizeof mark, marker->data_length - sizeof mark);
        }
    }
    return 0;
}

void read_rows(jpeg_decompress_struct *jpeg, jpeg_job *job) {
    jpeg_save_markers(jpeg, JPEG_APP0 + 1, 0xffff);
    jpeg_read_header(jpeg, TRUE);
    job->file->orientation = orientation_of(*jpeg);
    choose_colours(jpeg, job);
    const int channels = jpeg->out_color_space == JCS_RGB ? 3 : 1;
    const int error = image_file_begin(job->file, static_cast<int>(jpeg->image_width),
                                       static_cast<int>(jpeg->image_height), channels, 8,
                                       channels == 3 ? RAW_RGB : RAW_GREY, job->text);
    if (error != ERROR_OK) {
        give_up(job, error);
    }
    const size_t count = size_t{jpeg->image_width} * static_cast<size_t>(channels);
    job->bytes = static_cast<unsigned char *>(std::malloc(count));
    job->row = static_cast<uint16_t *>(std::malloc(count * sizeof *job->row));
    if (job->bytes == nullptr || job->row == nullptr) {
        give_up(job, message_set(job->text, ERROR_MEMORY, "%s: out of memory", job->file->path));
    }
    jpeg_start_decompress(jpeg);
    while (jpeg->output_scanline < jpeg->output_height) {
        jpeg_read_scanlines(jpeg, &job->bytes, 1);
        for (size_t i = 0; i < count; i++) {
            job->row[i] = job->bytes[i];
        }
        const int row_error = image_file_row(job->file, job->row, job->text);
        if (row_error != ERROR_OK) {
            give_up(job, row_error);
        }
    }
    jpeg_finish_decompress(jpeg);
}

/// State of the encoder that must survive a longjmp.
struct encoding {
    jpeg_job job;
    unsigned char *bytes;
    unsigned long length;
};

bool encode(const image_rgb8 &image, int quality, encoding *work) {
    jpeg_compress_struct jpeg{};
    set_up(&work->job);
    jpeg.err = &work->job.manager;
    if (setjmp(work->job.jump) != 0) {
        jpeg_destroy_compress(&jpeg);
        return false;
    }
    jpeg_create_compress(&jpeg);
    jpeg_mem_dest(&jpeg, &work->bytes, &work->length);
    jpeg.image_width = static_cast<JDIMENSION>(image.width);
    jpeg.image_height = static_cast<JDIMENSION>(image.height);
    jpeg.input_components = 3;
    jpeg.in_color_space = JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, quality, TRUE);
    jpeg_start_compress(&jpeg, TRUE);
    while (jpeg.next_scanline < jpeg.image_height) {
        JSAMPROW row = image_rgb8_row(&image, static_cast<int>(jpeg.next_scanline));
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    return true;
}

}  // namespace

bool image_jpeg_probe(const unsigned char *head, size_t length) {
    return length >= 3 && head[0] == 0xff && head[1] == 0xd8 && head[2] == 0xff;
}

int image_jpeg_read(const char *path, const image_request *, image_file *file, message *message) {
    jpeg_job job{};
    job.file = file;
    job.text = message;
    FILE *stream = std::fopen(path, "rb");
    if (stream == nullptr) {
        return message_set(message, ERROR_ARGUMENT, "%s: %s", path, std::strerror(errno));
    }
    jpeg_decompress_struct jpeg{};
    set_up(&job);
    jpeg.err = &job.manager;
    if (setjmp(job.jump) == 0) {
        jpeg_create_decompress(&jpeg);
        jpeg.progress = &job.progress;
        jpeg_stdio_src(&jpeg, stream);
        read_rows(&jpeg, &job);
    }
    jpeg_destroy_decompress(&jpeg);
    std::free(job.bytes);
    std::free(job.row);
    std::fclose(stream);
    return job.error;
}

std::vector<unsigned char> image_jpeg_encode(const image_rgb8 &image, int quality) {
    image_file nameless{};
    nameless.path = "texture";
    message ignored{};
    encoding work{};
    work.job.file = &nameless;
    work.job.text = &ignored;
    std::vector<unsigned char> result;
    if (encode(image, quality, &work)) {
        result.assign(work.bytes, work.bytes + work.length);
    }
    std::free(work.bytes);
    return result;
}
