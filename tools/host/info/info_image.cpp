// SPDX-License-Identifier: Apache-2.0
/// Maps and images. The meaning of a value is known from the file names of results.
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "daemon/images/image_file.h"
#include "daemon/images/image_pnm.h"
#include "stereo/image/reason.h"
#include "tools/host/formats/image_formats.hpp"
#include "tools/host/formats/pfm.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/info/info.hpp"

namespace {

using json = nlohmann::ordered_json;

std::string percent(double part, double whole) {
    return number_text(whole > 0 ? 100 * part / whole : 0, 4) + " %";
}

void add_size(int width_px, int height_px, info_page *page) {
    page->add("size_px", "size",
              std::to_string(width_px) + " x " + std::to_string(height_px) + " px",
              json::array({width_px, height_px}));
}

void add_range(const std::string &label, double min, double greatest, const std::string &unit,
               info_page *page) {
    page->add(
        "range", label,
        number_text(min, 6) + ".." + number_text(greatest, 6) + (unit.empty() ? "" : " " + unit),
        json::array({min, greatest}));
}

/// Results by name: one unit of the image is 1 / scale of `unit`, 0 means no value.
struct meaning {
    const char *name;
    const char *kind;
    double scale;
    const char *unit;
};

const meaning *meaning_of(const std::string &path) {
    static const meaning meanings[] = {
        {"disparity.png", "disparity map (16 bit, 256 = 1 px, 0 = none)", 256, "px"},
        {"depth.png", "depth map (16 bit, 1 = 1 mm, 0 = none)", 1, "mm"},
    };
    const std::string name = path.substr(path.rfind('/') + 1);
    for (const meaning &candidate : meanings) {
        if (name == candidate.name) {
            return &candidate;
        }
    }
    return nullptr;
}

bool is_reason_map(const std::string &path) {
    const std::string name = path.substr(path.rfind('/') + 1);
    return name == "reasons.pgm" || name == "reasons.png";
}

void add_values(const raw_image &image, const meaning &what, info_page *page) {
    std::uint64_t known = 0;
    unsigned min = 0xffff, greatest = 0;
    for (int y = 0; y < image.height_px; y++) {
        const std::uint16_t *row = image.data + y * image.stride;
        for (int x = 0; x < image.width_px; x++) {
            const unsigned value = row[x];
            known += value != 0;
            min = value != 0 ? std::min(min, value) : min;
            greatest = std::max(greatest, value);
        }
    }
    const double pixels = static_cast<double>(image.width_px) * image.height_px;
    page->add(
        "known", "known",
        percent(static_cast<double>(known), pixels) + " (" + std::to_string(known) + " pixels)",
        known);
    if (known > 0) {
        add_range("range", min / what.scale, greatest / what.scale, what.unit, page);
    }
}

void add_reasons(const raw_image &image, info_page *page) {
    std::uint64_t counts[REASON_COUNT + 1] = {};
    for (int y = 0; y < image.height_px; y++) {
        const std::uint16_t *row = image.data + y * image.stride;
        for (int x = 0; x < image.width_px; x++) {
            counts[std::min<int>(row[x], REASON_COUNT)]++;
        }
    }
    const double pixels = static_cast<double>(image.width_px) * image.height_px;
    json all;
    for (int reason = 0; reason <= REASON_COUNT; reason++) {
        if (counts[reason] == 0) {
            continue;
        }
        page->add("", all.empty() ? "pixels" : "",
                  percent(static_cast<double>(counts[reason]), pixels) + " " + reason_text(reason),
                  nullptr);
        all[reason_text(reason)] = counts[reason];
    }
    page->add("reasons", "", "", all);
}

}  // namespace

bool info_map(const std::string &path, info_page *page, std::string *message) {
    pfm_image map;
    if (!pfm_read(path, &map, message)) {
        return false;
    }
    page->kind = "float map (PFM)";
    add_size(map.width_px, map.height_px, page);
    std::uint64_t known = 0;
    double min = INFINITY, greatest = -INFINITY, sum = 0;
    for (const float value : map.values) {
        if (std::isfinite(value)) {
            known++;
            sum += static_cast<double>(value);
            min = std::min(min, static_cast<double>(value));
            greatest = std::max(greatest, static_cast<double>(value));
        }
    }
    page->add("known", "known",
              percent(static_cast<double>(known), static_cast<double>(map.values.size())) + " (" +
                  std::to_string(known) + " pixels; the others are not finite)",
              known);
    if (known > 0) {
        add_range("range", min, greatest, "", page);
        page->add_number("mean", "mean", sum / static_cast<double>(known), 6, "");
    }
    return true;
}

bool info_image(const std::string &path, info_page *page, std::string *message) {
    static const image_format formats[] = {
        {"PNG", "png", image_png_probe, image_png_read},
        {"PNM", "pgm ppm pnm", image_pnm_probe, image_pnm_read},
    };
    image_request request{};
    request.scale = 1;
    request.indices = is_reason_map(path);  // the colours are only for display
    image_file file{};
    struct message reason;
    if (image_file_read(path.c_str(), formats, 2, &request, &file, &reason) != ERROR_OK) {
        *message = reason.text;
        return false;
    }
    const raw_image &image = file.image;
    const meaning *what = meaning_of(path);
    const bool grey = image.layout == RAW_GREY;
    page->kind = "image";
    add_size(image.width_px, image.height_px, page);
    page->add("bits", "values",
              std::to_string(image.bits) + " bit " + (grey ? "grey" : "colour") + ", up to " +
                  std::to_string(file.brightest),
              image.bits);
    if (what != nullptr && grey) {
        page->kind = what->kind;
        add_values(image, *what, page);
    } else if (is_reason_map(path) && grey) {
        page->kind = "reason map";
        add_reasons(image, page);
    }
    image_file_free(&file);
    return true;
}
