// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibration_report/zoom_report.hpp"

#include <cmath>
#include <map>

#include "tools/host/calibration_report/calibration_report_sections.hpp"
#include "tools/host/calibration_report/calibration_report_sources.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/report/report_sources.hpp"

namespace {

std::string section(const char *id, const char *title, const std::string &content) {
    return report_text_format(
               "<section id=\"%s\" aria-labelledby=\"%s-title\">\n"
               "<h2 id=\"%s-title\">%s</h2>\n",
               id, id, id, title) +
           content + "</section>\n";
}

std::string card(const std::string &name, const std::string &value, const std::string &note) {
    return "<div class=\"card\"><h3>" + name + "</h3><p class=\"value\">" + value +
           "</p><p class=\"note\">" + note + "</p></div>\n";
}

std::string verdict(const zoom_page &page) {
    const std::vector<std::string> &reasons = page.result->warnings;
    return calibration_report_verdict_box(reasons.empty() ? "is-good" : "is-bad", page.verdict,
                                          reasons, {});
}

std::string cards(const zoom_page &page) {
    const zoom_calibration &rig = *page.result->rig;
    const zoom_validation &checked = rig.validation;
    std::string text = "<div class=\"cards\">\n";
    text += card("Zooms", std::to_string(checked.settings),
                 report_text_format("%d board positions", checked.boards));
    text += card("Corners", std::to_string(checked.corners),
                 report_text_format("%d more not used", checked.rejected_corners));
    text += card("Residual", report_text_format("%.3f px", checked.rms_px),
                 report_text_format("rms of a corner; %.2f of its expected noise",
                                    page.result->noise_ratio));
    text +=
        checked.held_out_px > 0
            ? card("At zooms left out", report_text_format("%.2f px", checked.held_out_px),
                   report_text_format("epipolar; f off by %.3f %%", 100 * checked.held_out_focal))
            : card("Focal length",
                   report_text_format("%.0f to %.0f px", std::exp(rig.camera[0].log_focal.min),
                                      std::exp(rig.camera[0].log_focal.max)),
                   "left, focused at infinity");
    return text + "</div>\n";
}

std::string rejected(const zoom_page &page) {
    const std::vector<calib::zoom_rejection> &list = page.result->rejections;
    if (list.empty()) {
        return "<p class=\"lead\">Every picture and corner was used.</p>";
    }
    std::string rows;
    for (const calib::zoom_rejection &one : list) {
        const std::string &name =
            page.seen->captures[one.capture].name[static_cast<size_t>(one.camera)];
        rows += "<tr><th scope=\"row\">" + report_text_escape(name) + "</th><td>" +
                (one.index < 0 ? "all" : std::to_string(one.index)) + "</td><td>" +
                report_text_escape(one.reason) + "</td></tr>\n";
    }
    return "<div class=\"panel\"><table><thead><tr><th>picture</th><th>corner</th><th>reason</th>"
           "</tr></thead><tbody>\n" +
           rows + "</tbody></table></div>\n";
}

}  // namespace

zoom_state zoom_report_state(const zoom_page &page, double share) {
    zoom_state state{};
    for (size_t side = 0; side < 2; side++) {
        const zoom_camera &camera = page.result->rig->camera[side];
        const auto between = [](const zoom_range &range, double part) {
            return range.min + (range.max - range.min) * part;
        };
        state.side[side].zoom_counts = between(camera.zoom, share);
        state.side[side].focus_counts = between(camera.focus, 0.5);
        state.side[side].pan_rad = page.seen->captures[0].axes[side].pan_rad;
    }
    return state;
}

std::string zoom_report(const zoom_page &page) {
    const std::map<std::string, std::string> parts = {
        {"title", report_text_escape(page.result->rig->id)},
        {"style", std::string(report_sources_style) + calibration_report_sources_style},
        {"script", calibration_report_sources_script},
        {"meta", report_text_format("%zu pairs at %d zooms", page.seen->captures.size(),
                                    page.result->rig->validation.settings)},
        {"body",
         "<section aria-label=\"Verdict and main figures\">\n" + verdict(page) + cards(page) +
             "</section>\n" + section("focal", "Focal length and zoom", zoom_report_focal(page)) +
             section("functions", "The lenses' other functions", zoom_report_functions(page)) +
             section("depth", "How far depth can be trusted", zoom_report_depth(page)) +
             section("rig", "The rig", zoom_report_rig(page)) +
             section("rejected", "What was not used", rejected(page))},
    };
    return report_text_fill(calibration_report_sources_page, parts);
}
