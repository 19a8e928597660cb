// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/result/write.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/error.h"
#include "daemon/files/output_file.h"
#include "daemon/surface/result/result_figures.h"
#include "daemon/surface/result/result_json.h"
#include "stereo/reconstruct.h"
#include "stereo/surface.h"

void write_comments(const struct reconstruct_context *context, const char *mark, FILE *stream) {
    fprintf(stream, "%s vergence %s build %s\n", mark, context->version, context->build_id);
    fprintf(stream, "%s calibration %s crc %08" PRIx32 "\n", mark, context->calibration->id,
            context->result->calibration_crc);
    if (context->depth_sigma_common_mm >= 0) {
        fprintf(stream, "%s depth_sigma_common_mm %.3f\n", mark, context->depth_sigma_common_mm);
    }
    if (context->self_calibrated) {
        fprintf(stream, "%s health %s\n", mark,
                adjust_health_text(context->self_calibration.health));
    }
    if (context->mismatch.text[0] != '\0') {
        fprintf(stream, "%s accepted mismatch: %s\n", mark, context->mismatch.text);
    }
    for (int line = 0; context->capture.session != NULL && line < CAPTURE_INFO_LINES; line++) {
        char text[CAPTURE_INFO_BYTES];
        capture_info_line(&context->capture, line, text);
        fprintf(stream, "%s %s%s\n", mark, line == 0 ? "capture " : "", text);
    }
}

/// The file that a walk over the surface writes.
struct surface_file {
    struct output_file file;
    const struct reconstruct_result *result;
    float unit_um;
    bool filled;  // vertices state whether they are
};

/// Colour of a pixel of the rectified left image.
static const uint8_t *colour_of(const struct surface_file *self, uint32_t pixel) {
    const uint32_t width = (uint32_t)self->result->left_colour.width;
    return reconstruct_colour_row(self->result, (int)(pixel / width)) + 3 * (pixel % width);
}

static void put_points(void *cookie, const struct surface_part *part) {
    struct surface_file *self = cookie;
    for (uint32_t vertex = 0; vertex < part->vertex_count; vertex++) {
        if (surface_figures_is_filled(self->result, part->vertex_pixel[vertex])) {
            continue;
        }
        const struct triangulate_point *point = &part->points[vertex];
        const uint8_t *rgb = colour_of(self, part->vertex_pixel[vertex]);
        unsigned char bytes[WRITE_PCD_PIXEL_BYTES];
        output_file_put_f32(bytes, (float)point->x_um / self->unit_um);
        output_file_put_f32(bytes + 4, (float)point->y_um / self->unit_um);
        output_file_put_f32(bytes + 8, (float)point->z_um / self->unit_um);
        // PCL's "rgb" is the integer 0x00RRGGBB in the bytes of a float.
        output_file_put_u32(bytes + 12,
                            (uint32_t)rgb[0] << 16 | (uint32_t)rgb[1] << 8 | (uint32_t)rgb[2]);
        output_file_put_f32(bytes + 16, (float)point->sigma_um / self->unit_um);
        output_file_write(&self->file, bytes, sizeof bytes);
    }
}

int write_pcd(const struct reconstruct_context *context, const char *path,
              struct message *message) {
    const struct reconstruct_result *result = context->result;
    const uint32_t points = surface_figures_measured_count(result);
    struct surface_file self = {.result = result, .unit_um = reconstruct_context_unit_um(context)};
    output_file_open(&self.file, path);
    if (self.file.stream != NULL) {
        fputs("# .PCD v0.7 - Point Cloud Data file format\n", self.file.stream);
        write_comments(context, "#", self.file.stream);
        fprintf(self.file.stream, "# lengths in %s\n",
                context->metric ? reconstruct_context_unit_name(context) : "an assumed unit");
        fprintf(self.file.stream,
                "VERSION 0.7\n"
                "FIELDS x y z rgb sigma\nSIZE 4 4 4 4 4\nTYPE F F F F F\nCOUNT 1 1 1 1 1\n"
                "WIDTH %" PRIu32 "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS %" PRIu32
                "\nDATA binary\n",
                points, points);
    }
    surface_walk(result, SURFACE_POINTS, put_points, &self);
    return output_file_close(&self.file, message);
}

