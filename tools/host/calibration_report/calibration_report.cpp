// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibration_report/calibration_report.hpp"

#include <map>

#include "tools/host/calibration_report/calibration_report_sections.hpp"
#include "tools/host/calibration_report/calibration_report_sources.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/report/report_sources.hpp"

namespace {

std::string section(const char *id, const char *title, const std::string &content) {
    return report_text_format(
               "<section id=\"%s\" aria-labelledby=\"%s-title\">\n<h2 id=\"%s-title\">%s</h2>\n",
               id, id, id, title) +
           content + "</section>\n";
}

std::string body_of(const calibration_page &page) {
    const calib::solution &result = *page.result;
    const std::string verdict = calibration_report_verdict(result);
    const std::string rejected =
        section("rejected", "What was not used", calibration_report_rejected(page));
    if (!result.solved) {
        return "<section aria-label=\"Verdict\">\n" + verdict + "</section>\n" + rejected;
    }
    const calibration_figures figures = calibration_figures_collect(*page.seen, result);
    return "<section aria-label=\"Verdict and main figures\">\n" + verdict +
           "<div class=\"cards\">\n" + calibration_report_cards(page, figures) +
           "</div>\n</section>\n" +
           section("next", "What to photograph next", calibration_report_hints(figures)) +
           section("coverage", "What was photographed",
                   calibration_report_coverage(page, figures)) +
           calibration_report_pair(page, figures) +
           section("uncertainty", "How far it can be trusted",
                   calibration_report_uncertainty(page, figures)) +
           section("residuals", "What is left over", calibration_report_residuals(page, figures)) +
           rejected + section("views", "View by view", calibration_report_views(page)) +
           section("numbers", "All numbers", calibration_report_tables(page, figures));
}

std::string meta_of(const calibration_page &page) {
    const calib::observations &seen = *page.seen;
    return report_text_format("%zu %s · board of %d × %d corners, squares of %g mm",
                              seen.captures.size(), seen.cameras == 2 ? "pairs" : "images",
                              seen.target.columns, seen.target.rows, seen.target.square_mm) +
           (seen.target.coded() ? " with markers" : "");
}

}  // namespace

bool calibration_report_write(const calibration_page &page, std::ostream &out) {
    const std::map<std::string, std::string> parts = {
        {"title", report_text_escape(page.title)},
        {"style", std::string(report_sources_style) + calibration_report_sources_style},
        {"script", calibration_report_sources_script},
        {"meta", meta_of(page)},
        {"body", body_of(page)},
    };
    const std::string text = report_text_fill(calibration_report_sources_page, parts);
    out.write(text.data(), static_cast<std::streamsize>(text.size()));
    out.flush();
    return out.good();
}
