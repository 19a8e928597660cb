// SPDX-License-Identifier: Apache-2.0
// Growth of the errors when the images differ, and what is kept of pairs without a surface. See
// kUsage and README.md.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <map>
#include <stdexcept>

#include "bench/disturbance.hpp"
#include "bench/harness/bench_arguments.hpp"
#include "bench/harness/bench_run.hpp"

namespace {

constexpr const char *kUsage =
    "usage: disturbance_bench [options] DIR...\n"
    "  DIR            a folder with left.png right.png meta.json disparity.pfm and, optional,\n"
    "                 mask.png; or a folder of such folders\n"
    "  --only TEXT    methods whose name contains TEXT (and SGBM 3-way plain)\n"
    "  --quick        only the change of exposure and the unrelated images\n"
    "Errors are bad-1.0 (filled, non-occluded); growth is their mean over that of the unmodified\n"
    "images.\n";

constexpr int kNameWidth = 30;
constexpr int kColumnWidth = 9;

// One method: for each case, one value per pair.
struct disturbed {
    std::string method;
    std::map<std::string, std::vector<double>> bad_percent;   // key: photometric change
    std::map<std::string, std::vector<double>> kept_percent;  // key: pair without a surface
};

double mean(const std::vector<double> &values) {
    double sum = 0;
    for (const double value : values) {
        sum += value;
    }
    return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

// NaN if the clean images have no error.
double growth(const disturbed &one, const char *name) {
    const double clean = mean(one.bad_percent.at("clean"));
    return clean > 0 ? mean(one.bad_percent.at(name)) / clean
                     : std::numeric_limits<double>::quiet_NaN();
}

// The cases to run.
struct plan {
    std::vector<disturbance> photometric;
    std::vector<disturbance_nothing> nothing;
};

plan plan_of(bool quick) {
    plan all = {photometric_disturbances(), no_surface_disturbances()};
    if (quick) {
        const auto is_named = [](const char *name) {
            return [name](const auto &one) { return std::strcmp(one.name, name) == 0; };
        };
        const auto exposure = std::find_if(all.photometric.begin(), all.photometric.end(),
                                           is_named(disturbance_exposure));
        all.photometric = {all.photometric.front(), *exposure};
        all.nothing = {all.nothing.back()};
    }
    return all;
}

std::vector<float> matched(const bench_method_entry &entry, const bench_pair &pair) {
    const auto method = entry.make(pair);
    method->run(1);
    return method->disparity_px();
}

void run_pair(const std::vector<bench_method_entry> &methods, const plan &plan,
              const bench_pair &pair, const bench_pair &other, std::vector<disturbed> &results) {
    for (const disturbance &one : plan.photometric) {
        bench_pair changed = disturbance_copy(pair);
        one.apply(changed);
        for (std::size_t i = 0; i < methods.size(); i++) {
            const bench_error error = bench_error_of(changed, matched(methods[i], changed));
            results[i].bad_percent[one.name].push_back(error.all.filled_visible.bad_percent[1]);
        }
    }
    for (const disturbance_nothing &one : plan.nothing) {
        const bench_pair made = one.make(pair, other);
        for (std::size_t i = 0; i < methods.size(); i++) {
            results[i].kept_percent[one.name].push_back(
                bench_density_percent(matched(methods[i], made)));
        }
    }
}

// One line per method, one column per case.
template <typename Case>
void print_table(const char *title, const std::vector<Case> &cases,
                 const std::vector<disturbed> &results,
                 const std::function<std::string(const disturbed &, const char *name)> &cell) {
    std::printf("\n%s\n  %-*s", title, kNameWidth, "");
    for (const Case &one : cases) {
        std::printf(" %*s", kColumnWidth, one.name);
    }
    std::printf("\n");
    for (const disturbed &result : results) {
        std::printf("  %-*s", kNameWidth, result.method.c_str());
        for (const Case &one : cases) {
            std::printf(" %*s", kColumnWidth, cell(result, one.name).c_str());
        }
        std::printf("\n");
    }
}

std::string decimals(int count, double value) {
    if (!std::isfinite(value)) {
        return "-";
    }
    char text[32];
    std::snprintf(text, sizeof text, "%.*f", count, value);
    return text;
}

void print_tables(const std::vector<disturbed> &results, const plan &plan, std::size_t pairs) {
    const std::string title = "bad-1.0 in percent, filled, non-occluded, mean of " +
                              std::to_string(pairs) + (pairs > 1 ? " pairs" : " pair");
    print_table(title.c_str(), plan.photometric, results,
                [](const disturbed &one, const char *name) {
                    return decimals(2, mean(one.bad_percent.at(name)));
                });
    print_table(
        "growth: the same over that of the clean images", plan.photometric, results,
        [](const disturbed &one, const char *name) { return decimals(2, growth(one, name)); });
    print_table("kept where there is no surface, percent of all pixels: mean (and maximum)",
                plan.nothing, results, [](const disturbed &one, const char *name) {
                    const std::vector<double> &values = one.kept_percent.at(name);
                    return decimals(1, mean(values)) + "(" +
                           decimals(0, bench_quantile(values, 1)) + ")";
                });
    std::printf("\n");
    for (const disturbance &one : plan.photometric) {
        std::printf("  %-10s %s\n", one.name, one.what);
    }
    for (const disturbance_nothing &one : plan.nothing) {
        std::printf("  %-10s %s\n", one.name, one.what);
    }
}

int run(const bench_arguments &arguments, const std::vector<bench_pair> &pairs) {
    for (const bench_pair &pair : pairs) {
        if (pair.truth_px.empty()) {
            throw std::runtime_error(pair.name + ": no disparity.pfm to compare with");
        }
    }
    const std::vector<bench_method_entry> methods = bench_methods(arguments.only);
    std::vector<disturbed> results;
    for (const bench_method_entry &entry : methods) {
        results.push_back({entry.name, {}, {}});
    }
    const plan plan = plan_of(arguments.quick);
    for (std::size_t i = 0; i < pairs.size(); i++) {
        run_pair(methods, plan, pairs[i], pairs[(i + 1) % pairs.size()], results);
    }
    print_tables(results, plan, pairs.size());
    return 0;
}

}  // namespace

int main(int argc, char **argv) {
    return bench_main({"disturbance_bench", kUsage, {"--only", "--quick"}}, argc, argv, run);
}
