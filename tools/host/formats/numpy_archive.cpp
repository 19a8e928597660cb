// SPDX-License-Identifier: Apache-2.0
#include "tools/host/formats/numpy_archive.hpp"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace {

const size_t numbers_max = 4096, header_max = 4096;
const size_t array_bytes_max = 64 + header_max + 8 * numbers_max;
const size_t members_max = 256, name_bytes_max = 64;
const size_t end_bytes = 22, entry_bytes = 46, local_bytes = 30;

/// A little-endian number of `count` bytes; the caller has checked that they are there.
uint64_t whole_at(const std::string &bytes, size_t at, int count) {
    uint64_t value = 0;
    for (int i = count - 1; i >= 0; i--) {
        value = value << 8 | static_cast<unsigned char>(bytes[at + static_cast<size_t>(i)]);
    }
    return value;
}

bool has(const std::string &bytes, size_t at, size_t count) {
    return at <= bytes.size() && count <= bytes.size() - at;
}

/// Inflates the beginning of a raw deflate stream, `count` bytes or less.
std::string inflated(const std::string &packed, size_t count) {
    std::string text(count, '\0');
    z_stream stream;
    std::memset(&stream, 0, sizeof stream);
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) {
        return "";
    }
    std::string input = packed;
    stream.next_in = reinterpret_cast<unsigned char *>(input.data());
    stream.avail_in = static_cast<unsigned>(input.size());
    stream.next_out = reinterpret_cast<unsigned char *>(text.data());
    stream.avail_out = static_cast<unsigned>(text.size());
    const int code = inflate(&stream, Z_SYNC_FLUSH);
    text.resize(code == Z_OK || code == Z_STREAM_END || code == Z_BUF_ERROR ? stream.total_out : 0);
    inflateEnd(&stream);
    return text;
}

/// What follows `'key':` in the header, up to `end`; "" if it is not there.
std::string header_value(const std::string &header, const std::string &key, char end) {
    const size_t at = header.find("'" + key + "':");
    if (at == std::string::npos) {
        return "";
    }
    const size_t begin = at + key.size() + 3;
    return header.substr(begin, std::min(header.find(end, begin), header.size()) - begin);
}

/// One number of a type such as <f8, |u1 or >i4.
double number_at(const std::string &bytes, size_t at, const std::string &type) {
    const char kind = type[1];
    const int size = type[2] - '0';
    std::string one = bytes.substr(at, static_cast<size_t>(size));
    if (type[0] == '>') {
        std::reverse(one.begin(), one.end());
    }
    const uint64_t bits = whole_at(one, 0, size);
    if (kind == 'f' && size == 8) {
        double value;
        std::memcpy(&value, &bits, sizeof value);
        return value;
    }
    if (kind == 'f') {
        const uint32_t half = static_cast<uint32_t>(bits);
        float value;
        std::memcpy(&value, &half, sizeof value);
        return value;
    }
    if (kind == 'i' && size < 8 && (bits >> (8 * size - 1) & 1) != 0) {
        return static_cast<double>(bits) - static_cast<double>(uint64_t{1} << (8 * size));
    }
    return kind == 'i' ? static_cast<double>(static_cast<int64_t>(bits))
                       : static_cast<double>(bits);
}

/// The lengths in a text like " (3, 3)"; false for anything else.
bool read_shape(const std::string &text, std::vector<long> *shape) {
    size_t at = text.find('(');
    if (at == std::string::npos) {
        return false;
    }
    at++;
    while (at < text.size()) {
        if (text[at] == ' ' || text[at] == ',') {
            at++;
            continue;
        }
        char *end = nullptr;
        const long length = std::strtol(text.c_str() + at, &end, 10);
        if (end == text.c_str() + at || length < 0 || shape->size() == 8) {
            return false;
        }
        shape->push_back(length);
        at = static_cast<size_t>(end - text.c_str());
    }
    return true;
}

/// The text of an array's header and where its numbers begin; false if damaged.
bool read_header(const std::string &bytes, std::string *header, size_t *begin) {
    if (!numpy_array_matches(bytes) || !has(bytes, 8, 4)) {
        return false;
    }
    const int length_bytes = bytes[6] == 1 ? 2 : 4;
    const size_t length = whole_at(bytes, 8, length_bytes);
    const size_t from = 8 + static_cast<size_t>(length_bytes);
    if (length > header_max || !has(bytes, from, length)) {
        return false;
    }
    *header = bytes.substr(from, length);
    *begin = from + length;
    return true;
}

/// The type of the numbers as the header names it, such as <f8, |u1 or >i4; structured types are
/// cut off at their first comma.
std::string type_of(const std::string &header) {
    const std::string type = header_value(header, "descr", ',');
    const size_t begin = type.find_first_not_of(" '[(");
    return begin == std::string::npos ? ""
                                      : type.substr(begin, type.find_last_not_of(" '") + 1 - begin);
}

bool is_real(const std::string &type) {
    return type.size() == 3 && std::strchr("<>|", type[0]) != nullptr &&
           (type[1] == 'f'
                ? type[2] == '4' || type[2] == '8'
                : std::strchr("iu", type[1]) != nullptr && std::strchr("1248", type[2]) != nullptr);
}

