// SPDX-License-Identifier: Apache-2.0
#include "tools/host/mesh/write_glb.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "core/error.h"
#include "daemon/files/output_file.h"
#include "stereo/surface.h"
#include "tools/host/formats/colormap.hpp"
#include "tools/host/formats/image_formats.hpp"
#include "tools/host/formats/json_of.hpp"

namespace {

constexpr uint32_t glb_magic = 0x46546c67;     // "glTF"
constexpr uint32_t chunk_json = 0x4e4f534a;    // "JSON"
constexpr uint32_t chunk_binary = 0x004e4942;  // "BIN\0"
constexpr int target_vertices = 34962, target_indices = 34963;
constexpr int filter_linear = 9729, filter_mipmap = 9987, wrap_clamp = 33071;
constexpr int jpeg_quality = 90, jpeg_quality_packed = 80;
constexpr char quantization[] = "KHR_mesh_quantization", compression[] = "EXT_meshopt_compression",
               transform[] = "KHR_texture_transform", unlit[] = "KHR_materials_unlit";

using json = nlohmann::ordered_json;

/// The content, and the offset of each part in the binary chunk, a multiple of 4.
struct content {
    const reconstruct_context &context;
    const reconstruct_result &mesh;
    glb_parts parts;
    std::vector<unsigned char> texture;
    size_t at[glb_parts::COUNT + 1];  // the texture is the last
    size_t end;                       // size of the binary chunk
    size_t plain_end;                 // size of all parts, uncompressed
};

size_t padded(size_t bytes) {
    return (bytes + 3) / 4 * 4;
}

/// A part's index among the existing ones: that of its accessor and of its view.
int number_of(const glb_parts &parts, int place) {
    int number = 0;
    for (int i = 0; i < place; i++) {
        number += parts.part[i].count > 0 ? 1 : 0;
    }
    return number;
}

/// The bytes of a part that are in the file.
const glb_bytes &stored(const glb_part &part) {
    return part.mode != nullptr ? part.packed : part.bytes;
}

void lay_out(content *content) {
    size_t at = 0;
    for (int i = 0; i < glb_parts::COUNT; i++) {
        content->at[i] = at;
        at += padded(stored(content->parts.part[i]).size());
        content->plain_end += padded(content->parts.part[i].bytes.size());
    }
    content->at[glb_parts::COUNT] = at;
    content->end = at + padded(content->texture.size());
}

/// Width of a pixel at the 1 % quantile of the depth.
double pitch_m(const reconstruct_result &mesh) {
    std::vector<std::int32_t> depths_um;
    depths_um.reserve(mesh.vertex_count);
    for (uint32_t i = 0; i < mesh.vertex_count; i++) {
        depths_um.push_back(mesh.points[i].z_um);
    }
    const auto near = depths_um.begin() + static_cast<std::ptrdiff_t>(depths_um.size() / 100);
    std::nth_element(depths_um.begin(), near, depths_um.end());
    return std::fmax(0, *near / 1e6 / mesh.plan.f_px);
}

json view(size_t buffer, size_t offset, size_t length) {
    return {{"buffer", buffer}, {"byteOffset", offset}, {"byteLength", length}};
}

json views_of(const content &content) {
    json views = json::array();
    size_t plain_at = 0;
    for (int i = 0; i < glb_parts::COUNT; i++) {
        const glb_part &part = content.parts.part[i];
        if (part.count == 0) {
            continue;
        }
        const bool packed = part.mode != nullptr;
        json one = view(packed ? 1 : 0, packed ? plain_at : content.at[i], part.bytes.size());
        if (i != glb_parts::INDICES) {
            one["byteStride"] = part.stride;
        }
        one["target"] = i == glb_parts::INDICES ? target_indices : target_vertices;
        if (packed) {
            json how = view(0, content.at[i], part.packed.size());
            how.update({{"byteStride", part.stride}, {"count", part.count}, {"mode", part.mode}});
            if (part.filter != nullptr) {
                how["filter"] = part.filter;
            }
            one["extensions"][compression] = how;
        }
        views.push_back(one);
        plain_at += padded(part.bytes.size());
    }
    views.push_back(view(0, content.at[glb_parts::COUNT], content.texture.size()));
    return views;
}

json accessors_of(const glb_parts &parts) {
    json accessors = json::array();
    for (int i = 0; i < glb_parts::COUNT; i++) {
        const glb_part &part = parts.part[i];
        if (part.count == 0) {
            continue;
        }
        json one = {{"bufferView", number_of(parts, i)},
                    {"componentType", part.component},
                    {"count", part.count},
                    {"type", part.type}};
        if (part.normalized) {
            one["normalized"] = true;
        }
        if (i == glb_parts::POSITIONS) {
            one["min"] = parts.min;
            one["max"] = parts.max;
        }
        accessors.push_back(one);
    }
    return accessors;
}

json buffers_of(const content &content) {
    json buffers = {{{"byteLength", content.end}}};
    if (content.context.compress) {
        // The buffer that the decoder fills; not in any file.
        buffers.push_back({{"byteLength", content.plain_end},
                           {"extensions", {{compression, {{"fallback", true}}}}}});
    }
    return buffers;
}

json material_of(const content &content) {
    json texture = {{"index", 0}};
    if (content.context.compress) {
        // From pixels, relative to the centre of the first, to fractions of the image.
        const image_rgb8 &image = content.mesh.left_colour;
        const double scale[2] = {1.0 / image.width, 1.0 / image.height};
        texture["extensions"][transform] = {{"offset", {scale[0] / 2, scale[1] / 2}},
                                            {"scale", scale}};
    }
    return {{"name", "photograph"},
            {"doubleSided", true},
            {"pbrMetallicRoughness",
             {{"baseColorTexture", texture}, {"metallicFactor", 0}, {"roughnessFactor", 1}}},
            // A photograph already contains its lighting.
            {"extensions", {{unlit, json::object()}}}};
}

json node_of(const glb_parts &parts) {
    json node = {{"name", "surface"}, {"mesh", 0}};
    if (parts.part[glb_parts::POSITIONS].component == glb_u16) {
        node["translation"] = parts.offset_m;
        node["scale"] = {parts.scale_m, parts.scale_m, parts.scale_m};
    }
    return node;
}

json primitive_of(const glb_parts &parts) {
    json attributes = {{"POSITION", 0}};
    if (parts.part[glb_parts::NORMALS].count > 0) {
        attributes["NORMAL"] = number_of(parts, glb_parts::NORMALS);
    }
    attributes["TEXCOORD_0"] = number_of(parts, glb_parts::PLACES);
    if (parts.part[glb_parts::FILLED].count > 0) {
        attributes["_FILLED"] = number_of(parts, glb_parts::FILLED);
    }
    return {{"attributes", attributes},
            {"indices", number_of(parts, glb_parts::INDICES)},
            {"material", 0}};
}

json asset_of(const reconstruct_context &context) {
    char crc[16];
    std::snprintf(crc, sizeof crc, "%08x", context.result->calibration_crc);
    json extras = {{"calibration_id", context.calibration->id},
                   {"calibration_crc32", crc},
                   {"metric", context.metric},
                   {"mismatch", context.mismatch.text[0] != '\0' ? json(context.mismatch.text)
                                                                 : json(nullptr)}};
    if (context.options->fill) {
        extras["filled_pixels"] = context.result->reason_count[REASON_FILLED];
    }
    if (context.depth_sigma_common_mm >= 0) {
        extras["depth_sigma_common_mm"] = context.depth_sigma_common_mm;
    }
    if (context.self_calibrated) {
        extras["health"] = adjust_health_text(context.self_calibration.health);
    }
    extras.update(json_of([&](auto *out) { capture_info_json(&context.capture, out); }));
    return {
        {"version", "2.0"},
        {"generator", std::string("vergence ") + context.version + " build " + context.build_id},
        {"extras", extras}};
}

/// The left image as a JPEG, with filled pixels half in the colour of the map of reasons.
std::vector<unsigned char> texture_of(const reconstruct_result &mesh, int quality) {
    if (mesh.reason_count[REASON_FILLED] == 0) {
        return image_jpeg_encode(mesh.left_colour, quality);
    }
    const image_rgb8 &photograph = mesh.left_colour;
    const auto row_bytes = static_cast<std::size_t>(3 * photograph.width);
    std::vector<unsigned char> tinted(row_bytes * static_cast<std::size_t>(photograph.height));
    for (std::size_t i = 0; i < tinted.size(); i++) {
        const int y = static_cast<int>(i / row_bytes);
        const std::size_t x = i % row_bytes / 3;
        const unsigned char value = image_rgb8_row(&photograph, y)[i % row_bytes];
        const bool is_filled = image_u8_row(&mesh.match.reason, y)[x] == REASON_FILLED;
        tinted[i] =
            is_filled
                ? static_cast<unsigned char>((value + colormap_reasons[REASON_FILLED][i % 3]) / 2)
                : value;
    }
    return image_jpeg_encode({tinted.data(), photograph.width, photograph.height,
                              static_cast<std::ptrdiff_t>(row_bytes)},
                             quality);
}

/// The JSON chunk's text, padded with spaces.
std::string make_text(const content &content) {
    json required = {quantization};
    if (content.context.compress) {
        required.push_back(compression);
        required.push_back(transform);
    }
    json used = {unlit};
    used.insert(used.end(), required.begin(), required.end());
    const glb_parts &parts = content.parts;
    const json document = {
        {"asset", asset_of(content.context)},
        {"extensionsUsed", used},
        {"extensionsRequired", required},
        {"scene", 0},
        {"scenes", {{{"nodes", {0}}}}},
        {"nodes", {node_of(parts)}},
        {"meshes", {{{"primitives", {primitive_of(parts)}}}}},
        {"materials", {material_of(content)}},
        {"textures", {{{"sampler", 0}, {"source", 0}}}},
        {"samplers",
         {{{"magFilter", filter_linear},
           {"minFilter", filter_mipmap},
           {"wrapS", wrap_clamp},
           {"wrapT", wrap_clamp}}}},
        {"images",
         {{{"bufferView", number_of(parts, glb_parts::COUNT)}, {"mimeType", "image/jpeg"}}}},
        {"accessors", accessors_of(parts)},
        {"bufferViews", views_of(content)},
        {"buffers", buffers_of(content)}};
    std::string text = document.dump(-1, ' ', false, json::error_handler_t::replace);
    text.resize(padded(text.size()), ' ');
    return text;
}

void write_padded(const glb_bytes &bytes, output_file *file) {
    const unsigned char padding[4] = {0, 0, 0, 0};
    output_file_write(file, bytes.data(), bytes.size());
    output_file_write(file, padding, padded(bytes.size()) - bytes.size());
}

}  // namespace