int write_pfm(const struct reconstruct_context *context, const char *path,
              struct message *message) {
    const struct match_output *match = &context->result->match;
    const int width = match->disparity_q8.width, height = match->disparity_q8.height;
    struct output_file file;
    output_file_open(&file, path);
    if (file.stream != NULL) {
        fprintf(file.stream, "Pf\n%d %d\n-1.0\n", width, height);
    }
    unsigned char row[4 * IMAGE_MAX_SIDE_PX];
    for (int y = height - 1; y >= 0; y--) {
        const int32_t *disparity_q8 = image_i32_row(&match->disparity_q8, y);
        const uint8_t *reason = image_u8_row(&match->reason, y);
        for (int x = 0; x < width; x++) {
            output_file_put_f32(row + 4 * x, reason_has_disparity(reason[x])
                                                 ? (float)disparity_q8[x] / 256.0f
                                                 : INFINITY);
        }
        output_file_write(&file, row, 4 * (size_t)width);
    }
    return output_file_close(&file, message);
}

static void put_header(const struct reconstruct_context *context,
                       const struct reconstruct_result *result, FILE *stream) {
    const bool filled = result->reason_count[REASON_FILLED] > 0;
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
    fputs(filled ? "property uchar filled\n" : "", stream);
    fprintf(stream, "element face %" PRIu32 "\n", result->triangle_count);
    fputs("property list uchar int vertex_indices\nend_header\n", stream);
}

static void put_vertices(void *cookie, const struct surface_part *part) {
    struct surface_file *self = cookie;
    const float unit_um = self->unit_um;
    for (uint32_t vertex = 0; vertex < part->vertex_count; vertex++) {
        const struct triangulate_point *point = &part->points[vertex];
        const int16_t *normal_q14 = part->normals_q14[vertex];
        unsigned char bytes[WRITE_PLY_VERTEX_BYTES];
        output_file_put_f32(bytes, (float)point->x_um / unit_um);
        output_file_put_f32(bytes + 4, (float)point->y_um / unit_um);
        output_file_put_f32(bytes + 8, (float)point->z_um / unit_um);
        for (int i = 0; i < 3; i++) {
            output_file_put_f32(bytes + 12 + 4 * i, (float)normal_q14[i] / 16384.0f);
        }
        memcpy(bytes + 24, colour_of(self, part->vertex_pixel[vertex]), 3);
        output_file_put_f32(bytes + 27, (float)point->sigma_um / unit_um);
        output_file_put_f32(bytes + 31, (float)point->miss_um / unit_um);
        bytes[WRITE_PLY_VERTEX_BYTES - 1] =
            surface_figures_is_filled(self->result, part->vertex_pixel[vertex]);
        output_file_write(&self->file, bytes, sizeof bytes - (self->filled ? 0 : 1));
    }
}

static void put_faces(void *cookie, const struct surface_part *part) {
    struct surface_file *self = cookie;
    for (uint32_t face = 0; face < part->triangle_count; face++) {
        unsigned char bytes[WRITE_PLY_FACE_BYTES] = {3};
        for (int corner = 0; corner < 3; corner++) {
            output_file_put_u32(bytes + 1 + 4 * corner, part->triangles[face][corner]);
        }
        output_file_write(&self->file, bytes, sizeof bytes);
    }
}

int write_ply(const struct reconstruct_context *context, const char *path,
              struct message *message) {
    const struct reconstruct_result *result = reconstruct_context_ply(context);
    struct surface_file self = {.result = result,
                                .unit_um = reconstruct_context_unit_um(context),
                                .filled = result->reason_count[REASON_FILLED] > 0};
    output_file_open(&self.file, path);
    if (self.file.stream != NULL) {
        put_header(context, result, self.file.stream);
    }
    surface_walk(result, SURFACE_NORMALS, put_vertices, &self);
    surface_walk(result, SURFACE_TRIANGLES, put_faces, &self);
    return output_file_close(&self.file, message);
}

int write_reasons(const struct reconstruct_context *context, const char *path,
                  struct message *message) {
    const struct image_u8 *reason = &context->result->match.reason;
    struct output_file file;
    output_file_open(&file, path);
    if (file.stream != NULL) {
        fputs("P5\n", file.stream);
        for (int code = 0; code < REASON_COUNT; code++) {
            fprintf(file.stream, "# %d %s\n", code, reason_text(code));
        }
        if (context->mismatch.text[0] != '\0') {
            fprintf(file.stream, "# accepted mismatch: %s\n", context->mismatch.text);
        }
        fprintf(file.stream, "%d %d\n255\n", reason->width, reason->height);
    }
    for (int y = 0; y < reason->height; y++) {
        output_file_write(&file, image_u8_row(reason, y), (size_t)reason->width);
    }
    return output_file_close(&file, message);
}

int write_result(const struct reconstruct_context *context, const char *path,
                 struct message *message) {
    struct output_file file;
    output_file_open(&file, path);
    if (file.stream != NULL) {
        result_json_print(context, file.stream);
    }
    return output_file_close(&file, message);
}
