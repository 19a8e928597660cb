// SPDX-License-Identifier: Apache-2.0
#include "tools/host/recordings/pair_source.hpp"

#include <dirent.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "core/error.h"
#include "daemon/base/raw_memory.h"
#include "daemon/files/file_io.h"
#include "tools/host/formats/image_formats.hpp"

namespace {

constexpr size_t nanosecond_digits = 15;  // more than seconds or numbers of frames have

bool is_image(const std::string &name) {
    const size_t dot = name.rfind('.');
    if (dot == std::string::npos || dot == 0) {
        return false;
    }
    std::string extension = name.substr(dot + 1);
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
    static const char *const known[] = {"png", "jpg", "jpeg", "pgm", "ppm", "pnm", "tif", "tiff"};
    return std::find(std::begin(known), std::end(known), extension) != std::end(known);
}

}  // namespace

owned_image pair_source_read(const std::string &path, const std::string &name) {
    image_request request{};
    request.scale = 1;
    image_file file{};
    message why{};
    const image_format_list formats = image_formats();
    const int code =
        image_file_read(path.c_str(), formats.first, formats.count, &request, &file, &why);
    if (code != ERROR_OK) {
        std::string text = why.text;
        const size_t at = text.find(path);
        throw import_failure{code,
                             at == std::string::npos ? text : text.replace(at, path.size(), name)};
    }
    owned_image made(file.image);
    made.image.release = nullptr;
    uint16_t *const pixels = raw_memory_allocate(&made.image);
    if (pixels != nullptr) {
        const size_t row_values = raw_image_row_values(&file.image);
        for (int y = 0; y < file.image.height_px; y++) {
            std::memcpy(pixels + static_cast<size_t>(y) * row_values, raw_image_row(&file.image, y),
                        row_values * sizeof *pixels);
        }
    }
    image_file_free(&file);
    if (pixels == nullptr) {
        throw import_failure{ERROR_MEMORY, name + ": out of memory"};
    }
    return made;
}

owned_image pair_source_decode(const std::string &data, const std::string &name) {
    const int fd = memfd_create("image", MFD_CLOEXEC);
    if (fd < 0 || !write_all(fd, data.data(), data.size())) {
        close(fd);
        throw import_failure{ERROR_MEMORY, name + ": out of memory"};
    }
    try {
        owned_image made = pair_source_read("/proc/self/fd/" + std::to_string(fd), name);
        close(fd);
        return made;
    } catch (...) {
        close(fd);
        throw;
    }
}

image_names pair_source_list(const std::string &directory) {
    std::vector<std::string> names;
    DIR *const stream = opendir(directory.c_str());
    if (stream == nullptr) {
        throw import_failure{ERROR_ARGUMENT, directory + ": " + std::strerror(errno)};
    }
    while (const dirent *const entry = readdir(stream)) {
        if (is_image(entry->d_name)) {
            names.push_back(entry->d_name);
        }
    }
    closedir(stream);
    if (names.empty()) {
        throw import_failure{ERROR_MISSING, directory + ": has no images"};
    }
    std::sort(names.begin(), names.end());
    image_names list;
    for (const std::string &name : names) {
        list.paths.push_back(directory + "/" + name);
        list.stems.push_back(name.substr(0, name.rfind('.')));
    }
    return list;
}

bool pair_source_time(const std::string &stem, uint64_t *time_ns) {
    const size_t dot = stem.find('.');
    const std::string whole = stem.substr(0, dot);
    std::string decimals = dot == std::string::npos ? "" : stem.substr(dot + 1);
    const auto digits = [](const std::string &text) {
        return text.find_first_not_of("0123456789") == std::string::npos;
    };
    if (whole.empty() || !digits(whole) || !digits(decimals) || whole.size() > 19) {
        return false;
    }
    if (dot == std::string::npos) {
        *time_ns = std::strtoull(whole.c_str(), nullptr, 10);
        return whole.size() >= nanosecond_digits;
    }
    decimals.resize(9, '0');
    *time_ns = std::strtoull(whole.c_str(), nullptr, 10) * 1000000000u +
               std::strtoull(decimals.c_str(), nullptr, 10);
    return !decimals.empty() && whole.size() <= 10;
}
