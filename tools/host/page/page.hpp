// SPDX-License-Identifier: Apache-2.0
/// What all reports are made of: one page with one style sheet and set of scripts, and its cards,
/// notes, tables, figures and scales. Texts are HTML unless they say otherwise.
#ifndef VERGENCE_TOOLS_HOST_PAGE_PAGE_HPP
#define VERGENCE_TOOLS_HOST_PAGE_PAGE_HPP

#include <string>
#include <utility>
#include <vector>

#include "tools/host/formats/colormap.hpp"

struct page_parts {
    std::string title;
    std::string meta;  // paragraphs below the title (page_meta)
    std::string body, footer;
    std::string after;             // the footer, such as data of the scripts
    const char *style = "";        // CSS beyond that of all pages
    const char *script = "";       // run after that of all pages, inside the same function
    bool pictures_beside = false;  // pictures are files next to the page; else they are inside
    bool live = false;             // the scripts ask the server that the page is from
};

/// The complete document: it needs no network.
std::string page_make(const page_parts &parts);

std::string page_meta(const std::string &text);
std::string page_section(const char *id, const std::string &title, const std::string &content);

/// A figure that matters; `grade`: good, fair, bad or "".
std::string page_card(const std::string &name, const std::string &value, const std::string &note,
                      const std::string &grade = "");
std::string page_cards(const std::string &cards);

/// A remark, `text` plain; `kind`: warning or "". `title` may be empty.
std::string page_note(const std::string &kind, const std::string &title, const std::string &text);
/// The list of such remarks; empty if there are none.
std::string page_notes(const std::string &notes);

/// A row of a table, and one with a bar of `share` (0 to 1) before its value.
std::string page_row(const std::string &name, const std::vector<std::string> &values);
std::string page_row(const std::string &name, const std::string &value);
std::string page_bar_row(const std::string &name, double share, const std::string &value);
/// A table in its panel. `title` and `heads` may be empty; `after` follows below the table.
std::string page_table(const std::string &title, const std::vector<std::string> &heads,
                       const std::string &rows, const std::string &after = "");

std::string page_figure(const std::string &content, const std::string &caption);

/// "#rrggbb", and a CSS gradient over the entries 0 to `last` of a colour table.
std::string page_colour(const colormap_rgb &colour);
std::string page_gradient(const colormap_table &table, int last = 254);

/// Places on a scale of colours, 0 to 1, each with its text.
using page_ticks = std::vector<std::pair<double, std::string>>;
std::string page_scale(const std::string &gradient, const page_ticks &ticks);

struct page_key {
    colormap_rgb colour;
    std::string text, value;  // the value may be empty
};
std::string page_keys(const std::vector<page_key> &keys);

#endif
