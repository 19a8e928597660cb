// SPDX-License-Identifier: Apache-2.0
#include "focus_table.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>

namespace focus {
namespace {

/// `focused` with a blur of this much more than the best reachable is false.
constexpr double kFalsePx = 2;

struct Column {
    unsigned textured = 0, sharp = 0, two_depths = 0, sharp_two = 0;
    unsigned flat = 0, no_contrast = 0, between = 0;
    unsigned lamps = 0, sharp_lamps = 0, false_lamps = 0;
    unsigned lenses = 0, false_focused = 0, errors = 0;
    unsigned blurs = 0, right_blurs = 0;
    std::vector<double> seconds, frames;  ///< time for both lenses; frames for each lens
    std::array<unsigned, kVerdicts> verdicts{};
};

bool is_false(const Result &result) {
    return result.report.verdict == Verdict::kFocused && result.excess_px > kFalsePx;
}

void add(Column &column, const Result &result) {
    const Report &report = result.report;
    column.lenses++;
    column.verdicts[std::size_t(report.verdict)]++;
    column.false_focused += is_false(result);
    column.errors += report.verdict == Verdict::kError;
    const bool sharp = result.is_sharp() && report.verdict != Verdict::kNoContrast;
    switch (result.kind) {
        case SceneClass::kTextured:
            column.textured++;
            column.sharp += sharp;
            break;
        case SceneClass::kTwoDepths:
            column.two_depths++;
            column.sharp_two += sharp;
            break;
        case SceneClass::kFlat:
            column.flat++;
            column.no_contrast += report.verdict == Verdict::kNoContrast;
            break;
        case SceneClass::kLamps:
            column.lamps++;
            column.false_lamps += is_false(result);
            column.sharp_lamps += result.is_sharp() && report.verdict == Verdict::kFocused;
            break;
        case SceneClass::kBetween:
            column.between++;
            break;
    }
    const bool judged = report.verdict == Verdict::kFocused ||
                        report.verdict == Verdict::kEverywhere ||
                        report.verdict == Verdict::kTwoPeaks;
    if (judged && report.blur_px >= 0) {
        column.blurs++;
        const double error_px = std::abs(report.blur_px - result.blur_px);
        column.right_blurs += error_px <= std::max(0.3 * result.blur_px, 0.5);
    }
    column.frames.push_back(report.frames);
    if (result.side == 0) {
        column.seconds.push_back(result.both_seconds);
    }
}

double part(std::vector<double> values, double share) {
    if (values.empty()) {
        return 0;
    }
    std::sort(values.begin(), values.end());
    return values[std::size_t(share * double(values.size() - 1) + 0.5)];
}

std::map<unsigned, Column> columns_of(const std::vector<Result> &results) {
    std::map<unsigned, Column> columns;
    for (const Result &result : results) {
        add(columns[result.method], result);
    }
    return columns;
}

std::string shares(unsigned count, unsigned of) {
    char text[60];
    std::snprintf(text, sizeof text, "%.2f %% (%u of %u)", of > 0 ? 100.0 * count / of : 0.0, count,
                  of);
    return of > 0 ? text : "-";
}

std::string two(const std::vector<double> &values, int digits) {
    char text[60];
    std::snprintf(text, sizeof text, "%.*f / %.*f", digits, part(values, 0.5), digits,
                  part(values, 0.99));
    return text;
}

}  // namespace

const char *failure_of(const Result &result) {
    const Report &report = result.report;
    if (report.verdict == Verdict::kError || report.verdict == Verdict::kJammed ||
        report.verdict == Verdict::kChanged) {
        return kVerdictNames[std::size_t(report.verdict)];
    }
    if (is_false(result)) {
        return "false focused";
    }
    if (result.kind == SceneClass::kTextured) {
        return report.verdict == Verdict::kNoContrast ? "contrast not seen"
               : result.is_sharp()                    ? nullptr
                                                      : "not sharp";
    }
    if (result.kind == SceneClass::kFlat && report.verdict != Verdict::kNoContrast) {
        return "flat, but not reported so";
    }
    return nullptr;
}

void print_failure(const Result &result) {
    std::printf(
        "%s: --scene %u (%s, %s side, %s): %s at %.1f, best %.1f +-%.1f; blur %.2f px, "
        "reported %.2f; contrast %.2f %%, noise %.2f %%; %.1f s, %u frames\n",
        failure_of(result), result.scene, kMethodRows[result.method].name,
        result.side == 0 ? "left" : "right", kSceneClassNames[int(result.kind)],
        kVerdictNames[std::size_t(result.report.verdict)], result.ring, result.best,
        result.tolerance, result.blur_px, result.report.blur_px, 100 * result.contrast,
        100 * result.noise, result.report.seconds, result.report.frames);
}

void print_table(std::FILE *file, const std::vector<Result> &results) {
    const std::map<unsigned, Column> columns = columns_of(results);
    const auto row = [&](const char *name, const char *limit,
                         const std::function<std::string(const Column &)> &cell) {
        std::fprintf(file, "| %s |", name);
        for (const auto &[method, column] : columns) {
            std::fprintf(file, " %s |", cell(column).c_str());
        }
        std::fprintf(file, " %s |\n", limit);
    };
    std::fprintf(file, "| figure |");
    for (const auto &[method, column] : columns) {
        std::fprintf(file, " %s |", kMethodRows[method].name);
    }
    std::fprintf(file, " limit (cold; table) |\n|---|");
    for (std::size_t i = 0; i <= columns.size(); i++) {
        std::fprintf(file, "---|");
    }
    std::fprintf(file, "\n");
    row("textured, one depth: ends sharp", "99.9 %",
        [](const Column &c) { return shares(c.sharp, c.textured); });
    row("textured, two depths: ends sharp at one", "",
        [](const Column &c) { return shares(c.sharp_two, c.two_depths); });
    row("flat: `no contrast`", "all",
        [](const Column &c) { return shares(c.no_contrast, c.flat); });
    row("lamps: `focused`, and is", "",
        [](const Column &c) { return shares(c.sharp_lamps, c.lamps); });
    row("lamps: `focused`, but is not", "0",
        [](const Column &c) { return shares(c.false_lamps, c.lamps); });
    row("`focused`, but is not", "0",
        [](const Column &c) { return shares(c.false_focused, c.lenses); });
    row("reported blur is within 30 % or 0.5 px", "95 %",
        [](const Column &c) { return shares(c.right_blurs, c.blurs); });
    row("seconds for both lenses, p50 / p99", "12 / 20; 6 / 10",
        [](const Column &c) { return two(c.seconds, 1); });
    row("frames read for a lens, p50 / p99", "250; 50 (p99)",
        [](const Column &c) { return two(c.frames, 0); });
    for (std::size_t verdict = 0; verdict < kVerdicts; verdict++) {
        const std::string name = "verdict `" + std::string(kVerdictNames[verdict]) + "`";
        row(name.c_str(), "",
            [verdict](const Column &c) { return shares(c.verdicts[verdict], c.lenses); });
    }
}

bool limits_hold(const std::vector<Result> &results, const Limits &limits) {
    bool holds = true;
    for (const auto &[method, c] : columns_of(results)) {
        const MethodRow &own = kMethodRows[method];
        holds = holds && c.sharp >= limits.sharp * c.textured &&
                c.no_contrast >= limits.no_contrast * c.flat &&
                c.false_focused <= limits.false_focused * c.lenses &&
                c.right_blurs >= limits.right_blurs * c.blurs &&
                part(c.seconds, 0.5) <= limits.factor_p50 * own.seconds_p50 &&
                part(c.seconds, 0.99) <= limits.factor_p99 * own.seconds_p99 &&
                part(c.frames, 0.99) <= limits.factor_p99 * own.frames_p99;
    }
    return holds;
}

}  // namespace focus