/// The product of the lengths, at most one more than `numbers_max`.
size_t count_of(const std::vector<long> &shape) {
    size_t count = 1;
    for (const long one : shape) {
        count *= std::min(static_cast<size_t>(one), numbers_max + 1);
        count = std::min(count, numbers_max + 1);
    }
    return count;
}

/// The numbers of an array in numpy's format. One of another kind keeps none; false if damaged.
bool read_array(const std::string &bytes, numpy_array *array) {
    std::string header;
    size_t begin = 0;
    if (!read_header(bytes, &header, &begin) ||
        !read_shape(header_value(header, "shape", ')'), &array->shape)) {
        return false;
    }
    array->type = type_of(header);
    const size_t count = count_of(array->shape);
    if (!is_real(array->type) || count > numbers_max) {
        return true;
    }
    const size_t size = static_cast<size_t>(array->type[2] - '0');
    if (!has(bytes, begin, count * size)) {
        return false;
    }
    const bool by_columns =
        header_value(header, "fortran_order", ',').find("True") != std::string::npos &&
        array->shape.size() == 2;
    const size_t rows = by_columns ? static_cast<size_t>(array->shape[0]) : 1;
    const size_t columns = by_columns ? static_cast<size_t>(array->shape[1]) : 1;
    for (size_t i = 0; i < count; i++) {
        const size_t from = by_columns ? i % columns * rows + i / columns : i;
        array->numbers.push_back(number_at(bytes, begin + from * size, array->type));
    }
    return true;
}

/// The member that an entry of the zip's directory describes; false if damaged.
bool read_member(const std::string &bytes, size_t entry, std::string *member) {
    const uint64_t method = whole_at(bytes, entry + 10, 2);
    const size_t packed = whole_at(bytes, entry + 20, 4);
    const size_t local = whole_at(bytes, entry + 42, 4);
    if (!has(bytes, local, local_bytes) || (method != 0 && method != 8)) {
        return false;
    }
    const size_t begin =
        local + local_bytes + whole_at(bytes, local + 26, 2) + whole_at(bytes, local + 28, 2);
    if (!has(bytes, begin, packed)) {
        return false;
    }
    *member = method == 0 ? bytes.substr(begin, std::min(packed, array_bytes_max))
                          : inflated(bytes.substr(begin, packed), array_bytes_max);
    // Of one that is longer only the beginning was read.
    return whole_at(bytes, entry + 24, 4) > array_bytes_max ||
           crc32(0, reinterpret_cast<const unsigned char *>(member->data()),
                 static_cast<unsigned>(member->size())) == whole_at(bytes, entry + 16, 4);
}

bool is_plain(const std::string &name) {
    return name.size() <= name_bytes_max &&
           std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c <= '~'; });
}

/// Adds the array of an entry of the zip's directory; another member is skipped.
bool read_entry(const std::string &bytes, size_t entry, const std::string &name,
                std::vector<numpy_array> *arrays, std::string *reason) {
    const size_t stem = name.size() < 4 ? 0 : name.size() - 4;
    if (name.compare(stem, 4, ".npy") != 0) {
        return true;
    }
    numpy_array array{name.substr(0, stem), "", {}, {}};
    std::string member;
    if (!is_plain(array.name)) {
        *reason += ": the name of an array is damaged";
        return false;
    }
    if (!read_member(bytes, entry, &member) || !read_array(member, &array)) {
        *reason += ": " + array.name + " is damaged";
        return false;
    }
    arrays->push_back(array);
    return true;
}

}  // namespace

bool numpy_archive_matches(const std::string &bytes) {
    return bytes.compare(0, 4, "PK\3\4") == 0;
}

bool numpy_array_matches(const std::string &bytes) {
    return bytes.compare(0, 6, "\x93NUMPY") == 0;
}

bool numpy_archive_read(const std::string &bytes, std::vector<numpy_array> *arrays,
                        std::string *reason) {
    *reason = "not a complete zip of numpy's arrays (.npz)";
    const size_t end = bytes.rfind("PK\5\6");
    if (end == std::string::npos || !has(bytes, end, end_bytes)) {
        return false;
    }
    size_t at = whole_at(bytes, end + 16, 4);
    uint64_t left = whole_at(bytes, end + 10, 2);
    if (left > members_max) {
        *reason = "a zip of more files than a calibration has";
        return false;
    }
    for (; left > 0; left--) {
        if (!has(bytes, at, entry_bytes) || bytes.compare(at, 4, "PK\1\2") != 0) {
            return false;
        }
        const size_t name_bytes = whole_at(bytes, at + 28, 2);
        if (!has(bytes, at + entry_bytes, name_bytes)) {
            return false;
        }
        if (!read_entry(bytes, at, bytes.substr(at + entry_bytes, name_bytes), arrays, reason)) {
            return false;
        }
        at += entry_bytes + name_bytes + whole_at(bytes, at + 30, 2) + whole_at(bytes, at + 32, 2);
    }
    if (arrays->empty()) {
        *reason = "a zip without arrays of numpy: unpack it, and name the calibration in it";
        return false;
    }
    return true;
}
