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
#include "tools/host/page/page.hpp"

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

std::string scale_of(const debug_picture &picture) {
    return picture.keys.empty() ? page_scale(page_gradient(picture.palette, picture.last_index),
                                             {{0, report_text_escape(picture.low)},
                                              {1, report_text_escape(picture.high)}})
                                : page_keys(picture.keys);
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
            : report_text_format("Levels: %zu. The red line is row %d, which is examined below.",
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
        body_ += section_.empty() ? "" : "</div></section>\n";
        section_ = picture.section;
        body_ += "<section><h2>" + section_ + "</h2>\n<div class=\"grid" +
                 (picture.has_row ? " two" : "") + "\">\n";
    }
    const std::string line =
        picture.has_row && row_percent_ >= 0
            ? report_text_format("<div class=\"row\" style=\"top:%.3f%%\"></div>", row_percent_)
            : "";
    body_ += page_figure(
        "<div class=\"frame map\"><a href=\"" + std::string(picture.file_name) + "\"><img src=\"" +
            picture.file_name + "\" alt=\"" + report_text_escape(picture.title) + "\"></a>" + line +
            "</div>",
        "<b>" + report_text_escape(picture.title) + "</b> " + report_text_escape(picture.shows) +
            "<br>Look for: " + report_text_escape(picture.look_for) + scale_of(picture));
}

int debug_page::write(const char *path, message *message) const {
    page_parts parts;
    parts.title = title_;
    parts.meta = page_meta(lead_);
    parts.body = body_ + "</div></section>\n";
    parts.footer = "vergence reconstruct --debug";
    parts.style =
        ".frame .row { position: absolute; left: 0; right: 0; border-top: 1px solid #ff3b30; }\n";
    parts.pictures_beside = true;
    const std::string page = page_make(parts);
    output_file file;
    output_file_open(&file, path);
    output_file_write(&file, page.data(), page.size());
    return output_file_close(&file, message);
}
