// SPDX-License-Identifier: Apache-2.0
// How time grows with width, height and searched disparities. See kUsage and README.md.
#include <algorithm>
#include <cstdio>
#include <numeric>
#include <opencv2/core/version.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "bench/harness/bench_arguments.hpp"
#include "bench/harness/bench_run.hpp"
#include "daemon/base/json.h"

namespace {

constexpr const char *kUsage =
    "usage: scaling_bench [options] DIR...\n"
    "  DIR         a folder with left.png right.png meta.json, or a folder of such folders\n"
    "  --rounds N  interleaved rounds of all methods and sizes (default 7)\n"
    "  --quick     3 sizes a series and 1 round\n"
    "  --only TEXT of our methods those whose name contains TEXT (plus SGBM 3-way plain)\n"
    "Times are of the processor, on one thread, the best of the rounds.\n"
    "Prints JSON; tools/bench scaling makes a table and a plot of it.\n";

// Eighths of the whole picture.
constexpr int kWhole = 8;

// One step of a series: a picture and its x value.
struct step {
    double x;
    bench_pair pair;
};

struct series {
    const char *along, *unit;
    std::vector<step> steps;
};

// The centre part of both images.
bench_pair cropped(const bench_pair &pair, int width, int height) {
    const cv::Rect middle((pair.left.cols - width) / 2, (pair.left.rows - height) / 2, width,
                          height);
    bench_pair result = pair;
    result.left = pair.left(middle).clone();
    result.right = pair.right(middle).clone();
    result.left_colour = pair.left_colour(middle).clone();
    result.right_colour = pair.right_colour(middle).clone();
    return result;
}

bench_pair reduced(const bench_pair &pair, int eighths) {
    const cv::Size size(pair.left.cols * eighths / kWhole, pair.left.rows * eighths / kWhole);
    bench_pair result = pair;
    cv::resize(pair.left, result.left, size, 0, 0, cv::INTER_AREA);
    cv::resize(pair.right, result.right, size, 0, 0, cv::INTER_AREA);
    cv::resize(pair.left_colour, result.left_colour, size, 0, 0, cv::INTER_AREA);
    cv::resize(pair.right_colour, result.right_colour, size, 0, 0, cv::INTER_AREA);
    result.disparity_count = std::max(pair.disparity_count * eighths / kWhole, 1);
    return result;
}

std::vector<series> series_of(const bench_pair &pair, bool quick) {
    series width{"width", "px", {}};
    series height{"height", "px", {}};
    series whole{"picture", "Mpx x disparities", {}};
    for (const int eighths :
         quick ? std::vector<int>{4, 6, 8} : std::vector<int>{2, 3, 4, 5, 6, 7, 8}) {
        const int columns = pair.left.cols * eighths / kWhole;
        const int rows = pair.left.rows * eighths / kWhole;
        width.steps.push_back(
            {static_cast<double>(columns), cropped(pair, columns, pair.left.rows)});
        height.steps.push_back({static_cast<double>(rows), cropped(pair, pair.left.cols, rows)});
        const bench_pair small = reduced(pair, eighths);
        whole.steps.push_back(
            {1e-6 * static_cast<double>(small.left.total()) * small.disparity_count, small});
    }
    series disparities{"disparities", "", {}};
    for (const int count : quick ? std::vector<int>{16, 48, 64}
                                 : std::vector<int>{16, 32, 48, 64, 96, 128, 160, 192, 224, 256}) {
        if (count <= std::max(pair.disparity_count, 128)) {
            bench_pair searched = pair;
            searched.disparity_count = count;
            disparities.steps.push_back({static_cast<double>(count), searched});
        }
    }
    return {width, height, disparities, whole};
}

// ms[method][step][round]
using times = std::vector<std::vector<std::vector<double>>>;

times measure(const std::vector<bench_method_entry> &methods, const series &one, int rounds) {
    struct run {
        std::size_t method, step;
        std::unique_ptr<bench_method> matcher;
    };
    std::vector<run> runs;
    for (std::size_t m = 0; m < methods.size(); m++) {
        for (std::size_t s = 0; s < one.steps.size(); s++) {
            runs.push_back({m, s, methods[m].make(one.steps[s].pair)});
            runs.back().matcher->first_run_bytes();
        }
    }
    times result(methods.size(), std::vector<std::vector<double>>(one.steps.size()));
    std::mt19937 random(1);  // the same orders in every run
    for (int round = 0; round < rounds; round++) {
        std::shuffle(runs.begin(), runs.end(), random);
        for (run &next : runs) {
            result[next.method][next.step].push_back(next.matcher->run(1).cpu_ms);
        }
    }
    return result;
}

// Least squares: y = at_zero + slope x.
struct line_fit {
    double at_zero = 0, slope = 0, r2 = 0;
};

line_fit fit(const std::vector<double> &x, const std::vector<double> &y) {
    const auto count = static_cast<double>(x.size());
    const double mean_x = std::accumulate(x.begin(), x.end(), 0.0) / count;
    const double mean_y = std::accumulate(y.begin(), y.end(), 0.0) / count;
    double xx = 0, xy = 0, yy = 0;
    for (std::size_t i = 0; i < x.size(); i++) {
        xx += (x[i] - mean_x) * (x[i] - mean_x);
        xy += (x[i] - mean_x) * (y[i] - mean_y);
        yy += (y[i] - mean_y) * (y[i] - mean_y);
    }
    if (xx <= 0 || yy <= 0) {
        return {mean_y, 0, 0};
    }
    return {mean_y - xy / xx * mean_x, xy / xx, xy * xy / (xx * yy)};
}

void put_method(json *out, const std::string &name, const series &one,
                const std::vector<std::vector<double>> &ms) {
    std::vector<double> x, best_ms;
    json_open_object(out, nullptr);
    json_text(out, "method", name.c_str());
    json_open_array(out, "points");
    for (std::size_t s = 0; s < one.steps.size(); s++) {
        const bench_pair &pair = one.steps[s].pair;
        x.push_back(one.steps[s].x);
        best_ms.push_back(bench_quantile(ms[s], 0));
        json_open_object(out, nullptr);
        json_real(out, "x", x.back(), 6);
        json_integer(out, "width", pair.left.cols);
        json_integer(out, "height", pair.left.rows);
        json_integer(out, "disparities", pair.disparity_count);
        json_real(out, "best_ms", best_ms.back(), 6);
        json_real(out, "median_ms", bench_quantile(ms[s], 0.5), 6);
        json_close_object(out);
    }
    json_close_array(out);
    const line_fit line = fit(x, best_ms);
    json_open_object(out, "fit_of_best");
    json_real(out, "at_zero_ms", line.at_zero, 6);
    json_real(out, "slope_ms", line.slope, 6);
    json_real(out, "r2", line.r2, 6);
    json_close_object(out);
    json_close_object(out);
}

int run(const bench_arguments &arguments, const std::vector<bench_pair> &pairs) {
    std::vector<bench_method_entry> methods = bench_methods(arguments.only);
    methods.erase(std::remove_if(methods.begin(), methods.end(),
                                 [](const auto &entry) {
                                     return !entry.is_ours && entry.name != bench_reference;
                                 }),
                  methods.end());
    json out;
    json_begin(&out, stdout);
    json_open_object(&out, nullptr);
    json_text(&out, "opencv", CV_VERSION);
    json_integer(&out, "rounds", arguments.rounds);
    json_open_array(&out, "series");
    for (const bench_pair &pair : pairs) {
        for (const series &one : series_of(pair, arguments.quick)) {
            const times ms = measure(methods, one, arguments.rounds);
            json_open_object(&out, nullptr);
            json_text(&out, "pair", pair.name.c_str());
            json_text(&out, "along", one.along);
            json_text(&out, "unit", one.unit);
            json_open_array(&out, "methods");
            for (std::size_t m = 0; m < methods.size(); m++) {
                put_method(&out, methods[m].name, one, ms[m]);
            }
            json_close_array(&out);
            json_close_object(&out);
        }
    }
    json_close_array(&out);
    json_close_object(&out);
    json_end(&out);
    return 0;
}

}  // namespace

int main(int argc, char **argv) {
    return bench_main({"scaling_bench", kUsage, {"--rounds", "--quick", "--only"}}, argc, argv,
                      run);
}
