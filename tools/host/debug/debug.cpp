// SPDX-License-Identifier: Apache-2.0
#include "tools/host/debug/debug.hpp"

#include <new>
#include <vector>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/output_file.h"
#include "tools/host/debug/debug_pictures.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/formats/write_png.hpp"

namespace {

constexpr const char *page_name = "debug.html";

void *begin(reconstruct_options *options, int row) {
    auto *look = new (std::nothrow) debug_look(row);
    if (look != nullptr) {
        options->kernels = look->kernels();
    }
    return look;
}

void end(void *self) {
    delete static_cast<debug_look *>(self);
}

int write_all(const debug_look &look, const reconstruct_context &context,
              const atomic_dir &directory, message *message) {
    debug_page page(look, context);
    char path[ATOMIC_DIR_PATH_BYTES];
    const int error = debug_pictures_draw(look, context, [&](const debug_picture &picture) {
        page.add(picture);
        atomic_dir_file_path(&directory, picture.file_name, path);
        return write_png_palette(picture.width_px, picture.height_px, picture.indices,
                                 picture.palette, path, message);
    });
    if (error != ERROR_OK) {
        return error;
    }
    atomic_dir_file_path(&directory, page_name, path);
    return page.write(path, message);
}

int write(void *self, const reconstruct_context *context, const atomic_dir *directory,
          message *message) {
    const debug_look &look = *static_cast<debug_look *>(self);
    // Called from C: must not throw.
    try {
        if (!look.failed()) {
            return write_all(look, *context, *directory, message);
        }
    } catch (const std::bad_alloc &) {
    }
    return message_set(message, ERROR_MEMORY, "out of memory for pictures of the matching");
}

}  // namespace

void debug_offer(reconstruct_program *program) {
    static const std::vector<const char *> names = [] {
        std::vector<const char *> all = debug_pictures_names();
        all.push_back(page_name);
        return all;
    }();
    program->debug_files = names.data();
    program->debug_file_count = static_cast<int>(names.size());
    program->debug_begin = begin;
    program->debug_write = write;
    program->debug_end = end;
}

namespace {

const char *const style = R"(
:root { color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif; --soft: #5a6766; --line: #dde2df; }
@media (prefers-color-scheme: dark) { :root { --soft: #9aa9a8; --line: #2a3435; } }
body { margin: 0 auto; max-width: 1400px; padding: 24px clamp(14px, 3vw, 40px); }
h1 { font-size: 1.4rem; margin: 0; overflow-wrap: anywhere; }
h2 { font-size: 1.1rem; margin: 36px 0 10px; border-top: 1px solid var(--line); padding-top: 14px; }
.lead, figcaption span, .scale { color: var(--soft); }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 520px), 1fr)); gap: 22px; }
.pictures.wide { grid-template-columns: 1fr; }
figure { margin: 0; }
.frame { position: relative; }
.frame img { display: block; width: 100%; image-rendering: pixelated; background: #55595e; }
.row { position: absolute; left: 0; right: 0; border-top: 1px solid #ff3b30; }
figcaption { font-size: 0.9rem; margin-top: 6px; }
figcaption span { display: block; }
.scale { display: flex; gap: 8px; align-items: center; font-size: 0.82rem; margin-top: 4px; flex-wrap: wrap; }
.ramp { width: 160px; height: 10px; border-radius: 2px; }
.key { width: 12px; height: 12px; border-radius: 2px; display: inline-block; }
)";

std::string css_colour(const colormap_rgb &colour) {
    return report_text_format("#%02x%02x%02x", colour[0], colour[1], colour[2]);
}

std::string scale_of(const debug_picture &picture) {
    std::string html = "<div class=\"scale\">";
    for (const auto &[colour, text] : picture.keys) {
        html += "<i class=\"key\" style=\"background:" + css_colour(colour) + "\"></i>" +
                report_text_escape(text);
    }
    if (picture.keys.empty()) {
        std::string ramp = "linear-gradient(90deg";
        constexpr int steps = 16;
        for (int i = 0; i <= steps; i++) {
            const auto index = static_cast<std::size_t>(i * picture.last_index / steps);
            ramp += "," + css_colour(picture.palette[index]);
        }
        html += report_text_escape(picture.low) + "<i class=\"ramp\" style=\"background:" + ramp +
                ")\"></i>" + report_text_escape(picture.high);
    }
    return html + "</div>";
}

}  // namespace

debug_page::debug_page(const debug_look &look, const reconstruct_context &context) {
    const rectify_plan &plan = context.result->plan;
    INVARIANT(look.row() >= 0 && look.row() < plan.height_px);
    title_ = "Matching of " + report_text_escape(report_text_file_name(context.left_path)) +
             " and " + report_text_escape(report_text_file_name(context.right_path));
    const char *preset = match_preset_name(context.options->preset);
    const std::string levels =
        look.levels().empty()
            ? "This preset has no costs and no path costs: it walks along each row."
            : report_text_format(
                  "Levels: %zu. The red line is row %d, which is examined "
                  "below.",
                  look.levels().size(), look.row());
    lead_ = report_text_format(
        "%d &times; %d pixels, disparities %d to %d px, preset %s. %s Each picture is a PNG next "
        "to "
        "this page; pixels without data are grey.",
        plan.width_px, plan.height_px, plan.disparity_min,
        plan.disparity_min + plan.disparity_count - 1, preset, levels.c_str());
    row_percent_ = look.levels().empty() ? -1 : 100 * (look.row() + 0.5) / plan.height_px;
}

void debug_page::add(const debug_picture &picture) {
    if (section_ != picture.section) {
        body_ += section_.empty() ? "" : "</div>\n";
        section_ = picture.section;
        body_ += "<h2>" + section_ + "</h2>\n<div class=\"pictures" +
                 (picture.has_row ? "" : " wide") + "\">\n";
    }
    const std::string line =
        picture.has_row && row_percent_ >= 0
            ? report_text_format("<div class=\"row\" style=\"top:%.3f%%\"></div>", row_percent_)
            : "";
    body_ += "<figure><div class=\"frame\"><a href=\"" + std::string(picture.file_name) +
             "\"><img src=\"" + picture.file_name + "\" alt=\"" +
             report_text_escape(picture.title) + "\"></a>" + line + "</div>" + scale_of(picture) +
             "<figcaption><b>" + report_text_escape(picture.title) + "</b> " +
             report_text_escape(picture.shows) +
             "<span>Look for: " + report_text_escape(picture.look_for) +
             "</span></figcaption></figure>\n";
}

int debug_page::write(const char *path, message *message) const {
    const std::string page =
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
        "content=\"width=device-width\"><title>" +
        title_ + "</title><style>" + style + "</style></head>\n<body><h1>" + title_ +
        "</h1><p class=\"lead\">" + lead_ + "</p>\n" + body_ + "</div>\n</body></html>\n";
    output_file file;
    output_file_open(&file, path);
    output_file_write(&file, page.data(), page.size());
    return output_file_close(&file, message);
}
