// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_region.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "tools/host/evaluate/evaluate.hpp"

namespace {

constexpr int kNameWidth = 30;
constexpr std::size_t kFewest = 100;  // a share of fewer pixels says nothing
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

double percent(std::size_t part, std::size_t whole) {
    return whole >= kFewest ? 100 * static_cast<double>(part) / static_cast<double>(whole)
                            : kUnknown;
}

double median(std::vector<double> &values) {
    if (values.empty()) {
        return kUnknown;
    }
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// Counts of some pixels.
struct counts {
    std::size_t pixels = 0, right = 0, bad_3px = 0;
    std::vector<double> errors_px;  // errors of the kept pixels

    void add(double error_px) {
        pixels++;
        if (std::isfinite(error_px)) {
            right += error_px <= 1 ? 1 : 0;
            bad_3px += error_px > 3 ? 1 : 0;
            errors_px.push_back(error_px);
        }
    }
    std::size_t kept() const { return errors_px.size(); }
};

struct object_counts {
    counts all, textured;

    void add(bool is_textured, double error_px) {
        all.add(error_px);
        if (is_textured) {
            textured.add(error_px);
        }
    }

    bench_region score(const std::string &object) {
        bench_region result;
        result.object = object;
        auto &figures = result.figures;
        figures[BENCH_RIGHT] = percent(all.right, all.pixels);
        figures[BENCH_TEXTURED_RIGHT] = percent(textured.right, textured.pixels);
        figures[BENCH_TEXTURED_WRONG] = percent(textured.kept() - textured.right, textured.pixels);
        figures[BENCH_KEPT] = percent(all.kept(), all.pixels);
        figures[BENCH_KEPT_BAD_1PX] = percent(all.kept() - all.right, all.kept());
        figures[BENCH_KEPT_BAD_3PX] = percent(all.bad_3px, all.kept());
        figures[BENCH_MEDIAN_PX] = median(textured.pixels > 0 ? textured.errors_px : all.errors_px);
        return result;
    }
};

// In the order of first appearance.
std::vector<std::string> objects_of(const std::vector<std::vector<bench_region>> &views) {
    std::vector<std::string> objects;
    for (const auto &view : views) {
        for (const bench_region &region : view) {
            if (std::find(objects.begin(), objects.end(), region.object) == objects.end()) {
                objects.push_back(region.object);
            }
        }
    }
    return objects;
}

// The values of one figure of an object in all views that have it.
std::vector<double> values_of(const bench_region_scores &scores, const std::string &object,
                              bench_figure figure) {
    std::vector<double> values;
    for (const auto &view : scores.views) {
        if (const double value = bench_region_figure(view, object, figure); std::isfinite(value)) {
            values.push_back(value);
        }
    }
    return values;
}

double mean(const std::vector<double> &values) {
    double sum = 0;
    for (const double value : values) {
        sum += value;
    }
    return values.empty() ? kUnknown : sum / static_cast<double>(values.size());
}

double largest(const std::vector<double> &values) {
    return values.empty() ? kUnknown : *std::max_element(values.begin(), values.end());
}

void print_behind(const bench_region_scores &scores, const bench_region_scores &rival,
                  const std::string &object) {
    int views = 0;
    int behind = 0;
    for (std::size_t i = 0; i < scores.views.size(); i++) {
        const double own = bench_region_figure(scores.views[i], object, BENCH_TEXTURED_RIGHT);
        if (std::isfinite(own)) {
            views++;
            behind += own < bench_region_figure(rival.views[i], object, BENCH_TEXTURED_RIGHT);
        }
    }
    std::printf(" %4d of %d", behind, views);
}

void print_line(const bench_region_scores &scores, const std::string &object) {
    std::printf("  %-*s", kNameWidth, scores.method.c_str());
    for (int figure = 0; figure < BENCH_FIGURES; figure++) {
        const double value = mean(values_of(scores, object, static_cast<bench_figure>(figure)));
        const bool of_kept = figure == BENCH_KEPT_BAD_1PX || figure == BENCH_KEPT_BAD_3PX;
        if (figure == BENCH_MEDIAN_PX) {
            bench_print_value(8, 3, value);
        } else {
            bench_print_value(8, of_kept ? 2 : 1, value, "%");
        }
    }
    if (scores.views.size() > 1) {
        bench_print_value(8, 2, largest(values_of(scores, object, BENCH_KEPT_BAD_1PX)), "%");
        bench_print_value(8, 2, largest(values_of(scores, object, BENCH_KEPT_BAD_3PX)), "%");
    }
}

}  // namespace

double bench_region_figure(const std::vector<bench_region> &view, const std::string &object,
                           bench_figure figure) {
    const auto at = std::find_if(view.begin(), view.end(), [&](const bench_region &region) {
        return region.object == object;
    });
    return at == view.end() ? kUnknown : at->figures[figure];
}

void bench_print_value(int width, int decimals, double value, const std::string &unit) {
    if (std::isfinite(value)) {
        std::printf(" %*.*f%s", width - static_cast<int>(unit.size()), decimals, value,
                    unit.c_str());
    } else {
        std::printf(" %*s", width, "-");
    }
}

std::vector<bench_region> bench_regions_of(const bench_pair &pair,
                                           const std::vector<float> &disparity_px) {
    object_counts all;
    std::vector<object_counts> of(pair.region_names.size());
    for (std::size_t i = 0; i < pair.region.size(); i++) {
        const std::size_t object = pair.region[i] & ~BENCH_REGION_TEXTURED;
        if (object > 0 && object <= of.size() && pair.mask[i] == EVALUATE_VISIBLE) {
            const bool is_textured = (pair.region[i] & BENCH_REGION_TEXTURED) != 0;
            const double error_px = std::fabs(static_cast<double>(disparity_px[i]) -
                                              static_cast<double>(pair.truth_px[i]));
            of[object - 1].add(is_textured, error_px);
            all.add(is_textured, error_px);
        }
    }
    std::vector<bench_region> scores = {all.score("all")};
    for (std::size_t i = 0; i < of.size(); i++) {
        if (of[i].all.pixels > 0) {
            scores.push_back(of[i].score(pair.region_names[i]));
        }
    }
    return scores;
}

void bench_print_regions(const std::vector<bench_region_scores> &methods,
                         const std::string &rival) {
    const auto against =
        std::find_if(methods.begin(), methods.end(),
                     [&](const bench_region_scores &scores) { return scores.method == rival; });
    const bool several = methods.front().views.size() > 1;
    for (const std::string &object : objects_of(methods.front().views)) {
        std::printf("  %-*s %8s %8s %8s %8s %8s %8s %8s%s%s\n", kNameWidth, object.c_str(), "right",
                    "tex-rt", "tex-wr", "kept", "bad-1.0", "bad-3.0", "median",
                    several ? "  worst-1  worst-3" : "",
                    several && against != methods.end() ? "  behind HH4" : "");
        for (const bench_region_scores &scores : methods) {
            print_line(scores, object);
            if (several && against != methods.end()) {
                print_behind(scores, *against, object);
            }
            std::printf("\n");
        }
    }
}
