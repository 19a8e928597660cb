// SPDX-License-Identifier: Apache-2.0
#include "tools/host/page/page.hpp"

#include "tools/host/formats/report_text.hpp"

extern "C" {
// Of this folder, embedded by the build.
extern const char *const page_frame;
extern const char *const page_style;
extern const char *const page_script;
}

std::string page_make(const page_parts &parts) {
    return report_text_fill(page_frame,
                            {{"title", parts.title},
                             {"images", parts.pictures_beside ? "'self' file:" : "data:"},
                             {"connect", parts.live ? "'self'" : "'none'"},
                             {"style", page_style + std::string(parts.style)},
                             {"meta", parts.meta},
                             {"body", parts.body},
                             {"footer", parts.footer},
                             {"after", parts.after},
                             {"script", page_script + std::string(parts.script)}});
}

std::string page_meta(const std::string &text) {
    return "<p class=\"meta\">" + text + "</p>\n";
}

std::string page_section(const char *id, const std::string &title, const std::string &content) {
    return report_text_format(
               "<section id=\"%s\" aria-labelledby=\"%s-title\">\n<h2 id=\"%s-title\">%s</h2>\n",
               id, id, id, title.c_str()) +
           content + "</section>\n";
}

std::string page_card(const std::string &name, const std::string &value, const std::string &note,
                      const std::string &grade) {
    return "<div class=\"card\"><p class=\"name\">" + name + "</p><p class=\"value " + grade +
           "\">" + value + "</p><p class=\"note\">" + note + "</p></div>\n";
}

std::string page_cards(const std::string &cards) {
    return "<div class=\"cards\">\n" + cards + "</div>\n";
}

std::string page_note(const std::string &kind, const std::string &title, const std::string &text) {
    return "<li class=\"" + kind + "\">" + (title.empty() ? "" : "<b>" + title + "</b>") +
           report_text_escape(text) + "</li>\n";
}

std::string page_notes(const std::string &notes) {
    return notes.empty() ? notes : "<ul class=\"notes\">\n" + notes + "</ul>\n";
}

std::string page_row(const std::string &name, const std::vector<std::string> &values) {
    std::string html = "<tr><th scope=\"row\">" + name + "</th>";
    for (const std::string &value : values) {
        html += "<td>" + value + "</td>";
    }
    return html + "</tr>\n";
}

std::string page_row(const std::string &name, const std::string &value) {
    return page_row(name, std::vector<std::string>{value});
}

std::string page_bar_row(const std::string &name, double share, const std::string &value) {
    return "<tr><th scope=\"row\">" + name +
           report_text_format("</th><td class=\"bar\"><i style=\"width:%.1f%%\"></i></td><td>",
                              100 * share) +
           value + "</td></tr>\n";
}

std::string page_table(const std::string &title, const std::vector<std::string> &heads,
                       const std::string &rows, const std::string &after) {
    std::string html = "<div class=\"panel\">";
    if (!title.empty()) {
        html += "<h3>" + title + "</h3>";
    }
    html += "<table>";
    if (!heads.empty()) {
        html += "<thead><tr>";
        for (const std::string &head : heads) {
            html += "<th>" + head + "</th>";
        }
        html += "</tr></thead>";
    }
    return html + "<tbody>\n" + rows + "</tbody></table>" + after + "</div>\n";
}

std::string page_figure(const std::string &content, const std::string &caption) {
    return "<figure>" + content + "<figcaption>" + caption + "</figcaption></figure>\n";
}

std::string page_colour(const colormap_rgb &colour) {
    return report_text_format("#%02x%02x%02x", colour[0], colour[1], colour[2]);
}

std::string page_gradient(const colormap_table &table, int last) {
    constexpr int steps = 16;
    std::string css = "linear-gradient(90deg";
    for (int i = 0; i <= steps; i++) {
        css += "," + page_colour(table[static_cast<std::size_t>(i * last / steps)]);
    }
    return css + ")";
}

std::string page_scale(const std::string &gradient, const page_ticks &ticks) {
    bool two_lines = false;
    std::string html;
    for (const auto &[share, text] : ticks) {
        two_lines = two_lines || text.find("<br>") != std::string::npos;
        html += report_text_format("<span style=\"left:%.1f%%\">", 100 * share) + text + "</span>";
    }
    return "<div class=\"legend\"><div class=\"ramp\" style=\"background:" + gradient +
           "\"></div><div class=\"ticks" + (two_lines ? " double" : "") + "\">" + html +
           "</div></div>";
}

std::string page_keys(const std::vector<page_key> &keys) {
    std::string html = "<ul class=\"keys\">";
    for (const page_key &key : keys) {
        html += "<li><i style=\"background:" + page_colour(key.colour) + "\"></i>" +
                report_text_escape(key.text) +
                (key.value.empty() ? "" : "<em>" + key.value + "</em>") + "</li>";
    }
    return html + "</ul>";
}
