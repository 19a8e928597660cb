// SPDX-License-Identifier: Apache-2.0
/// What `vergence info` reports about one file: rows for text and JSON output.
#ifndef VERGENCE_TOOLS_HOST_INFO_INFO_HPP
#define VERGENCE_TOOLS_HOST_INFO_INFO_HPP

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/host/convert/calibration_file.hpp"

struct info_row {
    std::string key, label, text;
    nlohmann::ordered_json value;
};

struct info_page {
    std::string path, kind;  // e.g. "calibration (OpenCV)"
    std::vector<info_row> rows;
    std::string mismatch;  // first pair that does not match the session's calibration; "": none

    void add(const std::string &key, const std::string &label, const std::string &text,
             const nlohmann::ordered_json &value) {
        rows.push_back({key, label, text, value});
    }
    /// A number with at most `digits` significant digits and its unit ("" for none).
    void add_number(const std::string &key, const std::string &label, double value, int digits,
                    const std::string &unit);
};

/// The first bytes of a file, enough to identify its kind.
std::string info_head(const std::string &path);

/// Makes one operand of two neighbours that are the files of one calibration.
void info_join_pairs(const import_options &options, std::vector<std::string> *operands);

/// The files that an operand stands for: those in a result directory, or itself.
std::vector<std::string> info_expand(const std::string &path);

/// Explains a loaded calibration.
info_page info_calibration(const std::string &path, const calibration &value,
                           const calibration_file_report &report);

/// Pages of result files. Each returns false, with one line in `message` that names the file, when
/// the file is damaged.
bool info_result(const std::string &path, info_page *page, std::string *message);  // result.json
bool info_map(const std::string &path, info_page *page, std::string *message);     // PFM
bool info_image(const std::string &path, info_page *page, std::string *message);   // PNG, PGM, PPM
bool info_ply(const std::string &path, info_page *page, std::string *message);
bool info_pcd(const std::string &path, info_page *page, std::string *message);
bool info_glb(const std::string &path, info_page *page, std::string *message);

/// Whether a text is a place X,Y in a result's maps.
bool info_is_point(const std::string &text, double at_px[2]);
/// Replaces the rows of a reconstruction (`path`: its result.json) by what is known of a pixel of
/// its maps: where it is in both raw images. False as above.
bool info_point(const std::string &path, const double at_px[2], info_page *page,
                std::string *message);

/// Places in a result's maps, in px; NULL: not asked for.
struct info_places {
    const double *depth;     // x, y
    const double *distance;  // x, y, x, y
    const double *plane;     // x, y, width, height
};
/// Likewise by lengths there, from the points.pcd beside it.
bool info_lengths(const std::string &path, const info_places &places, info_page *page,
                  std::string *message);

/// The same for a recorded session, which is a directory.
bool info_session(const std::string &path, info_page *page, std::string *message);

/// Minimum and maximum of each coordinate, for points that arrive one by one.
struct info_bounds {
    std::uint64_t count = 0;
    double min[3] = {}, greatest[3] = {};

    void take(const double point[3]);
    /// Adds rows for the extent in x, y and z; nothing without points.
    void add_to(info_page *page, const std::string &unit) const;
};

#endif
