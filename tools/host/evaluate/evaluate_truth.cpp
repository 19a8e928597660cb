// SPDX-License-Identifier: Apache-2.0
#include "tools/host/evaluate/evaluate_truth.hpp"

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>

#include "core/error.h"
#include "daemon/files/input_file.h"
#include "daemon/images/image_file.h"
#include "tools/host/evaluate/evaluate.hpp"
#include "tools/host/formats/image_png.hpp"
#include "tools/host/formats/pfm.hpp"

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
    unsigned char head[8] = {0};
    struct message last_error;  // reported when the whole file is read
    std::FILE *file = input_file_open(path.c_str(), &last_error);
    if (file == nullptr) {
        return false;
    }
    const std::size_t got = std::fread(head, 1, sizeof head, file);
    std::fclose(file);
    return got == sizeof head && image_png_probe(head, got);
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
