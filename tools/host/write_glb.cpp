// SPDX-License-Identifier: Apache-2.0
#include "tools/host/write_glb.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "core/error.h"
#include "daemon/json.h"
#include "daemon/output_file.h"
#include "tools/host/image_jpeg.hpp"

namespace {

constexpr uint32_t glb_magic = 0x46546c67;     // "glTF"
constexpr uint32_t chunk_json = 0x4e4f534a;    // "JSON"
constexpr uint32_t chunk_binary = 0x004e4942;  // "BIN\0"
constexpr int type_float = 5126, type_u32 = 5125;
constexpr int target_vertices = 34962, target_indices = 34963;
constexpr int filter_linear = 9729, filter_mipmap = 9987, wrap_clamp = 33071;
constexpr int jpeg_quality = 90;

/// Where each part lies in the binary chunk; all parts begin at multiples of 4 bytes.
struct sections {
    size_t positions, normals, coordinates, indices, texture, texture_bytes, end;
};

size_t padded(size_t bytes) {
    return (bytes + 3) / 4 * 4;
}

sections lay_out(const reconstruct_result &result, size_t texture_bytes) {
    const size_t vertices = result.vertex_count;
    sections at{};
    at.positions = 0;
    at.normals = at.positions + 12 * vertices;
    at.coordinates = at.normals + 12 * vertices;
    at.indices = at.coordinates + 8 * vertices;
    at.texture = at.indices + 12 * size_t{result.triangle_count};
    at.texture_bytes = texture_bytes;
    at.end = padded(at.texture + texture_bytes);
    return at;
}

struct vertex_position {
    float metres[3];
};

/// From the left camera's frame to glTF's: half a turn about x.
vertex_position position_of(const triangulate_point &point) {
    return {{static_cast<float>(point.x_um / 1e6), static_cast<float>(-point.y_um / 1e6),
             static_cast<float>(-point.z_um / 1e6)}};
}

void print_view(json *out, size_t offset, size_t length, int target) {
    json_open_object(out, nullptr);
    json_integer(out, "buffer", 0);
    json_integer(out, "byteOffset", static_cast<int64_t>(offset));
    json_integer(out, "byteLength", static_cast<int64_t>(length));
    if (target != 0) {
        json_integer(out, "target", target);
    }
    json_close_object(out);
}

void print_views(json *out, const sections &at) {
    json_open_array(out, "bufferViews");
    print_view(out, at.positions, at.normals - at.positions, target_vertices);
    print_view(out, at.normals, at.coordinates - at.normals, target_vertices);
    print_view(out, at.coordinates, at.indices - at.coordinates, target_vertices);
    print_view(out, at.indices, at.texture - at.indices, target_indices);
    print_view(out, at.texture, at.texture_bytes, 0);
    json_close_array(out);
}

void open_accessor(json *out, int view, int component, int64_t count, const char *type) {
    json_open_object(out, nullptr);
    json_integer(out, "bufferView", view);
    json_integer(out, "componentType", component);
    json_integer(out, "count", count);
    json_text(out, "type", type);
}

void print_accessors(json *out, const reconstruct_result &result) {
    double least[3], greatest[3];
    for (int axis = 0; axis < 3; axis++) {
        least[axis] = std::numeric_limits<double>::infinity();
        greatest[axis] = -least[axis];
    }
    for (uint32_t i = 0; i < result.vertex_count; i++) {
        const vertex_position position = position_of(result.points[i]);
        for (int axis = 0; axis < 3; axis++) {
            least[axis] = std::fmin(least[axis], position.metres[axis]);
            greatest[axis] = std::fmax(greatest[axis], position.metres[axis]);
        }
    }
    json_open_array(out, "accessors");
    open_accessor(out, 0, type_float, result.vertex_count, "VEC3");
    json_reals(out, "min", least, 3, 9);
    json_reals(out, "max", greatest, 3, 9);
    json_close_object(out);
    open_accessor(out, 1, type_float, result.vertex_count, "VEC3");
    json_close_object(out);
    open_accessor(out, 2, type_float, result.vertex_count, "VEC2");
    json_close_object(out);
    open_accessor(out, 3, type_u32, int64_t{3} * result.triangle_count, "SCALAR");
    json_close_object(out);
    json_close_array(out);
}

void print_buffers(json *out, size_t length) {
    json_open_array(out, "buffers");
    json_open_object(out, nullptr);
    json_integer(out, "byteLength", static_cast<int64_t>(length));
    json_close_object(out);
    json_close_array(out);
}

void print_material(json *out) {
    json_open_array(out, "materials");
    json_open_object(out, nullptr);
    json_text(out, "name", "photograph");
    json_bool(out, "doubleSided", true);
    json_open_object(out, "pbrMetallicRoughness");
    json_open_object(out, "baseColorTexture");
    json_integer(out, "index", 0);
    json_close_object(out);
    json_real(out, "metallicFactor", 0, 1);
    json_real(out, "roughnessFactor", 1, 1);
    json_close_object(out);
    // A photograph has its light in it already.
    json_open_object(out, "extensions");
    json_open_object(out, "KHR_materials_unlit");
    json_close_object(out);
    json_close_object(out);
    json_close_object(out);
    json_close_array(out);
}

void print_texture(json *out) {
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
    json_integer(out, "bufferView", 4);
    json_text(out, "mimeType", "image/jpeg");
    json_close_object(out);
    json_close_array(out);
}

void print_scene(json *out) {
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
    json_close_object(out);
    json_close_array(out);
    json_open_array(out, "meshes");
    json_open_object(out, nullptr);
    json_open_array(out, "primitives");
    json_open_object(out, nullptr);
    json_open_object(out, "attributes");
    json_integer(out, "POSITION", 0);
    json_integer(out, "NORMAL", 1);
    json_integer(out, "TEXCOORD_0", 2);
    json_close_object(out);
    json_integer(out, "indices", 3);
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
    capture_stamp_json(&context.capture, out);
    json_close_object(out);
    json_close_object(out);
    json_open_array(out, "extensionsUsed");
    json_text(out, nullptr, "KHR_materials_unlit");
    json_close_array(out);
}

/// The JSON chunk's text, padded with spaces; empty when memory runs out.
std::string make_text(const reconstruct_context &context, const sections &at) {
    char *text = nullptr;
    size_t length = 0;
    FILE *stream = open_memstream(&text, &length);
    if (stream == nullptr) {
        return "";
    }
    json out;
    json_begin(&out, stream);
    json_open_object(&out, nullptr);
    print_asset(&out, context);
    print_scene(&out);
    print_material(&out);
    print_texture(&out);
    print_accessors(&out, *context.result);
    print_views(&out, at);
    print_buffers(&out, at.end);
    json_close_object(&out);
    json_end(&out);
    const bool good = std::ferror(stream) == 0;
    const bool closed = std::fclose(stream) == 0;
    std::string result = good && closed ? std::string(text, length) : "";
    std::free(text);
    result.resize(padded(result.size()), ' ');
    return result;
}

void write_positions(const reconstruct_result &result, output_file *file) {
    for (uint32_t i = 0; i < result.vertex_count; i++) {
        const vertex_position position = position_of(result.points[i]);
        for (const float metres : position.metres) {
            output_file_f32(file, metres);
        }
    }
}

void write_normals(const reconstruct_result &result, output_file *file) {
    for (uint32_t i = 0; i < result.vertex_count; i++) {
        const double x = result.normals_q14[i][0], y = -result.normals_q14[i][1],
                     z = -result.normals_q14[i][2];
        // 14 bits leave the length off by some 1e-4: more than glTF's readers like.
        const double length = std::sqrt(x * x + y * y + z * z);
        output_file_f32(file, static_cast<float>(length > 0 ? x / length : 0));
        output_file_f32(file, static_cast<float>(length > 0 ? y / length : 0));
        output_file_f32(file, static_cast<float>(length > 0 ? z / length : 1));
    }
}

void write_coordinates(const reconstruct_result &result, output_file *file) {
    const uint32_t width = static_cast<uint32_t>(result.left_colour.width);
    const double height = result.left_colour.height;
    for (uint32_t i = 0; i < result.vertex_count; i++) {
        const uint32_t pixel = result.vertex_pixel[i];
        // Texture coordinates count from the edge of the image, ours from the centre of a pixel.
        output_file_f32(file, static_cast<float>((pixel % width + 0.5) / width));
        output_file_f32(file, static_cast<float>((pixel / width + 0.5) / height));
    }
}

void write_indices(const reconstruct_result &result, output_file *file) {
    for (uint32_t i = 0; i < result.triangle_count; i++) {
        unsigned char bytes[12];
        for (int corner = 0; corner < 3; corner++) {
            output_file_put_u32(bytes + 4 * corner, result.triangles[i][corner]);
        }
        output_file_write(file, bytes, sizeof bytes);
    }
}

}  // namespace

