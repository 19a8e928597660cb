// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_inputs.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "console/pair/calibration_match.h"
#include "core/error.h"

/// Defaults if unknown; the assumed focal length is the width (53 degrees across), in narrow images
/// a quarter of the height.
static const double assumed_baseline_mm = 100.0;

int reconstruct_inputs_check(const struct reconstruct_inputs *inputs, struct message *message) {
    const struct image_file *const sides[2] = {&inputs->left, &inputs->right};
    for (int side = 0; side < 2; side++) {
        const struct raw_image *image = &sides[side]->image;
        if (image->width_px < MATCH_MIN_WIDTH_PX || image->height_px < MATCH_MIN_HEIGHT_PX) {
            return message_set(message, ERROR_TOO_SMALL,
                               "%s: %dx%d pixels are too few (at least %dx%d are required)",
                               sides[side]->path, image->width_px, image->height_px,
                               MATCH_MIN_WIDTH_PX, MATCH_MIN_HEIGHT_PX);
        }
    }
    return ERROR_OK;
}

/// Only a calibration explains images of two sizes.
static int refuse_two_sizes(const struct reconstruct_inputs *inputs, struct message *message) {
    const struct image_file *left = &inputs->left, *right = &inputs->right;
    if (left->file_width_px == right->file_width_px &&
        left->file_height_px == right->file_height_px) {
        return ERROR_OK;
    }
    return message_set(message, ERROR_SIZE_MISMATCH,
                       "the images differ in size: %s is %dx%d, %s is %dx%d pixels (a calibration "
                       "of this pair is required)",
                       left->path, left->file_width_px, left->file_height_px, right->path,
                       right->file_width_px, right->file_height_px);
}

static int read_image(const struct reconstruct_source *source, int side, const char *path,
                      const struct image_request *request, struct image_file *file,
                      struct message *message) {
    if (source->read_image == NULL) {
        return image_file_read(path, source->program->formats, source->program->format_count,
                               request, file, message);
    }
    *file = (struct image_file){.path = path, .request = request, .shrink = 1};
    const int error = source->read_image(source->self, side, request, file, message);
    if (error != ERROR_OK) {
        image_file_free(file);
    }
    return error;
}

static int read_images(const struct reconstruct_request *request,
                       const struct reconstruct_source *source,
                       const struct image_request *image_request, struct reconstruct_inputs *inputs,
                       struct message *message) {
    int error = read_image(source, 0, request->left_path, image_request, &inputs->left, message);
    if (error == ERROR_OK) {
        error = read_image(source, 1, request->right_path, image_request, &inputs->right, message);
    }
    if (error == ERROR_OK) {
        error = reconstruct_inputs_check(inputs, message);
    }
    if (error != ERROR_OK) {
        reconstruct_inputs_free(inputs);
    }
    return error;
}

static void warn_if_dark(const struct image_file *file, struct reconstruct_context *context) {
    const int bits = file->image.bits;
    int used = 8;
    while (used < bits && file->brightest >> used != 0) {
        used++;
    }
    if (bits - used >= 3) {
        reconstruct_context_warn(context,
                                 "%s: the brightest of the %d bit pixels is %d; if only %d bits "
                                 "are significant, give --bits",
                                 file->path, bits, file->brightest, used);
    }
}

static void record_turn(const struct image_file *file, struct reconstruct_context *context) {
    if (file->orientation > 1) {
        reconstruct_context_warn(context,
                                 "%s: turned by its orientation (%d), as OpenCV does; the "
                                 "calibration must come from images turned the same way",
                                 file->path, file->orientation);
    }
}

static struct lens shrunk_lens(struct lens lens, int factor, int width_px, int height_px) {
    // Pixel centres: x' = (x + 1/2) / factor - 1/2.
    lens.fx_px /= factor;
    lens.fy_px /= factor;
    lens.cx_px = (lens.cx_px + 0.5) / factor - 0.5;
    lens.cy_px = (lens.cy_px + 0.5) / factor - 0.5;
    lens.width_px = width_px;
    lens.height_px = height_px;
    return lens;
}

static bool lens_fits(const struct lens *lens, int width_px, int height_px) {
    return lens->width_px == width_px && lens->height_px == height_px;
}

