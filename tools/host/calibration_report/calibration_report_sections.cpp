// SPDX-License-Identifier: Apache-2.0
// The top of the page: verdict, main figures, what to photograph next.
#include "tools/host/calibration_report/calibration_report_sections.hpp"

#include <cmath>

#include "calib/solve/uncertainty.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"

namespace {

std::string focal_card(const calibration_page &page, int camera) {
    const calib::solution &result = *page.result;
    const lens &one = result.camera[camera];
    const double sigma_px = result.sigma.focal_px[static_cast<std::size_t>(camera)];
    const std::string name = std::string("Focal length, ") + calibration_report_side(page, camera);
    return page_card(name, report_text_format("%.2f <small>± %.2f px</small>", one.fx_px, sigma_px),
                     report_text_format("one sigma is %.3f %%", 100 * sigma_px / one.fx_px));
}

std::string depth_card(const calib::solution &result, const calibration_figures &figures) {
    const double middle_px[2] = {(result.camera[0].width_px - 1) / 2.0,
                                 (result.camera[0].height_px - 1) / 2.0};
    double sigma_mm = 0;
    const double depth_mm = figures.median_distance_mm;
    if (!(depth_mm > 0) || result.errors == nullptr ||
        !result.errors->depth_sigma(middle_px, depth_mm, &sigma_mm)) {
        return "";
    }
    return page_card("Depth in the middle", "± " + report_text_length(sigma_mm, "mm"),
                     "at " + report_text_length(depth_mm, "mm") +
                         ", the boards' median distance: the calibration's own share, one sigma");
}

const char *class_of(const calib::solution &result) {
    if (result.verdict.good) {
        return "is-good";
    }
    return result.solved ? "is-fair" : "is-bad";
}

}  // namespace

const char *calibration_report_side(const calibration_page &page, int camera) {
    if (page.seen->cameras == 1) {
        return "camera";
    }
    return camera == 0 ? "left" : "right";
}

std::string calibration_report_image_name(const calibration_page &page, std::size_t capture,
                                          int camera) {
    const std::string &name = page.seen->captures[capture].name[static_cast<std::size_t>(camera)];
    return name.empty()
               ? report_text_format("%s %zu", calibration_report_side(page, camera), capture + 1)
               : report_text_escape(report_text_file_name(name));
}

std::string calibration_report_verdict_box(const std::string &kind, const std::string &sentence,
                                           const std::vector<std::string> &reasons,
                                           const std::vector<std::string> &remarks) {
    // The part before the colon is the verdict itself.
    const std::size_t colon = sentence.find(": ");
    const std::size_t word = colon != std::string::npos && colon < 40 ? colon + 1 : 0;
    const std::string html =
        report_text_format("<div class=\"verdict %s\" id=\"verdict\"><p><b>%s</b>%s</p></div>\n",
                           kind.c_str(), report_text_escape(sentence.substr(0, word)).c_str(),
                           report_text_escape(sentence.substr(word)).c_str());
    std::string notes;
    for (std::size_t i = 1; i < reasons.size(); i++) {
        notes += page_note("warning", "", reasons[i]);
    }
    for (const std::string &remark : remarks) {
        notes += page_note("remark", "", remark);
    }
    return html + page_notes(notes);
}

std::string calibration_report_verdict(const calib::solution &result) {
    const calib::verdict &verdict = result.verdict;
    return calibration_report_verdict_box(class_of(result), verdict.sentence, verdict.reasons,
                                          verdict.remarks);
}

std::string calibration_report_cards(const calibration_page &page,
                                     const calibration_figures &figures) {
    const calib::solution &result = *page.result;
    std::size_t corners = 0;
    for (const calibration_camera_figures &camera : figures.camera) {
        corners += camera.used;
    }
    std::string cards =
        page_card("Board positions",
                  report_text_format("%d <small>of %zu</small>", result.captures_used,
                                     page.seen->captures.size()),
                  report_text_count(corners) + " corners used, " +
                      report_text_count(result.rejected_corners.size()) + " rejected by name") +
        page_card("Reprojection", report_text_format("%.3f <small>px rms</small>", result.rms_px),
                  "per point, over all used corners") +
        page_card("Held out",
                  result.held_out_rms_px > 0
                      ? report_text_format("%.3f <small>px rms</small>", result.held_out_rms_px)
                      : "not tested",
                  result.held_out_rms_px > 0
                      ? "over boards that were not used for the lenses and the rig"
                      : "too few boards for cross-validation");
    for (int camera = 0; camera < page.seen->cameras; camera++) {
        cards += focal_card(page, camera);
    }
    if (page.seen->cameras == 1) {
        return cards;
    }
    cards += page_card(
        "Baseline",
        report_text_format("%.3f <small>± %.3f mm</small>", calibration_baseline_mm(&result.rig),
                           result.sigma.baseline_mm),
        "distance of the two cameras' centres");
    if (!figures.vertical_px.empty()) {
        cards +=
            page_card("Rows agree within",
                      report_text_format("%.3f <small>px rms</small>", figures.vertical_rms_px),
                      "of all corners seen by both cameras, after rectification");
    }
    return cards + depth_card(result, figures);
}

std::string calibration_report_hints(const calibration_figures &figures) {
    if (figures.hints.empty()) {
        return "";
    }
    std::string html =
        "<div class=\"panel next\"><p><b>" + report_text_escape(figures.hints[0]) + "</b></p>\n";
    for (std::size_t i = 1; i < figures.hints.size(); i++) {
        html += "<p>" + report_text_escape(figures.hints[i]) + "</p>\n";
    }
    return html + "</div>\n";
}
