// SPDX-License-Identifier: Apache-2.0
#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"
#include "tools/host/view/view_server.hpp"

extern "C" {
// Of this folder, embedded by the build.
extern const char *const view_html;
extern const char *const view_style;
extern const char *const view_script;
}

std::string view_page_make(const std::string &title, const std::string &facts) {
    page_parts page;
    page.title = report_text_escape(title);
    page.body = view_html;
    page.live = true;
    page.footer = "vergence view";
    page.after = "<script type=\"application/json\" id=\"facts\">" + facts + "</script>\n";
    page.style = view_style;
    page.script = view_script;
    return page_make(page);
}
