// SPDX-License-Identifier: Apache-2.0
#include "tools/host/debug/debug.hpp"

#include <new>
#include <vector>

#include "core/error.h"
#include "tools/host/debug/debug_page.hpp"
#include "tools/host/debug/debug_pictures.hpp"
#include "tools/host/formats/write_png.hpp"

namespace {

constexpr const char *page_name = "debug.html";

void *begin(reconstruct_options *options, int row) {
    auto *look = new (std::nothrow) debug_look(row);
    if (look != nullptr) {
        options->kernels = look->kernels();
    }
    return look;
}

void end(void *self) {
    delete static_cast<debug_look *>(self);
}

int write_all(const debug_look &look, const reconstruct_context &context,
              const atomic_dir &directory, message *message) {
    debug_page page(look, context);
    char path[ATOMIC_DIR_PATH_BYTES];
    const int error = debug_pictures_draw(look, context, [&](const debug_picture &picture) {
        page.add(picture);
        atomic_dir_file_path(&directory, picture.file_name, path);
        return write_png_palette(picture.width_px, picture.height_px, picture.indices,
                                 picture.palette, path, message);
    });
    if (error != ERROR_OK) {
        return error;
    }
    atomic_dir_file_path(&directory, page_name, path);
    return page.write(path, message);
}

int write(void *self, const reconstruct_context *context, const atomic_dir *directory,
          message *message) {
    const debug_look &look = *static_cast<debug_look *>(self);
    // Called from C: must not throw.
    try {
        if (!look.failed()) {
            return write_all(look, *context, *directory, message);
        }
    } catch (const std::bad_alloc &) {
    }
    return message_set(message, ERROR_MEMORY, "out of memory for pictures of the matching");
}

}  // namespace

const reconstruct_debug_maker *debug_maker() {
    static const std::vector<const char *> names = [] {
        std::vector<const char *> all = debug_pictures_names();
        all.push_back(page_name);
        return all;
    }();
    static const reconstruct_debug_maker maker = {names.data(), static_cast<int>(names.size()),
                                                  begin, write, end};
    return &maker;
}
