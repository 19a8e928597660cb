// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibration_report/zoom_report.hpp"

#include <cmath>

#include "tools/host/calibration_report/calibration_report_sections.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"

namespace {

std::string verdict(const zoom_page &page) {
    const std::vector<std::string> &reasons = page.result->warnings;
    return calibration_report_verdict_box(reasons.empty() ? "is-good" : "is-bad", page.verdict,
                                          reasons, {});
}

std::string cards(const zoom_page &page) {
    const zoom_calibration &rig = *page.result->rig;
    const zoom_validation &checked = rig.validation;
    std::string text = page_card("Zooms", std::to_string(checked.settings),
                                 report_text_format("%d board positions", checked.boards));
    text += page_card("Corners", std::to_string(checked.corners),
                      report_text_format("%d more not used", checked.rejected_corners));
    text += page_card("Residual", report_text_format("%.3f px", checked.rms_px),
                      report_text_format("rms of a corner; %.2f of its expected noise",
                                         page.result->noise_ratio));
    text +=
        checked.held_out_px > 0
            ? page_card(
                  "At zooms left out", report_text_format("%.2f px", checked.held_out_px),
                  report_text_format("epipolar; f off by %.3f %%", 100 * checked.held_out_focal))
            : page_card("Focal length",
                        report_text_format("%.0f to %.0f px", std::exp(rig.camera[0].log_focal.min),
                                           std::exp(rig.camera[0].log_focal.max)),
                        "left, focused at infinity");
    return page_cards(text);
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
        rows += page_row(
            report_text_escape(name),
            {one.index < 0 ? "all" : std::to_string(one.index), report_text_escape(one.reason)});
    }
    return page_table("", {"picture", "corner", "reason"}, rows);
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
    return calibration_report_document(
        page.result->rig->id,
        report_text_format("%zu pairs at %d zooms", page.seen->captures.size(),
                           page.result->rig->validation.settings),
        "<section aria-label=\"Verdict and main figures\">\n" + verdict(page) + cards(page) +
            "</section>\n" +
            page_section("focal", "Focal length and zoom", zoom_report_focal(page)) +
            page_section("functions", "The lenses' other functions", zoom_report_functions(page)) +
            page_section("depth", "How far depth can be trusted", zoom_report_depth(page)) +
            page_section("rig", "The rig", zoom_report_rig(page)) +
            page_section("rejected", "What was not used", rejected(page)));
}
