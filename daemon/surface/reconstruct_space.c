// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_space.h"

#include <stdio.h>

#include "core/error.h"

enum { ADVICE_BYTES = 160, HEAD_BYTES = 65536, PARTS = 20 };

static const double bytes_per_mb = 1e6;

/// What a message is made from.
struct refusal {
    const struct reconstruct_context *context;
    const struct reconstruct_program *program;
    const char *list;
    const struct free_space *available;
};

/// What is needed under a plan. `mesh`: with the mesh, if it is wanted.
static struct free_space need_of(const struct reconstruct_context *context,
                                 const struct reconstruct_program *program, const char *list,
                                 const struct rectify_plan *plan, bool mesh) {
    const uint64_t pixels = (uint64_t)plan->width_px * (uint64_t)plan->height_px;
    const struct reconstruct_need memory =
        reconstruct_needs(&context->left, &context->right, context->calibration, plan,
                          context->options, context->threads);
    struct free_space need = {.memory_bytes = memory.bytes,
                              .freed_bytes = memory.bytes - memory.result_bytes};
    if (context->rows_written != NULL &&
        result_format_listed(list, result_formats[RESULT_COMPACT].file_name)) {
        need.freed_bytes += memory.map_bytes;
    }
    for (int i = 0; i < RESULT_FORMATS; i++) {
        const struct result_format *format = &result_formats[i];
        if (program->writers[i] != NULL && result_format_listed(list, format->file_name) &&
            (mesh || i != RESULT_MESH_PLY)) {
            need.files_bytes += (uint64_t)format->pixel_bytes * pixels + HEAD_BYTES;
        }
    }
    return need;
}

struct free_space reconstruct_space_need(const struct reconstruct_context *context,
                                         const struct reconstruct_program *program,
                                         const char *list) {
    return need_of(context, program, list, &context->result->plan, true);
}

/// Options for a part of the image: by a smaller scale, or a region in its middle.
static struct rectify_options part_of(const struct reconstruct_context *context, double part,
                                      bool region) {
    const struct rectify_plan *whole = &context->result->plan;
    struct rectify_options options = context->options->rectify;
    if (region) {
        options.region_width_px = (int)(part * whole->width_px);
        options.region_height_px = (int)(part * whole->height_px);
        options.region_x_px += (whole->width_px - options.region_width_px) / 2;
        options.region_y_px += (whole->height_px - options.region_height_px) / 2;
    } else {
        options.scale *= part;
    }
    return options;
}

/// The largest scale or region that fits, as the user would write it; false: none.
static bool advise_part(const struct refusal *self, bool region, char text[ADVICE_BYTES]) {
    const struct reconstruct_context *context = self->context;
    const char *name = context->caller->scale;
    const char *dashes = name[0] == '-' ? "--" : "";
    const char sign = name[0] == '-' ? ' ' : '=';
    for (int i = PARTS - 1; i > 0; i--) {
        const struct rectify_options options = part_of(context, (double)i / PARTS, region);
        struct rectify_plan plan;
        if (rectify_plan_make(context->calibration, &options, &plan) != ERROR_OK) {
            continue;
        }
        const struct free_space need = need_of(context, self->program, self->list, &plan, true);
        if (!free_space_fits(self->available, &need)) {
            continue;
        }
        if (region) {
            snprintf(text, ADVICE_BYTES, "%sregion%c%d,%d,%d,%d", dashes, sign, options.region_x_px,
                     options.region_y_px, options.region_width_px, options.region_height_px);
        } else {
            snprintf(text, ADVICE_BYTES, "%s%c%.3g", name, sign, options.scale / context->shrink);
        }
        return true;
    }
    return false;
}

/// What would fit, as the end of a message.
static void advise(const struct refusal *self, char advice[MESSAGE_BYTES]) {
    const struct reconstruct_context *context = self->context;
    char parts[3][ADVICE_BYTES];
    int count = 0;
    // A region is in pixels of the scaled image, so that another scale would cut another part.
    if (context->options->rectify.region_width_px == 0) {
        count += advise_part(self, false, parts[count]);
    }
    count += advise_part(self, true, parts[count]);
    const struct free_space all = reconstruct_space_need(context, self->program, self->list);
    const struct free_space need =
        need_of(context, self->program, self->list, &context->result->plan, false);
    if (need.files_bytes < all.files_bytes && free_space_fits(self->available, &need)) {
        snprintf(parts[count++], ADVICE_BYTES, "all files but %s",
                 result_formats[RESULT_MESH_PLY].file_name);
    }
    size_t length = 0;
    for (int i = 0; i < count; i++) {
        length += (size_t)snprintf(advice + length, MESSAGE_BYTES - length, "%s%s",
                                   i > 0 ? " or " : "", parts[i]);
    }
    if (count > 0) {
        snprintf(advice + length, MESSAGE_BYTES - length, " would fit");
    } else {
        snprintf(advice, MESSAGE_BYTES, "make the images smaller with %s",
                 context->caller->smaller);
    }
}

int reconstruct_space_refuse(const struct reconstruct_context *context,
                             const struct reconstruct_program *program, const char *list,
                             const struct free_space *available, struct message *message) {
    const struct refusal self = {context, program, list, available};
    const struct free_space need = reconstruct_space_need(context, program, list);
    char advice[MESSAGE_BYTES];
    advise(&self, advice);
    if (need.files_bytes > available->files_bytes) {
        return message_set(
            message, ERROR_FULL,
            "no room for the results: up to %.1f MB are required, %.1f MB are free%s "
            "(%s)",
            (double)need.files_bytes / bytes_per_mb, (double)available->files_bytes / bytes_per_mb,
            available->files_limited ? " of files_limit" : "", advice);
    }
    return message_set(message, ERROR_MEMORY,
                       "out of memory: %.1f MB are required%s, %.1f MB are free (%s)",
                       (double)free_space_memory_bytes(available, &need) / bytes_per_mb,
                       available->files_in_memory ? " with the results" : "",
                       (double)available->memory_bytes / bytes_per_mb, advice);
}
