// SPDX-License-Identifier: Apache-2.0
#include "stereo/match/match_validity.h"

#include "core/error.h"

// No sum here can overflow.
bool match_range_is_legal(const struct match_options *options) {
    return options->disparity_count >= 1 && options->disparity_count <= MATCH_MAX_DISPARITIES &&
           options->extra_below >= 0 && options->extra_below <= MATCH_MAX_DISPARITIES &&
           options->extra_above >= 0 && options->extra_above <= MATCH_MAX_DISPARITIES &&
           match_searched_count(options) <= MATCH_MAX_DISPARITIES &&
           options->disparity_min >= -MATCH_DISPARITY_LIMIT + options->extra_below &&
           match_searched_count(options) - options->extra_below <=
               MATCH_DISPARITY_LIMIT - options->disparity_min;
}

static bool sizes_agree(const struct match_input *input, const struct match_output *output) {
    const int width = input->left.width, height = input->left.height;
    return input->right.width == width && input->right.height == height &&
           output->disparity_q8.width == width && output->disparity_q8.height == height &&
           output->reason.width == width && output->reason.height == height &&
           output->confidence.width == width && output->confidence.height == height;
}

int match_check(const struct match_input *input, const struct match_options *options,
                const struct match_output *output) {
    const struct image_u8 *left = &input->left;
    if (!sizes_agree(input, output)) {
        return ERROR_SIZE_MISMATCH;
    }
    if (left->width > IMAGE_MAX_SIDE_PX || left->height > IMAGE_MAX_SIDE_PX) {
        return ERROR_TOO_LARGE;
    }
    if (left->width < MATCH_MIN_WIDTH_PX || left->height < MATCH_MIN_HEIGHT_PX) {
        return ERROR_TOO_SMALL;
    }
    if (!match_range_is_legal(options)) {
        return ERROR_DISPARITY_RANGE;
    }
    const bool legal = options->speckle_px >= 0 && (unsigned)options->preset < MATCH_PRESET_COUNT;
    return legal ? ERROR_OK : ERROR_ARGUMENT;
}
