// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_pair.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tools/host/evaluate/evaluate.hpp"
#include "tools/host/formats/pfm.hpp"

namespace fs = std::filesystem;

namespace {

bool fail(std::string *message, const std::string &what) {
    *message = what;
    return false;
}

cv::Mat load(const fs::path &path) {
    return cv::imread(path.string(), cv::IMREAD_COLOR);
}

// By OpenCV's conversion, because each format's own reader weights the colours differently.
cv::Mat converted(const cv::Mat &colour, cv::ColorConversionCodes code) {
    cv::Mat result;
    if (!colour.empty()) {
        cv::cvtColor(colour, result, code);
    }
    return result;
}

std::string text_of(const cv::FileNode &node, const std::string &otherwise) {
    return node.isString() ? static_cast<std::string>(node) : otherwise;
}

bool load_meta(const fs::path &folder, bench_pair *pair, std::string *message) {
    const fs::path path = folder / "meta.json";
    const std::string wanted = " (expected disparity_search: [min, end])";
    if (!fs::exists(path)) {
        return fail(message, path.string() + ": not found" + wanted);
    }
    int begin = 0;
    int end = 0;
    try {
        const cv::FileStorage meta(path.string(), cv::FileStorage::READ);
        const cv::FileNode search = meta["disparity_search"];
        if (!search.isSeq() || search.size() != 2 || !search[0].isInt() || !search[1].isInt()) {
            return fail(message, path.string() + ": no range" + wanted);
        }
        begin = static_cast<int>(search[0]);
        end = static_cast<int>(search[1]);
        pair->set = text_of(meta["set"], pair->name);
        pair->part = text_of(meta["part"], "");
        for (const cv::FileNode &name : meta["regions"]) {
            pair->region_names.push_back(static_cast<std::string>(name));
        }
    } catch (const cv::Exception &) {
        return fail(message, path.string() + ": not valid JSON" + wanted);
    }
    if (end <= begin || end - begin > 1024) {
        return fail(message, path.string() + ": disparity_search must span 1 to 1024 disparities");
    }
    pair->disparity_min = begin;
    pair->disparity_count = end - begin;
    return true;
}

bool load_regions(const fs::path &folder, bench_pair *pair, std::string *message) {
    if (pair->region_names.empty()) {
        return true;
    }
    const fs::path path = folder / "regions.png";
    const cv::Mat region = cv::imread(path.string(), cv::IMREAD_GRAYSCALE);
    if (region.size() != pair->left.size() || pair->truth_px.empty()) {
        return fail(message, path.string() + ": no image, differs in size, or there is no truth");
    }
    pair->region.assign(region.begin<uint8_t>(), region.end<uint8_t>());
    return true;
}

bool load_truth(const fs::path &folder, bench_pair *pair, std::string *message) {
    const fs::path path = folder / "disparity.pfm";
    if (!fs::exists(path)) {
        return true;
    }
    pfm_image truth;
    if (!pfm_read(path.string(), &truth, message)) {
        return false;
    }
    if (truth.width_px != pair->left.cols || truth.height_px != pair->left.rows) {
        return fail(message, path.string() + ": differs in size from the images");
    }
    pair->truth_px = truth.values;
    pair->round_disparity = std::all_of(truth.values.begin(), truth.values.end(), [](float value) {
        return !std::isfinite(value) || value == std::round(value);
    });
    const fs::path mask_path = folder / "mask.png";
    if (!fs::exists(mask_path)) {
        pair->mask = bench_pair_mask(truth.width_px, truth.height_px, truth.values);
        pair->mask_origin = "from the truth";
        return true;
    }
    const cv::Mat mask = cv::imread(mask_path.string(), cv::IMREAD_GRAYSCALE);
    if (mask.size() != pair->left.size()) {
        return fail(message, mask_path.string() + ": no image, or differs in size");
    }
    pair->mask.assign(mask.begin<uint8_t>(), mask.end<uint8_t>());
    pair->mask_origin = "mask.png";
    return true;
}

}  // namespace

std::vector<std::string> bench_pair_folders(const std::string &path) {
    if (fs::exists(fs::path(path) / "left.png")) {
        return {path};
    }
    std::vector<std::string> folders;
    std::error_code error;
    for (const auto &entry : fs::directory_iterator(path, error)) {
        if (fs::exists(entry.path() / "left.png")) {
            folders.push_back(entry.path().string());
        }
    }
    std::sort(folders.begin(), folders.end());
    return folders;
}

bool bench_pair_load(const std::string &folder, bench_pair *pair, std::string *message) {
    const fs::path path(folder);
    bench_pair loaded;
    loaded.name = fs::canonical(path).filename().string();
    const cv::Mat left = load(path / "left.png");
    const cv::Mat right = load(path / "right.png");
    loaded.left = converted(left, cv::COLOR_BGR2GRAY);
    loaded.left_colour = converted(left, cv::COLOR_BGR2RGB);
    loaded.right = converted(right, cv::COLOR_BGR2GRAY);
    loaded.right_colour = converted(right, cv::COLOR_BGR2RGB);
    if (loaded.left.empty() || loaded.left.size() != loaded.right.size()) {
        return fail(message, folder + ": left.png and right.png must be images of one size");
    }
    if (!load_meta(path, &loaded, message) || !load_truth(path, &loaded, message) ||
        !load_regions(path, &loaded, message)) {
        return false;
    }
    if (!loaded.part.empty()) {
        loaded.name = loaded.part + "/" + loaded.name;
    }
    *pair = loaded;
    return true;
}

std::vector<uint8_t> bench_pair_mask(int width, int height, const std::vector<float> &truth_px) {
    std::vector<uint8_t> mask(truth_px.size(), EVALUATE_UNKNOWN);
    std::vector<float> nearest(static_cast<size_t>(width));
    for (int y = 0; y < height; y++) {
        const size_t row = static_cast<size_t>(y) * static_cast<size_t>(width);
        std::fill(nearest.begin(), nearest.end(), -std::numeric_limits<float>::infinity());
        const auto right_column = [&](int x) {
            return std::lround(static_cast<float>(x) - truth_px[row + static_cast<size_t>(x)]);
        };
        for (int x = 0; x < width; x++) {
            const float truth = truth_px[row + static_cast<size_t>(x)];
            if (std::isfinite(truth) && right_column(x) >= 0 && right_column(x) < width) {
                float &there = nearest[static_cast<size_t>(right_column(x))];
                there = std::max(there, truth);
            }
        }
        for (int x = 0; x < width; x++) {
            const size_t i = row + static_cast<size_t>(x);
            if (!std::isfinite(truth_px[i])) {
                continue;
            }
            const long column = right_column(x);
            const bool seen = column >= 0 && column < width &&
                              nearest[static_cast<size_t>(column)] <= truth_px[i] + 1;
            mask[i] = seen ? EVALUATE_VISIBLE : EVALUATE_OCCLUDED;
        }
    }
    return mask;
}
