// SPDX-License-Identifier: Apache-2.0
// What a look at a board or at marks says: for people, and as JSON.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tools/host/calibrate/calibrate_touch_up.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

// A look that excludes only larger errors of lengths than this shows too little.
const double excluded_limit = 0.05;
const double excluded_sigmas = 3;

const char *size_word(const touch_up_look &look) {
    return look.marks ? "length" : "squares";
}

std::string not_as_predicted(const touch_up_look &look, double square_mm, bool corrected) {
    std::string text = look.name + ": ";
    if (look.corners > 0) {
        text += report_text_format(
            "the %s %s off by %.1f, ", size_word(look), look.marks ? "is" : "are",
            std::max(look.read.square_z(square_mm), look.fitted.square_z(square_mm)));
    }
    if (look.read.far_sigma_px > 0) {
        text += report_text_format("the mark at infinity is off by %.1f, ",
                                   std::max(look.read.far_z(), look.fitted.far_z()));
    }
    text += report_text_format(
        "rows are off by %.1f predicted standard deviations",
        look.corners > 0 ? look.read.rows_z() : std::max(look.read.rows_z(), look.fitted.rows_z()));
    if (look.own_apart) {
        text +=
            report_text_format(", rows of the pair's own matches come apart from %.2f to %.2f px",
                               look.own_rows_px, look.own_rows_after_px);
    }
    const char *check =
        look.corners == 0 || look.marks ? "check the marks" : "check --square and --board";
    return text +
           (corrected ? std::string("; ") + check + ", or calibrate again" : ": calibrate again");
}

// By the look that was predicted best, whatever it showed.
void state_what_is_excluded(const std::vector<touch_up_look> &looks, double square_mm,
                            touch_up_outcome *outcome) {
    const touch_up_look *best = &looks[0];
    double least = INFINITY;
    for (const touch_up_look &look : looks) {
        for (const board_fit *fit : {&look.read, &look.fitted}) {
            if (fit->square_sigma_mm < least) {
                best = &look;
                least = fit->square_sigma_mm;
                outcome->off = std::abs(fit->square_mm / square_mm - 1);
                outcome->excluded = outcome->off + excluded_sigmas * least / square_mm;
            }
        }
    }
    outcome->good = outcome->excluded <= excluded_limit;
    outcome->sentence = report_text_format(
        "%s: the %s %s within %.1f %%%s errors above %.1f %% are excluded%s.",
        outcome->good ? "Good" : "Undecided", size_word(*best), best->marks ? "agrees" : "agree",
        100 * outcome->off, outcome->good ? ":" : ", but only", 100 * outcome->excluded,
        outcome->good ? "" : "; look from nearer, or at a longer focal length");
}

}  // namespace

std::string touch_up_text(const std::vector<touch_up_look> &looks, bool corrected) {
    const auto line = [](const char *name, const touch_up_look &look, const board_fit &fit,
                         double sigma_mm) {
        std::string size;
        if (fit.square_mm > 0) {
            size += report_text_format("%s %.3f mm (predicted deviation %.3f), ", size_word(look),
                                       fit.square_mm, fit.square_sigma_mm);
        }
        if (fit.far_sigma_px > 0) {
            size += report_text_format("infinity %.2f px (%.2f), ", fit.far_px, fit.far_sigma_px);
        }
        return report_text_format("%-12s%srows %.3f px (%.3f), depth %.2f mm\n", name, size.c_str(),
                                  fit.rows_px, fit.rows_sigma_px, sigma_mm);
    };
    std::string text;
    for (const touch_up_look &look : looks) {
        text += report_text_format("%-11s %d %s, %.0f mm away%s\n", look.name.c_str(), look.corners,
                                   look.marks ? "marks" : "corners", look.depth_mm,
                                   look.holds ? "" : ": not as predicted");
        text += line("as read", look, look.read, look.depth_sigma_mm);
        text += look.corners > 0 || look.matches > 0
                    ? line("refined", look, look.fitted, look.fitted_depth_sigma_mm)
                    : "";
        text +=
            corrected ? line("corrected", look, look.corrected, look.corrected_depth_sigma_mm) : "";
        text += look.matches > 0 ? report_text_format("own matches %d, rows %.3f px", look.matches,
                                                      look.own_rows_px)
                                 : "own matches none: the frames are not there, or show too little";
        text += corrected && look.matches > 0
                    ? report_text_format(", corrected %.3f px\n", look.own_rows_after_px)
                    : "\n";
    }
    return text;
}

touch_up_outcome touch_up_verdict(const std::vector<touch_up_look> &looks, double square_mm,
                                  bool corrected) {
    touch_up_outcome outcome;
    const touch_up_look &last = looks.back();
    const auto wrong = std::find_if(corrected ? looks.end() - 1 : looks.begin(), looks.end(),
                                    [](const touch_up_look &look) { return !look.holds; });
    if (wrong != looks.end()) {
        outcome.reason = not_as_predicted(*wrong, square_mm, corrected);
        outcome.sentence = "Not good: " + outcome.reason + ".";
    } else if (corrected) {
        outcome.good = true;
        outcome.sentence =
            report_text_format("Good: corrected at %s, depth at %.0f mm is known to +- %.2g mm.",
                               last.name.c_str(), last.depth_mm, last.corrected_depth_sigma_mm);
    } else {
        state_what_is_excluded(looks, square_mm, &outcome);
    }
    return outcome;
}

std::string touch_up_json(const std::vector<touch_up_look> &looks, double square_mm,
                          bool corrected) {
    nlohmann::ordered_json pairs = nlohmann::ordered_json::array();
    const auto fit_json = [square_mm](const board_fit &fit, double sigma_mm) {
        return nlohmann::ordered_json{
            {"square_mm", fit.square_mm},          {"square_sigma_mm", fit.square_sigma_mm},
            {"square_z", fit.square_z(square_mm)}, {"rows_px", fit.rows_px},
            {"rows_sigma_px", fit.rows_sigma_px},  {"rows_z", fit.rows_z()},
            {"infinity_px", fit.far_px},           {"infinity_sigma_px", fit.far_sigma_px},
            {"depth_sigma_mm", sigma_mm},
        };
    };
    const touch_up_outcome outcome = touch_up_verdict(looks, square_mm, corrected);
    for (const touch_up_look &look : looks) {
        nlohmann::ordered_json pair = {
            {"pair", look.name},
            {"corners", look.corners},
            {"depth_mm", look.depth_mm},
            {"holds", look.holds},
            {"matches", look.matches},
            {"own_rows_px", look.own_rows_px},
            {"own_rows_corrected_px", look.own_rows_after_px},
            {"read", fit_json(look.read, look.depth_sigma_mm)},
            {"refined", fit_json(look.fitted, look.fitted_depth_sigma_mm)}};
        if (corrected) {
            pair["corrected"] = fit_json(look.corrected, look.corrected_depth_sigma_mm);
        }
        pairs.push_back(pair);
    }
    nlohmann::ordered_json page{
        {"verdict", {{"good", outcome.good}, {"sentence", outcome.sentence}}},
        {"square_mm", square_mm},
        {corrected ? "touch_up" : "verify", pairs}};
    if (!corrected && outcome.reason.empty()) {
        page["off"] = outcome.off;
        page["excluded_above"] = outcome.excluded;
    }
    return page.dump(2) + "\n";
}
