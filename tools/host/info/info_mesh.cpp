// SPDX-License-Identifier: Apache-2.0
/// Point clouds and meshes: PLY (G. Turk, "The PLY Polygon File Format", 1994), PCD 0.7 (Point
/// Cloud Library) and binary glTF 2.0 (Khronos). Only what is needed to count and to measure
/// extents.
#include <cstring>
#include <fstream>
#include <sstream>

#include "tools/host/formats/json_limited.hpp"
#include "tools/host/info/info.hpp"

namespace {

using json = nlohmann::ordered_json;

bool damaged(const std::string &path, const std::string &what, std::string *message) {
    *message = path + ": " + what;
    return false;
}

std::vector<std::string> words_of(const std::string &line) {
    std::istringstream stream(line);
    std::vector<std::string> words;
    for (std::string word; stream >> word;) {
        words.push_back(word);
    }
    return words;
}

/// One header line without its line end; false at the end of the file or for an excessively long
/// line.
bool header_line(std::ifstream *stream, std::string *line) {
    line->clear();
    for (char c; stream->get(c);) {
        if (c == '\n') {
            if (!line->empty() && line->back() == '\r') {
                line->pop_back();
            }
            return true;
        }
        line->push_back(c);
        if (line->size() > 4096) {
            return false;
        }
    }
    return false;
}

/// A count in a header: digits only, at most 2^32.
bool parse_count(const std::string &text, std::uint64_t *count) {
    if (text.empty() || text.size() > 10 ||
        text.find_first_not_of("0123456789") != std::string::npos) {
        return false;
    }
    *count = std::stoull(text);
    return true;
}

double float_at(const char *bytes) {  // hosts are little-endian, like the files
    float value;
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
}

struct property {
    std::string name, type, count_type;  // count_type: of a list
    size_t bytes = 0, offset = 0;
};

struct element {
    std::string name;
    std::uint64_t count = 0;
    std::vector<property> properties;
};

size_t type_bytes(const std::string &type) {
    static const struct {
        const char *name;
        size_t bytes;
    } types[] = {{"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1},
                 {"short", 2}, {"ushort", 2},  {"int16", 2},  {"uint16", 2},
                 {"int", 4},   {"uint", 4},    {"int32", 4},  {"uint32", 4},
                 {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};
    for (const auto &candidate : types) {
        if (type == candidate.name) {
            return candidate.bytes;
        }
    }
    return 0;
}

struct ply {
    std::string format;
    std::vector<std::string> comments;
    std::vector<element> elements;
};

bool add_element(const std::vector<std::string> &words, ply *result) {
    element added;
    added.name = words[1];
    if (!parse_count(words[2], &added.count)) {
        return false;
    }
    result->elements.push_back(added);
    return true;
}

bool add_property(const std::vector<std::string> &words, std::vector<property> *all) {
    property added;
    const bool list = words[1] == "list";
    added.name = words.back();
    added.type = words[list && words.size() == 5 ? 3 : 1];
    added.count_type = list ? words[2] : "";
    added.bytes = type_bytes(added.type);
    added.offset = all->empty() ? 0 : all->back().offset + all->back().bytes;
    if (added.bytes == 0 || (list && type_bytes(added.count_type) != 1)) {
        return false;
    }
    all->push_back(added);
    return true;
}

/// Takes one line of the header; false when it is damaged.
bool ply_header_line(const std::string &line, ply *result) {
    const std::vector<std::string> words = words_of(line);
    const std::string first = words.empty() ? "" : words[0];
    if (first == "comment") {
        result->comments.push_back(line.size() > 8 ? line.substr(8) : "");
    } else if (first == "format" && words.size() >= 2) {
        result->format = words[1];
    } else if (first == "element" && words.size() == 3) {
        return add_element(words, result);
    } else if (first == "property" && words.size() >= 3 && !result->elements.empty()) {
        return add_property(words, &result->elements.back().properties);
    }
    return true;
}

bool ply_header(std::ifstream *stream, ply *result) {
    std::string line;
    if (!header_line(stream, &line) || line != "ply") {
        return false;
    }
    while (header_line(stream, &line) && line != "end_header") {
        if (!ply_header_line(line, result)) {
            return false;
        }
    }
    return line == "end_header" && !result->format.empty();
}

/// Reads the vertices; false when the file ends too early.
bool ply_vertices(std::ifstream *stream, const element &vertex, info_bounds *bounds) {
    const property *axes[3] = {};
    for (const property &candidate : vertex.properties) {
        if (!candidate.count_type.empty()) {
            return true;  // not our format: only counts are reported
        }
        for (int axis = 0; axis < 3; axis++) {
            if (candidate.name == std::string(1, static_cast<char>('x' + axis)) &&
                (candidate.type == "float" || candidate.type == "float32")) {
                axes[axis] = &candidate;
            }
        }
    }
    const size_t stride = vertex.properties.back().offset + vertex.properties.back().bytes;
    std::vector<char> bytes(stride);
    for (std::uint64_t i = 0; i < vertex.count; i++) {
        if (!stream->read(bytes.data(), static_cast<std::streamsize>(stride))) {
            return false;
        }
        if (axes[0] != nullptr && axes[1] != nullptr && axes[2] != nullptr) {
            const double point[3] = {float_at(bytes.data() + axes[0]->offset),
                                     float_at(bytes.data() + axes[1]->offset),
                                     float_at(bytes.data() + axes[2]->offset)};
            bounds->take(point);
        }
    }
    return true;
}

/// Walks over elements of one list each; false when the file ends too early.
bool ply_lists(std::ifstream *stream, const element &face) {
    if (face.properties.size() != 1 || face.properties[0].count_type.empty()) {
        return true;
    }
    for (std::uint64_t i = 0; i < face.count; i++) {
        const int count = stream->get();
        if (count < 0 ||
            !stream->ignore(static_cast<std::streamsize>(static_cast<size_t>(count) *
                                                         face.properties[0].bytes)) ||
            stream->gcount() != static_cast<std::streamsize>(static_cast<size_t>(count) *
                                                             face.properties[0].bytes)) {
            return false;
        }
    }
    return true;
}

/// The coordinates of a PCD record: FIELDS must begin with x y z as floats.
bool pcd_has_float_points(const json &header) {
    const auto starts = [&](const char *key, const std::vector<std::string> &expected) {
        if (!header.contains(key) || header[key].size() < 3) {
            return false;
        }
        for (size_t i = 0; i < 3; i++) {
            if (header[key][i] != expected[i]) {
                return false;
            }
        }
        return true;
    };
    return starts("FIELDS", {"x", "y", "z"}) && starts("SIZE", {"4", "4", "4"}) &&
           starts("TYPE", {"F", "F", "F"});
}

std::uint32_t u32_at(const std::string &bytes, size_t at) {
    std::uint32_t value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

/// Scaled and shifted by the only node of our own files; other files may have more nodes.
void to_metres(const json &document, std::vector<double> *corner) {
    const json nodes = document.value("nodes", json::array());
    if (nodes.size() != 1) {
        return;
    }
    const auto scale = nodes[0].value("scale", std::vector<double>{1, 1, 1});
    const auto shift = nodes[0].value("translation", std::vector<double>{0, 0, 0});
    for (size_t axis = 0; axis < corner->size() && scale.size() == 3 && shift.size() == 3; axis++) {
        (*corner)[axis] = (*corner)[axis] * scale[axis] + shift[axis];
    }
}

/// Adds the contents of the primitives of a glTF document.
void glb_primitives(const json &document, info_page *page) {
    std::uint64_t vertices = 0, triangles = 0;
    info_bounds bounds;
    for (const json &mesh : document.at("meshes")) {
        for (const json &primitive : mesh.at("primitives")) {
            const json &accessors = document.at("accessors");
            const json &position =
                accessors.at(primitive.at("attributes").at("POSITION").get<size_t>());
            vertices += position.at("count").get<std::uint64_t>();
            if (primitive.contains("indices")) {
                const json &indices = accessors.at(primitive.at("indices").get<size_t>());
                triangles += indices.at("count").get<std::uint64_t>() / 3;
            }
            for (const char *end : {"min", "max"}) {
                std::vector<double> corner = position.at(end).get<std::vector<double>>();
                if (corner.size() == 3) {
                    to_metres(document, &corner);
                    bounds.take(corner.data());
                }
            }
        }
    }
    page->add("vertices", "vertices", std::to_string(vertices), vertices);
    page->add("triangles", "triangles", std::to_string(triangles), triangles);
    bounds.add_to(page, "m");
    const size_t images = document.contains("images") ? document["images"].size() : 0;
    page->add("images", "textures", std::to_string(images), images);
    const json extensions = document.value("extensionsRequired", json::array());
    if (!extensions.empty()) {
        std::string names;
        for (const json &extension : extensions) {
            names += (names.empty() ? "" : " ") + extension.get<std::string>();
        }
        page->add("extensions", "needs", names, extensions);
    }
}

}  // namespace

bool info_ply(const std::string &path, info_page *page, std::string *message) {
    std::ifstream stream(path, std::ios::binary);
    ply header;
    if (!ply_header(&stream, &header)) {
        return damaged(path, "the PLY header is damaged", message);
    }
    page->kind = "mesh (PLY)";
    page->add("format", "format", header.format, header.format);
    info_bounds bounds;
    for (const element &element : header.elements) {
        page->add(element.name, element.name, std::to_string(element.count), element.count);
        std::string names;
        for (const property &property : element.properties) {
            names += (names.empty() ? "" : " ") + property.name;
        }
        page->add("", "  properties", names, nullptr);
    }
    bool whole = true;
    for (const element &element : header.elements) {
        if (header.format != "binary_little_endian" || element.properties.empty()) {
            break;
        }
        whole = whole && (element.name == "vertex" ? ply_vertices(&stream, element, &bounds)
                                                   : ply_lists(&stream, element));
    }
    if (!whole) {
        return damaged(path, "truncated: it ends before all its vertices and faces", message);
    }
    bounds.add_to(page, "");
    for (const std::string &comment : header.comments) {
        page->add("", "comment", comment, nullptr);
    }
    page->add("comments", "", "", header.comments);
    return true;
}

namespace {

/// The header up to its line DATA: each name with its list of values.
bool pcd_header(std::ifstream *stream, json *header) {
    std::string line;
    while (!header->contains("DATA")) {
        if (!header_line(stream, &line)) {
            return false;
        }
        std::vector<std::string> words = words_of(line);
        if (!words.empty() && words[0][0] != '#') {
            const std::string name = words[0];
            words.erase(words.begin());
            (*header)[name] = words;
        }
    }
    return !(*header)["DATA"].empty();
}

bool pcd_count(const json &header, std::uint64_t *points) {
    return header.contains("POINTS") && header["POINTS"].size() == 1 &&
           parse_count(header["POINTS"][0].get<std::string>(), points);
}

/// Names and total size of the fields of a point.
bool pcd_fields(const json &header, std::string *names, size_t *stride) {
    for (size_t i = 0; header.contains("FIELDS") && i < header["FIELDS"].size(); i++) {
        *names += (names->empty() ? "" : " ") + header["FIELDS"][i].get<std::string>();
        std::uint64_t bytes = 0;
        if (!header.contains("SIZE") || i >= header["SIZE"].size() ||
            !parse_count(header["SIZE"][i].get<std::string>(), &bytes) || bytes > 8) {
            return false;
        }
        *stride += bytes;
    }
    return true;
}

bool pcd_bounds(std::ifstream *stream, std::uint64_t points, size_t stride, info_bounds *bounds) {
    std::vector<char> bytes(stride);
    for (std::uint64_t i = 0; i < points; i++) {
        if (!stream->read(bytes.data(), static_cast<std::streamsize>(stride))) {
            return false;
        }
        const double point[3] = {float_at(bytes.data()), float_at(bytes.data() + 4),
                                 float_at(bytes.data() + 8)};
        bounds->take(point);
    }
    return true;
}

}  // namespace

bool info_pcd(const std::string &path, info_page *page, std::string *message) {
    std::ifstream stream(path, std::ios::binary);
    json header;
    std::uint64_t points = 0;
    if (!pcd_header(&stream, &header) || !pcd_count(header, &points)) {
        return damaged(path, "the PCD header is damaged", message);
    }
    page->kind = "point cloud (PCD)";
    page->add("points", "points", std::to_string(points), points);
    std::string names;
    size_t stride = 0;
    if (!pcd_fields(header, &names, &stride)) {
        return damaged(path, "the PCD header is damaged", message);
    }
    page->add("fields", "fields", names, header.value("FIELDS", json::array()));
    page->add("data", "data", header["DATA"][0].get<std::string>(), header["DATA"][0]);
    if (header["DATA"][0] == "binary" && pcd_has_float_points(header)) {
        info_bounds bounds;
        if (!pcd_bounds(&stream, points, stride, &bounds)) {
            return damaged(path, "truncated: it ends before all its points", message);
        }
        bounds.add_to(page, "");
    }
    return true;
}

bool info_glb(const std::string &path, info_page *page, std::string *message) {
    std::ifstream stream(path, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(stream)),
                            std::istreambuf_iterator<char>());
    static const std::uint32_t json_chunk = 0x4E4F534A;
    if (bytes.size() < 20 || u32_at(bytes, 8) != bytes.size() || u32_at(bytes, 16) != json_chunk ||
        u32_at(bytes, 12) > bytes.size() - 20) {
        return damaged(path, "the binary glTF is damaged or truncated", message);
    }
    page->kind = "mesh (binary glTF)";
    try {
        bool too_deep;
        const json document = json_limited(bytes.substr(20, u32_at(bytes, 12)), 32, &too_deep);
        if (too_deep) {
            return damaged(path, "the glTF description in it is nested too deeply", message);
        }
        const std::string version = document.at("asset").at("version").get<std::string>();
        page->add("version", "version", version, version);
        page->add("bytes", "size", std::to_string(bytes.size()) + " bytes", bytes.size());
        glb_primitives(document, page);
    } catch (const json::exception &) {
        return damaged(path, "the glTF description in it is damaged", message);
    }
    return true;
}
