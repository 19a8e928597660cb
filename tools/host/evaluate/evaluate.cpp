// SPDX-License-Identifier: Apache-2.0
#include "tools/host/evaluate/evaluate.hpp"

#include <cmath>
#include <cstddef>
#include <limits>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/images/image_file.h"
#include "tools/host/formats/image_formats.hpp"
#include "tools/host/formats/pfm.hpp"
#include "tools/host/formats/whole_file.hpp"

namespace {

/// Running sums of one set of pixels.
struct tally {
    std::size_t pixels = 0;
    std::size_t bad[EVALUATE_THRESHOLDS] = {0, 0, 0, 0};
    double sum_px = 0, sum_square_px2 = 0;

    void add(double error_px) {
        pixels++;
        for (int i = 0; i < EVALUATE_THRESHOLDS; i++) {
            bad[i] += error_px > evaluate_thresholds_px[i] ? 1 : 0;
        }
        sum_px += error_px;
        sum_square_px2 += error_px * error_px;
    }

    evaluate_score score() const {
        evaluate_score result;
        result.pixels = pixels;
        if (pixels == 0) {
            return result;
        }
        const double count = static_cast<double>(pixels);
        for (int i = 0; i < EVALUATE_THRESHOLDS; i++) {
            result.bad_percent[i] = 100.0 * static_cast<double>(bad[i]) / count;
        }
        result.average_px = sum_px / count;
        result.rms_px = std::sqrt(sum_square_px2 / count);
        return result;
    }
};

double percent(std::size_t part, std::size_t whole) {
    return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

/// Fills row[begin, end), all rejected, from its kept neighbours.
void fill_gap(float *row, int width_px, int begin, int end) {
    float value = 0;
    if (begin > 0 && end < width_px) {
        value = row[begin - 1] < row[end] ? row[begin - 1] : row[end];
    } else if (begin > 0) {
        value = row[begin - 1];
    } else if (end < width_px) {
        value = row[end];
    }
    for (int x = begin; x < end; x++) {
        row[x] = value;
    }
}

}  // namespace

void evaluate_fill(int width_px, int height_px, float *disparity_px) {
    INVARIANT(width_px >= 0 && height_px >= 0);
    for (int y = 0; y < height_px; y++) {
        float *row =
            disparity_px + static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px);
        for (int x = 0; x < width_px; x++) {
            if (std::isfinite(row[x])) {
                continue;
            }
            int end = x + 1;
            while (end < width_px && !std::isfinite(row[end])) {
                end++;
            }
            fill_gap(row, width_px, x, end);
            x = end - 1;
        }
    }
}

namespace {

bool is_known(const evaluate_input &input, std::size_t i) {
    return std::isfinite(input.truth_px[i]) &&
           (input.mask == nullptr || input.mask[i] != EVALUATE_UNKNOWN);
}

}  // namespace

evaluate_result evaluate_disparity(const evaluate_input &input) {
    INVARIANT(input.width_px > 0 && input.height_px > 0);
    INVARIANT(input.disparity_px != nullptr && input.truth_px != nullptr);
    const std::size_t pixels =
        static_cast<std::size_t>(input.width_px) * static_cast<std::size_t>(input.height_px);
    std::vector<float> filled(input.disparity_px, input.disparity_px + pixels);
    if (input.round_disparity) {
        for (float &value : filled) {
            value = std::floor(value + 0.5F);
        }
    }
    evaluate_fill(input.width_px, input.height_px, filled.data());

    tally filled_all, filled_visible, saved_all, kept_visible;
    for (std::size_t i = 0; i < pixels; i++) {
        if (!is_known(input, i)) {
            continue;
        }
        const bool visible = input.mask == nullptr || input.mask[i] == EVALUATE_VISIBLE;
        const bool kept = std::isfinite(input.disparity_px[i]);
        const double error_px =
            std::fabs(static_cast<double>(filled[i]) - static_cast<double>(input.truth_px[i]));
        filled_all.add(error_px);
        if (visible) {
            filled_visible.add(error_px);
        }
        if (kept) {
            saved_all.add(error_px);
        }
        if (kept && visible) {
            kept_visible.add(error_px);
        }
    }
    evaluate_result result;
    result.filled_all = filled_all.score();
    result.filled_visible = filled_visible.score();
    result.saved_all = saved_all.score();
    result.kept_visible = kept_visible.score();
    result.density_all_percent = percent(saved_all.pixels, filled_all.pixels);
    result.density_visible_percent = percent(kept_visible.pixels, filled_visible.pixels);
    return result;
}

namespace {

constexpr float unknown = std::numeric_limits<float>::infinity();
constexpr double kitti_scale = 256;

/// A grey PNG; frees its pixels.
struct grey_png {
    image_file file{};

