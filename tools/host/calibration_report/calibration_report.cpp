// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibration_report/calibration_report.hpp"

#include "tools/host/calibration_report/calibration_report_sections.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"

extern "C" {
// Of this folder, embedded by the build.
extern const char *const calibration_report_style;
extern const char *const calibration_report_script;
}

namespace {

std::string body_of(const calibration_page &page) {
    const calib::solution &result = *page.result;
    const std::string verdict = calibration_report_verdict(result);
    const std::string rejected =
        page_section("rejected", "What was not used", calibration_report_rejected(page));
    if (!result.solved) {
        return "<section aria-label=\"Verdict\">\n" + verdict + "</section>\n" + rejected;
    }
    const calibration_figures figures = calibration_figures_collect(*page.seen, result);
    return "<section aria-label=\"Verdict and main figures\">\n" + verdict +
           page_cards(calibration_report_cards(page, figures)) + "</section>\n" +
           page_section("next", "What to photograph next", calibration_report_hints(figures)) +
           page_section("coverage", "What was photographed",
                        calibration_report_coverage(page, figures)) +
           calibration_report_pair(page, figures) +
           page_section("uncertainty", "How far it can be trusted",
                        calibration_report_uncertainty(page, figures)) +
           page_section("residuals", "What is left over",
                        calibration_report_residuals(page, figures)) +
           rejected + page_section("views", "View by view", calibration_report_views(page)) +
           page_section("numbers", "All numbers", calibration_report_tables(page, figures));
}

std::string meta_of(const calibration_page &page) {
    const calib::observations &seen = *page.seen;
    return report_text_format("%zu %s · board of %d × %d corners, squares of %g mm",
                              seen.captures.size(), seen.cameras == 2 ? "pairs" : "images",
                              seen.target.columns, seen.target.rows, seen.target.square_mm) +
           (seen.target.coded() ? " with markers" : "");
}

}  // namespace

std::string calibration_report_document(const std::string &title, const std::string &meta,
                                        const std::string &body) {
    page_parts page;
    page.title = report_text_escape(title);
    page.meta = page_meta(meta);
    page.body = body;
    page.footer =
        "Camera frames: X to the right, Y down, Z forward; poses map points from the left frame to "
        "the right one. Pixel (0, 0) is the centre of the top left pixel. Error bars follow from "
        "the corner noise estimated from the residuals.";
    page.style = calibration_report_style;
    page.script = calibration_report_script;
    return page_make(page);
}

bool calibration_report_write(const calibration_page &page, std::ostream &out) {
    const std::string text = calibration_report_document(page.title, meta_of(page), body_of(page));
    out.write(text.data(), static_cast<std::streamsize>(text.size()));
    out.flush();
    return out.good();
}
