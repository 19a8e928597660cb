// SPDX-License-Identifier: Apache-2.0
/// What the daemon's streaming writer writes, as a document.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_JSON_OF_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_JSON_OF_HPP

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>

#include "daemon/base/json.h"

/// The object whose members `write(struct json *)` writes. Throws std::bad_alloc.
template <class Write>
nlohmann::ordered_json json_of(const Write &write) {
    char *text = nullptr;
    std::size_t bytes = 0;
    FILE *stream = open_memstream(&text, &bytes);
    if (stream == nullptr) {
        throw std::bad_alloc();
    }
    struct json out;
    json_begin(&out, stream);
    json_open_object(&out, nullptr);
    write(&out);
    json_close_object(&out);
    json_end(&out);
    std::fclose(stream);
    const std::unique_ptr<char, void (*)(void *)> owner(text, std::free);
    return nlohmann::ordered_json::parse(text, text + bytes);
}

#endif