int write_glb(const reconstruct_context *context, const char *path, message *message) {
    const reconstruct_result &mesh = context->mesh != nullptr ? *context->mesh : *context->result;
    if (mesh.triangle_count == 0) {
        return message_set(message, ERROR_NO_SURFACE,
                           "no surface was found: the points have no neighbours to join");
    }
    content content{
        *context,
        mesh,
        context->compress ? glb_parts_packed(mesh) : glb_parts_make(mesh, pitch_m(mesh)),
        texture_of(mesh, context->compress ? jpeg_quality_packed : jpeg_quality),
        {},
        0,
        0};
    lay_out(&content);
    const std::string text = make_text(content);
    if (content.texture.empty()) {
        return message_set(message, ERROR_MEMORY, "%s: out of memory", path);
    }
    const size_t total = 12 + 8 + text.size() + 8 + content.end;
    if (total > std::numeric_limits<uint32_t>::max()) {
        return message_set(message, ERROR_BUFFER, "%s: too large (at most 4 GB)", path);
    }
    output_file file;
    output_file_open(&file, path);
    output_file_u32(&file, glb_magic);
    output_file_u32(&file, 2);
    output_file_u32(&file, static_cast<uint32_t>(total));
    output_file_u32(&file, static_cast<uint32_t>(text.size()));
    output_file_u32(&file, chunk_json);
    output_file_write(&file, text.data(), text.size());
    output_file_u32(&file, static_cast<uint32_t>(content.end));
    output_file_u32(&file, chunk_binary);
    for (const glb_part &part : content.parts.part) {
        write_padded(stored(part), &file);
    }
    write_padded(content.texture, &file);
    return output_file_close(&file, message);
}
