// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_pictures.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/error.h"
#include "daemon/surface/result/result_figures.h"
#include "stereo/image/picture_view.h"

static const double poor_percent = 50, permille_a_percent = 10;

/// In parts per thousand. No recorded pair is near them (brightness 136, saturated 306, sharpness
/// 370 and, relative to the other side, 830), but they only count if little could be measured.
enum {
    DARK = 60,  // the MT9T001 gives 41 in the dark
    BLACK = 600,
    SATURATED = 200,
    BLURRED = 250,
    BLURRED_BESIDE = 650,  // relative to the other side's sharpness
    ALIKE = 400,           // view score: certainly the same scene
    UNLIKE = 350,
    CLEARLY = 150,  // difference in score that is significant
    OVERLAP = 500,
};

enum { LEFT = 1, RIGHT = 2, BOTH = LEFT | RIGHT, SIDES = 2 };

static void view_of(const struct raw_image *image, struct picture_view *view) {
    const struct picture_form form = picture_form_of(image);
    struct picture_view_sums sums;
    picture_view_begin(&sums, &form, image->height_px);
    for (int y = 0; y < image->height_px; y++) {
        picture_view_row(&sums, raw_image_row(image, y));
    }
    picture_view_end(&sums, view);
}

static bool is_same(const struct raw_image *left, const struct raw_image *right) {
    if (left->width_px != right->width_px || left->height_px != right->height_px ||
        left->layout != right->layout) {
        return false;
    }
    for (int y = 0; y < left->height_px; y++) {
        if (memcmp(raw_image_row(left, y), raw_image_row(right, y),
                   raw_image_row_values(left) * sizeof *left->data) != 0) {
            return false;
        }
    }
    return true;
}

int reconstruct_pictures_assess(struct reconstruct_context *context, struct message *message) {
    context->picture[0] = picture_stats_of(&context->left);
    context->picture[1] = picture_stats_of(&context->right);
    // Black images may be identical: those are reported as too dark.
    if (context->picture[0].sharpness_permille == 0 || !is_same(&context->left, &context->right)) {
        return ERROR_OK;
    }
    return message_set(message, ERROR_ARGUMENT,
                       "%s and %s are the same image (give one of each camera)", context->left_path,
                       context->right_path);
}

// ---- causes

