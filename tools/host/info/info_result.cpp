// SPDX-License-Identifier: Apache-2.0
/// result.json and calibration.json for the user. Missing members (written by an older or newer
/// version) are omitted.
#include <fstream>

#include "tools/host/formats/json_limited.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/info/info.hpp"

namespace {

using json = nlohmann::ordered_json;

const int depth_max = 16;  // our own results have a depth of at most 3

/// The value at a path such as "plan/f_px", or null.
json find(const json &document, const std::string &path) {
    return document.value(json::json_pointer("/" + path), json());
}

std::string text_of(const json &value, int digits) {
    if (value.is_string()) {
        return value.get<std::string>();
    }
    if (value.is_number_float()) {
        return number_text(value.get<double>(), digits);
    }
    if (value.is_array()) {
        std::string text;
        for (const json &item : value) {
            text += (text.empty() ? "" : " ") + text_of(item, digits);
        }
        return text;
    }
    return value.dump();
}

struct line {
    const char *label;
    // Literal text with members inserted: "{plan/f_px}" is replaced by the member's value, "{a +-
    // b}" by a value and its deviation.
    const char *pattern;
};

/// Text of a member, or of one and its deviation; "": missing.
std::string member_text(const json &document, const std::string &name) {
    static const std::string between = " +- ";
    const size_t at = name.find(between);
    const json value = find(document, name.substr(0, at));
    if (at == std::string::npos) {
        return value.is_null() ? "" : text_of(value, 6);
    }
    const json sigma = find(document, name.substr(at + between.size()));
    return value.is_number() && sigma.is_number()
               ? number_text_with_sigma(value.get<double>(), sigma.get<double>())
               : "";
}

/// Fills a pattern; "" when a member is missing.
std::string fill(const json &document, const std::string &pattern) {
    std::string text;
    for (size_t at = 0; at < pattern.size();) {
        const size_t open = std::min(pattern.find('{', at), pattern.size());
        text += pattern.substr(at, open - at);
        if (open == pattern.size()) {
            break;
        }
        const size_t close = pattern.find('}', open);
        const std::string inserted =
            member_text(document, pattern.substr(open + 1, close - open - 1));
        if (inserted.empty()) {
            return "";
        }
        text += inserted;
        at = close + 1;
    }
    return text;
}

const line lines_of_calibration[] = {
    {"made by", "vergence {version}"},
    {"verdict", "{verdict/sentence}"},
    {"board", "{board/corners} corners, squares of {board/square_mm} mm"},
    {"pictures", "{pictures}, a board in {pictures_with_board}"},
    {"left", "f {left/focal_px +- left/focal_sigma_px} px, centre {left/centre_px} px"},
    {"right", "f {right/focal_px +- right/focal_sigma_px} px, centre {right/centre_px} px"},
    {"camera", "f {camera/focal_px +- camera/focal_sigma_px} px, centre {camera/centre_px} px"},
    {"lens model", "{model/lens}"},
    {"baseline", "{rig/baseline_mm +- rig/baseline_sigma_mm} mm"},
    {"fit", "{fit/rms_px} px rms per point"},
    {"rows", "{rig/rows_rms_px} px rms apart after rectification"},
};

const line lines_of_reconstruction[] = {
    {"made by", "vergence {version}, build {build_id}"},
    {"left", "{input/left}"},
    {"right", "{input/right}"},
    {"images", "{input/width_px} x {input/height_px} px, {input/bits} bit {input/layout}"},
    {"capture", "{capture/session} pair {capture/pair}, skew {capture/skew_us} us"},
    {"calibration", "{calibration/id} ({calibration/format}), crc32 {calibration/crc32}"},
    {"rectified",
     "{plan/width_px} x {plan/height_px} px, focal length {plan/f_px} px, "
     "baseline {plan/baseline_mm} mm"},
    {"searched", "{plan/disparity_count} disparities from {plan/disparity_min} px on"},
    {"", "depths from {plan/depth_near_mm} mm to {plan/depth_far_mm} mm"},
    {"measured", "{density_percent} % of {counts/pixels} pixels"},
    {"surface", "{counts/vertices} points, {counts/triangles} triangles"},
    {"extent", "from {bounds_mm/min} mm"},
    {"", "to {bounds_mm/max} mm (x y z)"},
    {"depth", "common sigma {depth_sigma_common_mm} mm at the median: all depths together"},
    {"cameras",
     "{self_calibration/health}: corrected by {self_calibration/used} points, rows "
     "{self_calibration/rows_px} px, depth {self_calibration/depth_sigma_mm} mm"},
    {"vertical",
     "median {vertical_disparity/median_px} px, p95 {vertical_disparity/p95_px} px "
     "(health of the calibration)"},
    {"time", "{time_ms/total} ms, {options/threads} threads"},
    {"memory", "{memory_bytes/process_peak} bytes"},
};

template <size_t count>
void add_lines(const line (&lines)[count], const json &document, info_page *page) {
    for (const line &line : lines) {
        const std::string text = fill(document, line.pattern);
        if (!text.empty()) {
            page->add("", line.label, text, nullptr);
        }
    }
}

void add_reconstruction(const json &document, info_page *page) {
    add_lines(lines_of_reconstruction, document, page);
    const json reasons = find(document, "reasons");
    if (reasons.is_object()) {
        bool first = true;
        for (const auto &reason : reasons.items()) {
            page->add("", first ? "pixels" : "", reason.key() + " " + text_of(reason.value(), 6),
                      nullptr);
            first = false;
        }
    }
    if (find(document, "metric") == false) {
        page->add("", "not metric", "the geometry is assumed: lengths are not in millimetres",
                  nullptr);
    }
    const json warnings = find(document, "warnings");
    if (warnings.is_array()) {
        for (const json &warning : warnings) {
            page->add("", "warning", text_of(warning, 6), nullptr);
        }
    }
}

}  // namespace

bool info_result(const std::string &path, info_page *page, std::string *message) {
    std::ifstream stream(path, std::ios::binary);
    bool too_deep;
    const json document = json_limited(stream, depth_max, &too_deep);
    if (too_deep || document.is_discarded() || !document.is_object() ||
        find(document, "program") != "vergence") {
        *message = path + ": not a result of vergence, or damaged";
        return false;
    }
    const bool calibration = find(document, "kind") == "calibration";
    if (calibration) {
        page->kind = find(document, "camera").is_null() ? "figures of a calibration"
                                                        : "figures of one camera's calibration";
        add_lines(lines_of_calibration, document, page);
    } else {
        page->kind = "result of a reconstruction";
        add_reconstruction(document, page);
    }
    page->add("result", "", "", document);
    return true;
}
