// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <string.h>

#include "daemon/files/output_file.h"
#include "daemon/surface/result/write.h"

enum { VERTEX_BYTES = 6 * 4 + 3 + 2 * 4, FACE_BYTES = 1 + 3 * 4 };

static void put_header(const struct reconstruct_context *context,
                       const struct reconstruct_result *result, FILE *stream) {
    fputs("ply\nformat binary_little_endian 1.0\n", stream);
    write_comments(context, "comment", stream);
    fprintf(stream, "comment left camera frame: x right, y down, z forward; %s\n",
            context->metric ? reconstruct_context_unit_name(context)
                            : "assumed geometry, lengths are meaningless");
    fprintf(stream, "element vertex %" PRIu32 "\n", result->vertex_count);
    fputs(
        "property float x\nproperty float y\nproperty float z\n"
        "property float nx\nproperty float ny\nproperty float nz\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\n"
        "property float sigma\nproperty float miss\n",
        stream);
    fprintf(stream, "element face %" PRIu32 "\n", result->triangle_count);
    fputs("property list uchar int vertex_indices\nend_header\n", stream);
}

static void put_vertex(const struct reconstruct_result *result, uint32_t vertex, float unit_um,
                       unsigned char bytes[VERTEX_BYTES]) {
    const struct triangulate_point *point = &result->points[vertex];
    const int16_t *normal_q14 = result->normals_q14[vertex];
    const int width = result->left_colour.width;
    const uint32_t pixel = result->vertex_pixel[vertex];
    const uint8_t *rgb = image_rgb8_row(&result->left_colour, (int)(pixel / (uint32_t)width)) +
                         3 * (pixel % (uint32_t)width);
    output_file_put_f32(bytes, (float)point->x_um / unit_um);
    output_file_put_f32(bytes + 4, (float)point->y_um / unit_um);
    output_file_put_f32(bytes + 8, (float)point->z_um / unit_um);
    for (int i = 0; i < 3; i++) {
        output_file_put_f32(bytes + 12 + 4 * i, (float)normal_q14[i] / 16384.0f);
    }
    memcpy(bytes + 24, rgb, 3);
    output_file_put_f32(bytes + 27, (float)point->sigma_um / unit_um);
    output_file_put_f32(bytes + 31, (float)point->miss_um / unit_um);
}

int write_ply(const struct reconstruct_context *context, const char *path,
              struct message *message) {
    const struct reconstruct_result *result = reconstruct_context_ply(context);
    const float unit_um = reconstruct_context_unit_um(context);
    struct output_file file;
    output_file_open(&file, path);
    if (file.stream != NULL) {
        put_header(context, result, file.stream);
    }
    for (uint32_t vertex = 0; vertex < result->vertex_count; vertex++) {
        unsigned char bytes[VERTEX_BYTES];
        put_vertex(result, vertex, unit_um, bytes);
        output_file_write(&file, bytes, sizeof bytes);
    }
    for (uint32_t face = 0; face < result->triangle_count; face++) {
        unsigned char bytes[FACE_BYTES] = {3};
        for (int corner = 0; corner < 3; corner++) {
            output_file_put_u32(bytes + 1 + 4 * corner, result->triangles[face][corner]);
        }
        output_file_write(&file, bytes, sizeof bytes);
    }
    return output_file_close(&file, message);
}
