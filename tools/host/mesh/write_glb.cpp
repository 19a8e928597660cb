// SPDX-License-Identifier: Apache-2.0
#include "tools/host/mesh/write_glb.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "core/error.h"
#include "daemon/base/json.h"
#include "daemon/files/output_file.h"
#include "tools/host/formats/image_jpeg.hpp"
#include "tools/host/mesh/glb_parts.hpp"

namespace {

constexpr uint32_t glb_magic = 0x46546c67;     // "glTF"
constexpr uint32_t chunk_json = 0x4e4f534a;    // "JSON"
constexpr uint32_t chunk_binary = 0x004e4942;  // "BIN\0"
constexpr int target_vertices = 34962, target_indices = 34963;
constexpr int filter_linear = 9729, filter_mipmap = 9987, wrap_clamp = 33071;
constexpr int jpeg_quality = 90, jpeg_quality_packed = 80;
constexpr char quantization[] = "KHR_mesh_quantization", compression[] = "EXT_meshopt_compression",
               transform[] = "KHR_texture_transform", unlit[] = "KHR_materials_unlit";

/// The content, and the offset of each part in the binary chunk, a multiple of 4.
struct content {
    const reconstruct_context &context;
    const reconstruct_result &mesh;
    glb_parts parts;
    std::vector<unsigned char> texture;
    size_t at[glb_parts::COUNT + 1];  // the texture is the last
    size_t end;                       // of the binary chunk
    size_t plain_end;                 // of all parts, uncompressed
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

void open_view(json *out, size_t buffer, size_t offset, size_t length) {
    json_integer(out, "buffer", static_cast<int64_t>(buffer));
    json_integer(out, "byteOffset", static_cast<int64_t>(offset));
    json_integer(out, "byteLength", static_cast<int64_t>(length));
}

void print_compression(json *out, const glb_part &part, size_t offset) {
    json_open_object(out, "extensions");
    json_open_object(out, compression);
    open_view(out, 0, offset, part.packed.size());
    json_integer(out, "byteStride", part.stride);
    json_integer(out, "count", part.count);
    json_text(out, "mode", part.mode);
    if (part.filter != nullptr) {
        json_text(out, "filter", part.filter);
    }
    json_close_object(out);
    json_close_object(out);
}

void print_views(json *out, const content &content) {
    size_t plain_at = 0;
    json_open_array(out, "bufferViews");
    for (int i = 0; i < glb_parts::COUNT; i++) {
        const glb_part &part = content.parts.part[i];
        if (part.count == 0) {
            continue;
        }
        const bool packed = part.mode != nullptr;
        json_open_object(out, nullptr);
        open_view(out, packed ? 1 : 0, packed ? plain_at : content.at[i], part.bytes.size());
        if (i != glb_parts::INDICES) {
            json_integer(out, "byteStride", part.stride);
        }
        json_integer(out, "target", i == glb_parts::INDICES ? target_indices : target_vertices);
        if (packed) {
            print_compression(out, part, content.at[i]);
        }
        json_close_object(out);
        plain_at += padded(part.bytes.size());
    }
    json_open_object(out, nullptr);
    open_view(out, 0, content.at[glb_parts::COUNT], content.texture.size());
    json_close_object(out);
    json_close_array(out);
}

void print_accessors(json *out, const glb_parts &parts) {
    json_open_array(out, "accessors");
    for (int i = 0; i < glb_parts::COUNT; i++) {
        const glb_part &part = parts.part[i];
        if (part.count == 0) {
            continue;
        }
        json_open_object(out, nullptr);
        json_integer(out, "bufferView", number_of(parts, i));
        json_integer(out, "componentType", part.component);
        json_integer(out, "count", part.count);
        json_text(out, "type", part.type);
        if (part.normalized) {
            json_bool(out, "normalized", true);
        }
        if (i == glb_parts::POSITIONS) {
            json_reals(out, "min", parts.min, 3, 9);
            json_reals(out, "max", parts.max, 3, 9);
        }
        json_close_object(out);
    }
    json_close_array(out);
}

void print_buffers(json *out, const content &content) {
    json_open_array(out, "buffers");
    json_open_object(out, nullptr);
    json_integer(out, "byteLength", static_cast<int64_t>(content.end));
    json_close_object(out);
    if (content.context.compress) {
        // The buffer that the decoder fills; not in any file.
        json_open_object(out, nullptr);
        json_integer(out, "byteLength", static_cast<int64_t>(content.plain_end));
        json_open_object(out, "extensions");
        json_open_object(out, compression);
        json_bool(out, "fallback", true);
        json_close_object(out);
        json_close_object(out);
        json_close_object(out);
    }
    json_close_array(out);
}

/// From pixels, relative to the centre of the first, to fractions of the image.
void print_pixel_scale(json *out, const image_rgb8 &image) {
    const double scale[2] = {1.0 / image.width, 1.0 / image.height};
    const double offset[2] = {scale[0] / 2, scale[1] / 2};
    json_open_object(out, "extensions");
    json_open_object(out, transform);
    json_reals(out, "offset", offset, 2, 9);
    json_reals(out, "scale", scale, 2, 9);
    json_close_object(out);
    json_close_object(out);
}

void print_material(json *out, const content &content) {
    json_open_array(out, "materials");
    json_open_object(out, nullptr);
    json_text(out, "name", "photograph");
    json_bool(out, "doubleSided", true);
    json_open_object(out, "pbrMetallicRoughness");
    json_open_object(out, "baseColorTexture");
    json_integer(out, "index", 0);
    if (content.context.compress) {
        print_pixel_scale(out, content.mesh.left_colour);
    }
    json_close_object(out);
    json_real(out, "metallicFactor", 0, 1);
    json_real(out, "roughnessFactor", 1, 1);
    json_close_object(out);
    // A photograph already contains its lighting.
    json_open_object(out, "extensions");
    json_open_object(out, unlit);
    json_close_object(out);
    json_close_object(out);
    json_close_object(out);
    json_close_array(out);
}

void print_texture(json *out, const glb_parts &parts) {
    json_open_array(out, "textures");
    json_open_object(out, nullptr);
    json_integer(out, "sampler", 0);
    json_integer(out, "source", 0);
    json_close_object(out);
    json_close_array(out);
    json_open_array(out, "samplers");
    json_open_object(out, nullptr);
    json_integer(out, "magFilter", filter_linear);
    json_integer(out, "minFilter", filter_mipmap);
    json_integer(out, "wrapS", wrap_clamp);
    json_integer(out, "wrapT", wrap_clamp);
    json_close_object(out);
    json_close_array(out);
    json_open_array(out, "images");
    json_open_object(out, nullptr);
    json_integer(out, "bufferView", number_of(parts, glb_parts::COUNT));
    json_text(out, "mimeType", "image/jpeg");
    json_close_object(out);
    json_close_array(out);
}

void print_scene(json *out, const glb_parts &parts) {
    json_integer(out, "scene", 0);
    json_open_array(out, "scenes");
    json_open_object(out, nullptr);
    const double nodes[1] = {0};
    json_reals(out, "nodes", nodes, 1, 1);
    json_close_object(out);
    json_close_array(out);
    json_open_array(out, "nodes");
    json_open_object(out, nullptr);
    json_text(out, "name", "surface");
    json_integer(out, "mesh", 0);
    if (parts.part[glb_parts::POSITIONS].component == glb_u16) {
        const double scale[3] = {parts.scale_m, parts.scale_m, parts.scale_m};
        json_reals(out, "translation", parts.offset_m, 3, 9);
        json_reals(out, "scale", scale, 3, 9);
    }
    json_close_object(out);
    json_close_array(out);
    json_open_array(out, "meshes");
    json_open_object(out, nullptr);
    json_open_array(out, "primitives");
    json_open_object(out, nullptr);
    json_open_object(out, "attributes");
    json_integer(out, "POSITION", 0);
    if (parts.part[glb_parts::NORMALS].count > 0) {
        json_integer(out, "NORMAL", number_of(parts, glb_parts::NORMALS));
    }
    json_integer(out, "TEXCOORD_0", number_of(parts, glb_parts::PLACES));
    json_close_object(out);
    json_integer(out, "indices", number_of(parts, glb_parts::INDICES));
    json_integer(out, "material", 0);
    json_close_object(out);
    json_close_array(out);
    json_close_object(out);
    json_close_array(out);
}

void print_asset(json *out, const reconstruct_context &context) {
    char crc[16];
    std::snprintf(crc, sizeof crc, "%08x", context.result->calibration_crc);
    const std::string generator =
        std::string("vergence ") + context.version + " build " + context.build_id;
    json_open_object(out, "asset");
    json_text(out, "version", "2.0");
    json_text(out, "generator", generator.c_str());
    json_open_object(out, "extras");
    json_text(out, "calibration_id", context.calibration->id);
    json_text(out, "calibration_crc32", crc);
    json_bool(out, "metric", context.metric);
    json_text(out, "mismatch", context.mismatch.text[0] != '\0' ? context.mismatch.text : nullptr);
    if (context.depth_sigma_common_mm >= 0) {
        json_real(out, "depth_sigma_common_mm", context.depth_sigma_common_mm, 6);
    }
    capture_info_json(&context.capture, out);
    json_close_object(out);
    json_close_object(out);
    for (const char *name : {"extensionsUsed", "extensionsRequired"}) {
        json_open_array(out, name);
        if (std::strcmp(name, "extensionsUsed") == 0) {
            json_text(out, nullptr, unlit);
        }
        json_text(out, nullptr, quantization);
        if (context.compress) {
            json_text(out, nullptr, compression);
            json_text(out, nullptr, transform);
        }
        json_close_array(out);
    }
}

/// The JSON chunk's text, padded with spaces; empty when memory runs out.
std::string make_text(const content &content) {
    char *text = nullptr;
    size_t length = 0;
    FILE *stream = open_memstream(&text, &length);
    if (stream == nullptr) {
        return "";
    }
    json out;
    json_begin(&out, stream);
    json_open_object(&out, nullptr);
    print_asset(&out, content.context);
    print_scene(&out, content.parts);
    print_material(&out, content);
    print_texture(&out, content.parts);
    print_accessors(&out, content.parts);
    print_views(&out, content);
    print_buffers(&out, content);
    json_close_object(&out);
    json_end(&out);
    const bool good = std::ferror(stream) == 0;
    const bool closed = std::fclose(stream) == 0;
    std::string result = good && closed ? std::string(text, length) : "";
    std::free(text);
    result.resize(padded(result.size()), ' ');
    return result;
}

void write_padded(const glb_bytes &bytes, output_file *file) {
    const unsigned char padding[4] = {0, 0, 0, 0};
    output_file_write(file, bytes.data(), bytes.size());
    output_file_write(file, padding, padded(bytes.size()) - bytes.size());
}

}  // namespace

int write_glb(const reconstruct_context *context, const char *path, message *message) {
    const reconstruct_result &mesh =
        context->mesh != nullptr ? context->mesh->result : *context->result;
    if (mesh.triangle_count == 0) {
        return message_set(message, ERROR_NO_SURFACE,
                           "no surface was found: the points have no neighbours to join");
    }
    content content{
        *context,
        mesh,
        context->compress ? glb_parts_packed(mesh) : glb_parts_make(mesh, pitch_m(mesh)),
        image_jpeg_encode(mesh.left_colour, context->compress ? jpeg_quality_packed : jpeg_quality),
        {},
        0,
        0};
    lay_out(&content);
    const std::string text = make_text(content);
    if (content.texture.empty() || text.empty()) {
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
