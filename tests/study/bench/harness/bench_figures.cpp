// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_figures.hpp"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <limits>

namespace {

constexpr int kNameWidth = 54, kViewWidth = 25, kColumnWidth = 16;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
// Views of these are compared with OpenCV's one by one.
constexpr const char *kCompared[] = {"cylinder", "mug", "figurine"};
constexpr const char *kThreeWay = "SGBM 3-way";

struct column {
    std::string method;
    std::vector<const bench_outcome *> recorded, views;  // same order of the pairs for all methods
};

std::vector<column> columns_of(const std::vector<bench_outcome> &outcomes) {
    std::vector<column> columns;
    for (const char *method :
         {"standard", "standard+refine", "best", "best+refine", bench_best_mode, kThreeWay}) {
        column of;
        of.method = method;
        for (const bench_outcome &one : outcomes) {
            if (one.method == method && one.has_truth) {
                (one.regions.empty() ? of.recorded : of.views).push_back(&one);
            }
        }
        if (!of.recorded.empty() || !of.views.empty()) {
            columns.push_back(of);
        }
    }
    return columns;
}

const column *find(const std::vector<column> &columns, const std::string &method) {
    const auto at = std::find_if(columns.begin(), columns.end(),
                                 [&](const column &of) { return of.method == method; });
    return at == columns.end() ? nullptr : &*at;
}

// The object after which the view is named; "all" if none is.
std::string subject_of(const bench_outcome &view) {
    for (const bench_region &region : view.regions) {
        if (view.pair.find(region.object + "_") != std::string::npos) {
            return region.object;
        }
    }
    return "all";
}

bool is_compared(const bench_outcome &view) {
    return std::find(std::begin(kCompared), std::end(kCompared), subject_of(view)) !=
           std::end(kCompared);
}

double right(const bench_outcome &view) {
    return bench_region_figure(view.regions, subject_of(view), BENCH_TEXTURED_RIGHT);
}

double wrong(const bench_outcome &view) {
    return bench_region_figure(view.regions, subject_of(view), BENCH_TEXTURED_WRONG);
}

// Over the outcomes of which the value is known.
using value_of = std::function<double(const bench_outcome &one)>;
using outcomes_of_method = std::vector<const bench_outcome *>;

double mean(const outcomes_of_method &outcomes, const value_of &value) {
    double sum = 0, count = 0;
    for (const bench_outcome *one : outcomes) {
        if (const double known = value(*one); std::isfinite(known)) {
            sum += known;
            count++;
        }
    }
    return sum / count;
}

double largest(const outcomes_of_method &outcomes, const value_of &value) {
    double result = kUnknown;
    for (const bench_outcome *one : outcomes) {
        result = std::fmax(result, value(*one));
    }
    return result;
}

double smallest(const outcomes_of_method &outcomes, const value_of &value) {
    return -largest(outcomes, [&](const bench_outcome &one) { return -value(one); });
}

double noise_percent(const bench_outcome &one) {
    return one.noise_bad_1px.empty() ? kUnknown : one.noise_bad_1px.front();
}

value_of filled_percent(int threshold) {
    return [threshold](const bench_outcome &one) {
        return one.error.all.filled_visible.bad_percent[threshold];
    };
}

value_of of_object(const std::string &object, bench_figure figure) {
    return [=](const bench_outcome &view) {
        return bench_region_figure(view.regions, object, figure);
    };
}

double z_rms(const bench_outcome &one) {
    return one.z_rms;
}

struct table {
    const std::vector<bench_outcome> &outcomes;
    const std::vector<column> columns;

    void line(const char *name, int decimals,
              const std::function<double(const column &of)> &value) const {
        std::printf("  %-*s", kNameWidth, name);
        for (const column &of : columns) {
            bench_print_value(kColumnWidth, decimals, value(of));
        }
        std::printf("\n");
    }

    // The values' mean over that of a mode of OpenCV.
    void ratio(const char *name, const char *mode, const value_of &value) const {
        const column *rival = find(columns, mode);
        line(name, 3, [&](const column &of) {
            return rival == nullptr ? kUnknown
                                    : mean(of.recorded, value) / mean(rival->recorded, value);
        });
    }