    grey_png() = default;
    grey_png(const grey_png &) = delete;
    grey_png &operator=(const grey_png &) = delete;
    ~grey_png() { image_file_free(&file); }

    bool read(const std::string &path, std::string *message) {
        const image_format png = {"PNG", "png", image_png_probe, image_png_read};
        image_request request{};
        request.scale = 1;
        struct message last_error;
        if (image_file_read(path.c_str(), &png, 1, &request, &file, &last_error) != 0) {
            *message = last_error.text;
            return false;
        }
        if (file.image.layout != RAW_GREY) {
            *message = path + ": a colour image (expected one value per pixel)";
            return false;
        }
        return true;
    }

    std::size_t pixels() const {
        return static_cast<std::size_t>(file.image.width_px) *
               static_cast<std::size_t>(file.image.height_px);
    }

    std::uint16_t value(std::size_t pixel) const {
        const std::size_t width = static_cast<std::size_t>(file.image.width_px);
        const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(pixel / width) * file.image.stride;
        return file.image.data[row + static_cast<std::ptrdiff_t>(pixel % width)];
    }
};

bool is_png(const std::string &path) {
    const std::string head = whole_file_head(path, 8);
    return head.size() == 8 &&
           image_png_probe(reinterpret_cast<const unsigned char *>(head.data()), head.size());
}

bool load_png(const std::string &path, double scale, evaluate_truth *truth, std::string *message) {
    grey_png png;
    if (!png.read(path, message)) {
        return false;
    }
    if (png.file.image.bits <= 8 && !(scale > 0)) {
        *message = path + ": 8-bit ground truth does not state its scale; give " +
                   "--ground-truth-scale (values per pixel of disparity, e.g. 1 or 4)";
        return false;
    }
    const double values_a_px = scale > 0 ? scale : kitti_scale;
    truth->width_px = png.file.image.width_px;
    truth->height_px = png.file.image.height_px;
    truth->disparity_px.assign(png.pixels(), unknown);
    for (std::size_t i = 0; i < png.pixels(); i++) {
        if (png.value(i) != 0) {
            truth->disparity_px[i] = static_cast<float>(png.value(i) / values_a_px);
        }
    }
    return true;
}

bool load_pfm(const std::string &path, evaluate_truth *truth, std::string *message) {
    pfm_image image;
    if (!pfm_read(path, &image, message)) {
        return false;
    }
    truth->width_px = image.width_px;
    truth->height_px = image.height_px;
    truth->disparity_px.swap(image.values);
    return true;
}

bool load_mask(const std::string &path, evaluate_truth *truth, std::string *message) {
    grey_png png;
    if (!png.read(path, message)) {
        return false;
    }
    if (png.file.image.width_px != truth->width_px ||
        png.file.image.height_px != truth->height_px) {
        *message = path + ": the mask is " + std::to_string(png.file.image.width_px) + "x" +
                   std::to_string(png.file.image.height_px) + ", the ground truth " +
                   std::to_string(truth->width_px) + "x" + std::to_string(truth->height_px);
        return false;
    }
    truth->mask.resize(png.pixels());
    for (std::size_t i = 0; i < png.pixels(); i++) {
        const std::uint16_t value = png.value(i);
        if (value != EVALUATE_UNKNOWN && value != EVALUATE_OCCLUDED && value != EVALUATE_VISIBLE) {
            *message = path + ": invalid mask value " + std::to_string(value) +
                       " (expected 255: seen by both, 128: occluded or 0: unknown)";
            return false;
        }
        truth->mask[i] = static_cast<std::uint8_t>(value);
    }
    return true;
}

}  // namespace

bool evaluate_truth_load(const std::string &path, const std::string &mask_path, double scale,
                         evaluate_truth *truth, std::string *message) {
    evaluate_truth loaded;
    if (!(is_png(path) ? load_png(path, scale, &loaded, message)
                       : load_pfm(path, &loaded, message))) {
        return false;
    }
    if (!mask_path.empty() && !load_mask(mask_path, &loaded, message)) {
        return false;
    }
    *truth = loaded;
    return true;
}

int evaluate_truth_check(const reconstruct_context *context, int size_px[2],
                         struct message *message) {
    evaluate_truth truth;
    std::string last_error;
    if (!evaluate_truth_load(context->ground_truth_path,
                             context->mask_path != nullptr ? context->mask_path : "",
                             context->ground_truth_scale, &truth, &last_error)) {
        return message_set(message, ERROR_SYNTAX, "%s", last_error.c_str());
    }
    size_px[0] = truth.width_px;
    size_px[1] = truth.height_px;
    return ERROR_OK;
}
