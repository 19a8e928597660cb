// SPDX-License-Identifier: Apache-2.0
#include "tools/host/view/view_jpeg.hpp"

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

// After <cstdio>: the library's header needs FILE and size_t.
#include <jpeglib.h>

#include "tools/host/view/view_source.hpp"

namespace {

/// Plain data only: a longjmp out of the library skips destructors. `manager` is first, so that the
/// library's pointer to it is a pointer to this.
struct job {
    jpeg_error_mgr manager;
    std::jmp_buf jump;
    unsigned char *bytes;
    unsigned long length;
};

[[noreturn]] void on_error(j_common_ptr jpeg) {
    std::longjmp(reinterpret_cast<job *>(jpeg->err)->jump, 1);
}

bool compress(const view_picture &picture, job *self) {
    constexpr int quality = 88;
    jpeg_compress_struct jpeg{};
    jpeg.err = jpeg_std_error(&self->manager);
    self->manager.error_exit = on_error;
    if (setjmp(self->jump) != 0) {
        jpeg_destroy_compress(&jpeg);
        return false;
    }
    jpeg_create_compress(&jpeg);
    jpeg_mem_dest(&jpeg, &self->bytes, &self->length);
    jpeg.image_width = static_cast<JDIMENSION>(picture.width_px);
    jpeg.image_height = static_cast<JDIMENSION>(picture.height_px);
    jpeg.input_components = picture.channels;
    jpeg.in_color_space = picture.channels == 3 ? JCS_RGB : JCS_GRAYSCALE;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, quality, TRUE);
    jpeg.dct_method = JDCT_IFAST;
    jpeg_start_compress(&jpeg, TRUE);
    const std::size_t row_bytes = static_cast<std::size_t>(picture.width_px * picture.channels);
    while (jpeg.next_scanline < jpeg.image_height) {
        // The library does not write to it.
        auto *row = const_cast<JSAMPROW>(picture.pixels.data() + jpeg.next_scanline * row_bytes);
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    return true;
}

}  // namespace

bool view_jpeg_make(view_picture *picture) {
    job self{};
    const bool made = compress(*picture, &self);
    if (made) {
        picture->jpeg.assign(self.bytes, self.bytes + self.length);
    }
    std::free(self.bytes);
    return made;
}