int write_glb(const reconstruct_context *context, const char *path, message *message) {
    const reconstruct_result &result = *context->result;
    if (result.triangle_count == 0) {
        return message_set(message, ERROR_NO_SURFACE,
                           "no surface was found: the points have no neighbours to join");
    }
    const std::vector<unsigned char> texture = image_jpeg_encode(result.left_colour, jpeg_quality);
    const sections at = lay_out(result, texture.size());
    const std::string text = make_text(*context, at);
    if (texture.empty() || text.empty()) {
        return message_set(message, ERROR_MEMORY, "writing %s failed: not enough memory", path);
    }
    const size_t total = 12 + 8 + text.size() + 8 + at.end;
    if (total > std::numeric_limits<uint32_t>::max()) {
        return message_set(message, ERROR_BUFFER, "%s would be larger than 4 GB", path);
    }
    output_file file;
    output_file_open(&file, path);
    output_file_u32(&file, glb_magic);
    output_file_u32(&file, 2);
    output_file_u32(&file, static_cast<uint32_t>(total));
    output_file_u32(&file, static_cast<uint32_t>(text.size()));
    output_file_u32(&file, chunk_json);
    output_file_write(&file, text.data(), text.size());
    output_file_u32(&file, static_cast<uint32_t>(at.end));
    output_file_u32(&file, chunk_binary);
    write_positions(result, &file);
    write_normals(result, &file);
    write_coordinates(result, &file);
    write_indices(result, &file);
    output_file_write(&file, texture.data(), texture.size());
    const unsigned char padding[4] = {0, 0, 0, 0};
    output_file_write(&file, padding, at.end - at.texture - texture.size());
    return output_file_close(&file, message);
}