int reconstruct_inputs_fit(struct reconstruct_inputs *inputs, const char *name,
                           struct message *message) {
    const struct image_file *const files[2] = {&inputs->left, &inputs->right};
    struct calibration *calibration = &inputs->calibration;
    struct lens *const lenses[2] = {&calibration->left, &calibration->right};
    int in_memory = 0, in_file = 0;
    for (int side = 0; side < 2; side++) {
        const struct image_file *file = files[side];
        in_memory += lens_fits(lenses[side], file->image.width_px, file->image.height_px) ? 1 : 0;
        in_file += lens_fits(lenses[side], file->file_width_px, file->file_height_px) ? 1 : 0;
    }
    if (in_memory == 2) {
        return ERROR_OK;
    }
    if (in_file != 2) {
        return message_set(message, ERROR_SIZE_MISMATCH,
                           "the images are %dx%d (left) and %dx%d pixels (right), %s is for %dx%d "
                           "(left) and %dx%d (right)",
                           files[0]->file_width_px, files[0]->file_height_px,
                           files[1]->file_width_px, files[1]->file_height_px, name,
                           lenses[0]->width_px, lenses[0]->height_px, lenses[1]->width_px,
                           lenses[1]->height_px);
    }
    for (int side = 0; side < 2; side++) {
        *lenses[side] = shrunk_lens(*lenses[side], files[side]->shrink, files[side]->image.width_px,
                                    files[side]->image.height_px);
    }
    const int error = calibration_round(calibration);
    if (error != ERROR_OK) {
        return message_set(message, error, "the calibration is invalid after shrinking by %d: %s",
                           files[0]->shrink, error_text(error));
    }
    return ERROR_OK;
}

static int assume_calibration(const struct reconstruct_request *request,
                              struct reconstruct_inputs *inputs,
                              struct reconstruct_context *context, struct message *message) {
    const struct image_file *file = &inputs->left;
    int error = refuse_two_sizes(inputs, message);
    if (error != ERROR_OK) {
        return error;
    }
    // Narrow images would otherwise reach farther from the axis than rays are measured.
    const double quarter_px = file->file_height_px / 4.0;
    const double assumed_px = file->file_width_px > quarter_px ? file->file_width_px : quarter_px;
    const double focal_px = request->focal_px > 0 ? request->focal_px : assumed_px;
    const double baseline_mm =
        request->baseline_mm > 0 ? request->baseline_mm : assumed_baseline_mm;
    const struct lens lens = {
        .width_px = file->file_width_px,
        .height_px = file->file_height_px,
        .fx_px = focal_px,
        .fy_px = focal_px,
        .cx_px = (file->file_width_px - 1) / 2.0,
        .cy_px = (file->file_height_px - 1) / 2.0,
    };
    struct calibration made = {
        .id = "assumed",
        .rectified = true,
        .translation_right_left_mm = {-baseline_mm, 0, 0},
    };
    made.left = made.right =
        shrunk_lens(lens, file->shrink, file->image.width_px, file->image.height_px);
    inputs->metric = request->focal_px > 0 && request->baseline_mm > 0;
    snprintf(made.note, sizeof made.note, "focal length %s, baseline %s, centres assumed",
             request->focal_px > 0 ? "given" : "assumed",
             request->baseline_mm > 0 ? "given" : "assumed");
    error = calibration_round(&made);
    if (error == ERROR_OK) {
        error = calibration_validate(&made, NULL);
    }
    if (error != ERROR_OK) {
        return message_set(message, error, "invalid --focal or --baseline: %s", error_text(error));
    }
    inputs->calibration = made;
    snprintf(inputs->calibration_format, sizeof inputs->calibration_format, "assumed");
    if (inputs->metric) {
        reconstruct_context_warn(context,
                                 "principal points are assumed to be in the middle of the images");
    } else {
        reconstruct_context_warn(
            context,
            "the geometry is assumed (focal length %.6g px, baseline %.6g mm): "
            "shapes are right only up to a stretch in depth, lengths mean "
            "nothing",
            focal_px, baseline_mm);
    }
    return ERROR_OK;
}

/// What every calibration that was not assumed brings with it.
static void accept_calibration(const struct reconstruct_request *request,
                               struct reconstruct_inputs *inputs,
                               struct reconstruct_context *context) {
    inputs->metric = true;
    if (inputs->calibration.note[0] != '\0') {
        reconstruct_context_warn(context, "calibration: %s", inputs->calibration.note);
    }
    inputs->calibration_path = request->calibration_path;
}

