// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>

#include "daemon/files/output_file.h"
#include "daemon/surface/result/write.h"

enum { POINT_BYTES = 5 * 4 };

int write_pcd(const struct reconstruct_context *context, const char *path,
              struct message *message) {
    const struct reconstruct_result *result = context->result;
    const uint32_t width = (uint32_t)result->left_colour.width;
    const float unit_um = reconstruct_context_unit_um(context);
    struct output_file file;
    output_file_open(&file, path);
    if (file.stream != NULL) {
        fputs("# .PCD v0.7 - Point Cloud Data file format\n", file.stream);
        write_comments(context, "#", file.stream);
        fprintf(file.stream, "# lengths in %s\n",
                context->metric ? reconstruct_context_unit_name(context) : "an assumed unit");
        fprintf(file.stream,
                "VERSION 0.7\n"
                "FIELDS x y z rgb sigma\nSIZE 4 4 4 4 4\nTYPE F F F F F\nCOUNT 1 1 1 1 1\n"
                "WIDTH %" PRIu32 "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS %" PRIu32
                "\nDATA binary\n",
                result->vertex_count, result->vertex_count);
    }
    for (uint32_t vertex = 0; vertex < result->vertex_count; vertex++) {
        const struct triangulate_point *point = &result->points[vertex];
        const uint32_t pixel = result->vertex_pixel[vertex];
        const uint8_t *rgb =
            image_rgb8_row(&result->left_colour, (int)(pixel / width)) + 3 * (pixel % width);
        unsigned char bytes[POINT_BYTES];
        output_file_put_f32(bytes, (float)point->x_um / unit_um);
        output_file_put_f32(bytes + 4, (float)point->y_um / unit_um);
        output_file_put_f32(bytes + 8, (float)point->z_um / unit_um);
        // PCL's "rgb" is the integer 0x00RRGGBB in the bytes of a float.
        output_file_put_u32(bytes + 12,
                            (uint32_t)rgb[0] << 16 | (uint32_t)rgb[1] << 8 | (uint32_t)rgb[2]);
        output_file_put_f32(bytes + 16, (float)point->sigma_um / unit_um);
        output_file_write(&file, bytes, sizeof bytes);
    }
    return output_file_close(&file, message);
}