/// Appends a cause, after "; " unless it is the first.
static void add(struct message *cause, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void add(struct message *cause, const char *format, ...) {
    const size_t length = strlen(cause->text);
    const char *before = length > 0 ? "; " : "";
    va_list arguments;
    snprintf(cause->text + length, sizeof cause->text - length, "%s", before);
    va_start(arguments, format);
    vsnprintf(cause->text + length + strlen(before), sizeof cause->text - length - strlen(before),
              format, arguments);
    va_end(arguments);
}

static const char *which(int sides) {
    if (sides == BOTH) {
        return "both images are";
    }
    return sides == LEFT ? "the left image is" : "the right image is";
}

static void explain_light(const struct reconstruct_context *context, struct message *cause) {
    const struct picture_stats *picture = context->picture;
    int dark_sides = 0, saturated_sides = 0;
    for (int side = 0; side < SIDES; side++) {
        const bool is_dark =
            picture[side].brightness_permille < DARK || picture[side].black_permille >= BLACK;
        dark_sides |= is_dark ? LEFT << side : 0;
        saturated_sides |= picture[side].saturated_permille >= SATURATED ? LEFT << side : 0;
    }
    if (dark_sides != 0) {
        add(cause,
            "%s too dark (brightness left %.1f %%, right %.1f %%): add light, exposure or gain",
            which(dark_sides), picture[0].brightness_permille / permille_a_percent,
            picture[1].brightness_permille / permille_a_percent);
    }
    if (saturated_sides != 0) {
        add(cause, "%s too bright (saturated left %.0f %%, right %.0f %%): lower exposure or gain",
            which(saturated_sides), picture[0].saturated_permille / permille_a_percent,
            picture[1].saturated_permille / permille_a_percent);
    }
}

static int find_blurred(int left_permille, int right_permille) {
    if (left_permille == 0 || right_permille == 0) {
        return 0;  // no contrast to judge
    }
    if (left_permille < BLURRED && right_permille < BLURRED) {
        return BOTH;
    }
    if (left_permille * 1000 < right_permille * BLURRED_BESIDE) {
        return LEFT;
    }
    return right_permille * 1000 < left_permille * BLURRED_BESIDE ? RIGHT : 0;
}

static void explain_blur(const struct reconstruct_context *context, struct message *cause) {
    const int left = context->picture[0].sharpness_permille;
    const int right = context->picture[1].sharpness_permille;
    const int sides = find_blurred(left, right);
    if (sides != 0) {
        add(cause,
            "%s blurred (sharpness left %.0f %%, right %.0f %%): focus, and keep cameras and scene "
            "still",
            which(sides), left / permille_a_percent, right / permille_a_percent);
    }
}

/// The disparity in the image centre if the images are `dx` cells apart. False: outside of the
/// lens's field of view.
static bool disparity_of(const struct reconstruct_context *context, int dx, double *disparity_px) {
    const struct rectify_plan *plan = &context->result->plan;
    const struct lens *lenses[SIDES] = {&context->calibration->left, &context->calibration->right};
    const double *turns[SIDES] = {plan->R_rect_left, plan->R_rect_right};
    const double centre_px[SIDES] = {plan->cx_left_px, plan->cx_right_px};
    double x_px[SIDES];
    for (int side = 0; side < SIDES; side++) {
        const double half = (side == 0 ? 0.5 : -0.5) * dx / PICTURE_VIEW_COLUMNS;
        const double pixel_px[2] = {(0.5 + half) * lenses[side]->width_px,
                                    0.5 * lenses[side]->height_px};
        double ray[3];
        if (!lens_ray(lenses[side], pixel_px, ray)) {
            return false;
        }
        const double *turn = turns[side];
        const double z = turn[6] * ray[0] + turn[7] * ray[1] + turn[8] * ray[2];
        if (z <= 0) {
            return false;
        }
        x_px[side] = centre_px[side] +
                     plan->f_px * (turn[0] * ray[0] + turn[1] * ray[1] + turn[2] * ray[2]) / z;
    }
    *disparity_px = x_px[0] - x_px[1];
    return true;
}

/// The shifts in cells that the search covers. False: none.
static bool searched_shifts(const struct reconstruct_context *context, int *min_dx, int *max_dx) {
    const struct rectify_plan *plan = &context->result->plan;
    *min_dx = PICTURE_VIEW_MAX_DX + 1;
    *max_dx = -PICTURE_VIEW_MAX_DX - 1;
    for (int dx = -PICTURE_VIEW_MAX_DX; dx < PICTURE_VIEW_MAX_DX; dx++) {
        double from_px, to_px;
        if (!disparity_of(context, dx, &from_px) || !disparity_of(context, dx + 1, &to_px) ||
            to_px <= plan->disparity_min ||
            from_px >= plan->disparity_min + plan->disparity_count) {
            continue;
        }
        *min_dx = dx < *min_dx ? dx : *min_dx;
        *max_dx = dx + 1 > *max_dx ? dx + 1 : *max_dx;
    }
    return *min_dx <= *max_dx;
}

/// Whether the scene is within the search only once left and right are swapped.
static bool is_swapped(const struct reconstruct_context *context, const struct picture_view *left,
                       const struct picture_view *right) {
    int min_dx, max_dx;
    if (!searched_shifts(context, &min_dx, &max_dx)) {
        return false;
    }
    const int as_is =
        picture_view_compare(left, right, PICTURE_AS_IS, min_dx, max_dx).score_permille;
    const int swapped =
        picture_view_compare(right, left, PICTURE_AS_IS, min_dx, max_dx).score_permille;
    return swapped >= ALIKE && swapped >= as_is + CLEARLY;
}

/// The turn that makes the right image match the left one, if it does not match unturned.
static enum picture_turn turn_of(const struct picture_view *left, const struct picture_view *right,
                                 int as_is) {
    enum picture_turn best = PICTURE_AS_IS;
    int min = as_is + CLEARLY;
    for (int turn = PICTURE_ROTATED; turn < PICTURE_TURNS; turn++) {
        const int found = picture_view_compare(left, right, (enum picture_turn)turn,
                                               -PICTURE_VIEW_MAX_DX, PICTURE_VIEW_MAX_DX)
                              .score_permille;
        if (found >= ALIKE && found >= min) {
            best = (enum picture_turn)turn;
            min = found;
        }
    }
    return best;
}

/// Images in the wrong order or orientation; other causes are meaningless then.
static bool explain_order(const struct reconstruct_context *context,
                          const struct picture_view *left, const struct picture_view *right,
                          int as_is, struct message *cause) {
    static const char *const turned[PICTURE_TURNS] = {
        NULL, "is upside down (rotated by 180 degrees)", "is flipped top to bottom",
        "is mirrored left to right"};
    const enum picture_turn turn = turn_of(left, right, as_is);
    if (turn != PICTURE_AS_IS) {
        add(cause, "one image %s relative to the other: turn its camera or the image",
            turned[turn]);
    } else if (is_swapped(context, left, right)) {
        add(cause,
            context->calibration_path != NULL
                ? "left and right are swapped (name them the other way round), or both images "
                  "are upside down or mirrored"
                : "left and right are swapped (name them the other way round), both images are "
                  "upside down or mirrored, or the pair is not rectified");
    }
    return cause->text[0] != '\0';
}

/// Images without texture do not match either; the pixels' reasons show that.
static bool has_texture(const struct reconstruct_context *context) {
    const struct reconstruct_result *result = context->result;
    const double pixels = (double)result->plan.width_px * result->plan.height_px;
    return 2.0 * result->reason_count[REASON_NO_TEXTURE] < pixels;
}

bool reconstruct_pictures_explain(const struct reconstruct_context *context,
                                  struct message *cause) {
    cause->text[0] = '\0';
    if (result_figures_density_percent(context->result) >= poor_percent) {
        return false;
    }
    struct picture_view left, right;
    view_of(&context->left, &left);
    view_of(&context->right, &right);
    const struct picture_overlay overlay = picture_view_compare(
        &left, &right, PICTURE_AS_IS, -PICTURE_VIEW_MAX_DX, PICTURE_VIEW_MAX_DX);
    const int alike = overlay.score_permille;
    if (explain_order(context, &left, &right, alike, cause)) {
        return true;
    }
    explain_light(context, cause);
    explain_blur(context, cause);
    if (alike >= ALIKE && overlay.overlap_permille < OVERLAP) {
        add(cause, "the views overlap by only %.0f %%: aim both cameras at the same thing",
            overlay.overlap_permille / permille_a_percent);
    } else if (alike < UNLIKE && has_texture(context) && cause->text[0] == '\0') {
        add(cause,
            "the images differ too much (similarity %.0f %%): check that both cameras are aimed at "
            "the same thing and that the calibration belongs to these images",
            alike / permille_a_percent);
    }
    return cause->text[0] != '\0';
}