    // Views of the compared objects for which `is_worse` says so, of the method and of HH4.
    void views_behind(const char *name, const value_of &value,
                      const std::function<bool(double own, double rival)> &is_worse) const {
        const column *rival = find(columns, bench_best_mode);
        line(name, 0, [&](const column &of) {
            int behind = 0;
            for (std::size_t i = 0; rival != nullptr && i < of.views.size(); i++) {
                behind += is_compared(*of.views[i]) &&
                                  is_worse(value(*of.views[i]), value(*rival->views[i]))
                              ? 1
                              : 0;
            }
            return rival == nullptr || of.method == rival->method ? kUnknown : behind;
        });
    }
};

// Pairs on which a mode of OpenCV has fewer bad pixels.
int pairs_behind(const column &of, const std::vector<bench_outcome> &outcomes, int threshold) {
    return static_cast<int>(
        std::count_if(of.recorded.begin(), of.recorded.end(), [&](const bench_outcome *own) {
            const value_of value = filled_percent(threshold);
            return std::any_of(outcomes.begin(), outcomes.end(), [&](const bench_outcome &one) {
                return one.pair == own->pair && !one.is_ours && value(one) < value(*own);
            });
        }));
}

void print_recorded(const table &figures) {
    std::printf("recorded pairs\n");
    figures.line("mean bad-1.0, percent", 2,
                 [](const column &of) { return mean(of.recorded, filled_percent(1)); });
    figures.ratio("  over HH4's", bench_best_mode, filled_percent(1));
    figures.ratio("mean bad-2.0 over HH4's", bench_best_mode, filled_percent(2));
    const auto behind = [&](int threshold) {
        return [&, threshold](const column &of) {
            return of.recorded.front()->is_ours ? pairs_behind(of, figures.outcomes, threshold)
                                                : kUnknown;
        };
    };
    figures.line("pairs on which a mode of OpenCV is better, bad-1.0", 0, behind(1));
    figures.line("  bad-2.0", 0, behind(2));
    figures.line("density, percent", 1, [](const column &of) {
        return mean(of.recorded,
                    [](const bench_outcome &one) { return one.error.visible.density_percent; });
    });
    figures.ratio("noise of 1 % exposure: bad-1.0 over three-way's", kThreeWay, noise_percent);
    figures.line("z, smallest of a pair", 2,
                 [](const column &of) { return smallest(of.recorded, z_rms); });
    figures.line("  largest", 2, [](const column &of) { return largest(of.recorded, z_rms); });
}

void print_rendered(const table &figures) {
    std::printf("rendered views\n");
    const auto of_compared = [](const value_of &value) {
        return [value](const bench_outcome &view) {
            return is_compared(view) ? value(view) : kUnknown;
        };
    };
    figures.line("cylinder, mug, figurine: right of textured, mean", 2,
                 [&](const column &of) { return mean(of.views, of_compared(right)); });
    figures.line("  smallest", 2,
                 [&](const column &of) { return smallest(of.views, of_compared(right)); });
    figures.line("  wrong of textured, mean", 2,
                 [&](const column &of) { return mean(of.views, of_compared(wrong)); });
    figures.views_behind("  views with less right than HH4", right,
                         [](double own, double rival) { return own < rival; });
    figures.views_behind("  views with more wrong than half of HH4's", wrong,
                         [](double own, double rival) { return own > rival / 2; });
    for (const bench_figure figure : {BENCH_KEPT_BAD_1PX, BENCH_KEPT_BAD_3PX}) {
        const std::string title = std::string("kept and off by more than ") +
                                  (figure == BENCH_KEPT_BAD_1PX ? "1" : "3") + " px, mean";
        figures.line(title.c_str(), 2,
                     [&](const column &of) { return mean(of.views, of_object("all", figure)); });
        for (const char *object : {"all", "table"}) {
            figures.line(
                object == std::string("all") ? "  largest of a view" : "  of a table", 2,
                [&](const column &of) { return largest(of.views, of_object(object, figure)); });
        }
    }
    figures.line("textured cylinder: median error in px", 3, [](const column &of) {
        return mean(of.views, of_object("cylinder", BENCH_MEDIAN_PX));
    });
    figures.line("z, smallest of a view", 2,
                 [](const column &of) { return smallest(of.views, z_rms); });
    figures.line("  largest", 2, [](const column &of) { return largest(of.views, z_rms); });
    figures.line("  mean", 2, [](const column &of) { return mean(of.views, z_rms); });
}

// By view and method.
void print_views(const std::vector<column> &columns) {
    const std::vector<std::string> wanted = {"standard", "best", bench_best_mode};
    std::vector<const column *> shown;
    for (const std::string &method : wanted) {
        if (const column *of = find(columns, method); of != nullptr) {
            shown.push_back(of);
        }
    }
    if (shown.empty()) {
        return;
    }
    std::printf(
        "\nrendered views; textured pixels are those of the object after which a view is named\n"
        "  %-*s",
        kViewWidth, "");
    for (const column *of : shown) {
        std::printf(" | %-33s", of->method.c_str());
    }
    std::printf(" | HH4 is\n  %-*s", kViewWidth, "");
    for (std::size_t i = 0; i < shown.size(); i++) {
        std::printf(" | %6s %6s %5s %6s %6s", "tex-rt", "tex-wr", "kept", "bad-1", "bad-3");
    }
    std::printf(" | ahead of\n");
    const column *rival = find(columns, bench_best_mode);
    for (std::size_t view = 0; view < shown.front()->views.size(); view++) {
        std::printf("  %-*s", kViewWidth, shown.front()->views[view]->pair.c_str());
        std::string behind;
        for (const column *of : shown) {
            const bench_outcome &one = *of->views[view];
            std::printf(" |");
            bench_print_value(6, 2, right(one));
            bench_print_value(6, 2, wrong(one));
            bench_print_value(5, 1, bench_region_figure(one.regions, "all", BENCH_KEPT));
            bench_print_value(6, 2, bench_region_figure(one.regions, "all", BENCH_KEPT_BAD_1PX));
            bench_print_value(6, 2, bench_region_figure(one.regions, "all", BENCH_KEPT_BAD_3PX));
            if (rival != nullptr && right(one) < right(*rival->views[view])) {
                behind += " " + of->method;
            }
        }
        std::printf(" |%s\n", behind.c_str());
    }
}

}  // namespace

void bench_print_figures(const std::vector<bench_outcome> &outcomes) {
    const table figures = {outcomes, columns_of(outcomes)};
    if (figures.columns.empty()) {
        return;
    }
    const column &first = figures.columns.front();
    if (!first.views.empty()) {
        print_views(figures.columns);
    }
    std::printf("\n%-*s", kNameWidth + 2, "figures");
    for (const column &of : figures.columns) {
        std::printf(" %*s", kColumnWidth, of.method.c_str());
    }
    std::printf("\n");
    if (!first.recorded.empty()) {
        print_recorded(figures);
    }
    if (!first.views.empty()) {
        print_rendered(figures);
    }
    std::printf(
        "  pairs whose truth is in whole pixels are rounded, and have no z; z: rms of error over\n"
        "  predicted sigma and the truth's rounding, of the kept that are off by at most 1 px\n");
}