static int load_calibration(const struct reconstruct_request *request, calibration_loader *load,
                            struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                            struct message *message) {
    const struct calibration_request wanted = {
        .path = request->calibration_path,
        .image_width_px = inputs->left.file_width_px,
        .image_height_px = inputs->left.file_height_px,
        .unit = reconstruct_request_unit(request),
        .rectified = request->rectified,
        .first_camera = request->first_camera,
    };
    // Opening a pipe would block until its other end opens; lists of files are not a path.
    struct stat status;
    if (stat(wanted.path, &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode)) {
        return message_set(message, ERROR_ARGUMENT, "%s: neither a file nor a directory",
                           wanted.path);
    }
    const int error = load(&wanted, &inputs->calibration, inputs->calibration_format, message);
    if (error == ERROR_OK) {
        accept_calibration(request, inputs, context);
    }
    return error;
}

int reconstruct_inputs_copy(const struct reconstruct_request *request,
                            const struct reconstruct_source *source,
                            struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                            struct message *message) {
    if (request->rectified && !source->calibration->rectified) {
        return message_set(message, ERROR_ARGUMENT,
                           "%s: not a calibration of rectified images (load it as one)",
                           request->calibration_path);
    }
    inputs->calibration = *source->calibration;
    snprintf(inputs->calibration_format, sizeof inputs->calibration_format, "%s",
             source->calibration_format);
    accept_calibration(request, inputs, context);
    return ERROR_OK;
}

/// Images without a session do not record the axis positions; a fixed rig has no axes.
static void compare_axes(const struct reconstruct_inputs *inputs,
                         struct reconstruct_context *context) {
    static const struct calibration_origin nothing;
    if (inputs->calibration.has_origin &&
        calibration_match_is_partial(&inputs->calibration, &nothing)) {
        reconstruct_context_warn(context,
                                 "these images do not record pan, zoom, focus and iris: the "
                                 "calibration is assumed to match");
    }
}

int reconstruct_inputs_calibrate(const struct reconstruct_request *request,
                                 calibration_loader *load, struct reconstruct_inputs *inputs,
                                 struct reconstruct_context *context, struct message *message) {
    return request->calibration_path != NULL
               ? load_calibration(request, load, inputs, context, message)
               : assume_calibration(request, inputs, context, message);
}

void reconstruct_inputs_doubt(const struct reconstruct_inputs *inputs,
                              struct reconstruct_context *context) {
    const struct image_file *const sides[2] = {&inputs->left, &inputs->right};
    for (int side = 0; side < 2; side++) {
        warn_if_dark(sides[side], context);
        record_turn(sides[side], context);
    }
    if (inputs->left.shrink > 1) {
        reconstruct_context_warn(context, "the images were shrunk by %d on reading",
                                 inputs->left.shrink);
    }
}

static enum image_bayer bayer_of(const struct reconstruct_request *request) {
    if (request->bayer < 0) {
        return IMAGE_BAYER_BY_FORMAT;
    }
    return request->bayer == 0 ? IMAGE_BAYER_NONE : IMAGE_BAYER_GRBG;
}

int reconstruct_inputs_read(void *self, const struct reconstruct_request *request,
                            struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                            struct message *message) {
    const struct reconstruct_source *source = self;
    const struct image_request image_request = {
        .bits = request->bits,
        .bayer = bayer_of(request),
        .raw_width_px = request->raw_px[0],
        .raw_height_px = request->raw_px[1],
        .scale = request->scale,
    };
    memset(inputs, 0, sizeof *inputs);
    int error = read_images(request, source, &image_request, inputs, message);
    if (error != ERROR_OK) {
        return error;
    }
    inputs->left.request = inputs->right.request = NULL;  // only valid during this call
    error = source->calibration != NULL
                ? reconstruct_inputs_copy(request, source, inputs, context, message)
                : reconstruct_inputs_calibrate(request, source->program->load_calibration, inputs,
                                               context, message);
    if (error == ERROR_OK && request->calibration_path != NULL) {
        compare_axes(inputs, context);
        error = reconstruct_inputs_fit(inputs, request->calibration_path, message);
    }
    if (error != ERROR_OK) {
        reconstruct_inputs_free(inputs);
        return error;
    }
    reconstruct_inputs_doubt(inputs, context);
    return ERROR_OK;
}

void reconstruct_inputs_free(struct reconstruct_inputs *inputs) {
    image_file_free(&inputs->left);
    image_file_free(&inputs->right);
}
