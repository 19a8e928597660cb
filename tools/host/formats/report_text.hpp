// SPDX-License-Identifier: Apache-2.0
/// Text and numbers of the page.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_REPORT_TEXT_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_REPORT_TEXT_HPP

#include <cstddef>
#include <map>
#include <string>

/// printf into a string.
std::string report_text_format(const char *format, ...) __attribute__((format(printf, 1, 2)));

/// Escaped for an element and for a quoted attribute; bytes that are not UTF-8 (file names may
/// contain any) become U+FFFD.
std::string report_text_escape(const std::string &text);

/// A quoted JSON string that is also safe inside a <script> element.
std::string report_text_json(const std::string &text);

/// 1 234 567 with thin spaces.
std::string report_text_count(std::size_t count);

/// A length in mm with its unit, m from 10 m up; `unit` if it is not a real millimetre.
std::string report_text_length(double length_mm, const char *unit);

/// "12.3 MB" (10^6 bytes).
std::string report_text_bytes(std::size_t bytes);

/// The last part of a path.
std::string report_text_file_name(const std::string &path);

/// `page` with each {{name}} replaced by `parts[name]`. Every name must exist.
std::string report_text_fill(const std::string &page,
                             const std::map<std::string, std::string> &parts);

/// Numbers as text.

/// At most `digits` significant digits; integers up to 1e15 in full.
std::string number_text(double value, int digits);

/// "1792.3 +- 1.2": two significant digits of the deviation, and the value to the same place.
std::string number_text_with_sigma(double value, double sigma);

/// The field of view of an image without distortion: of its row or column through the principal
/// point at `centre_px`.
double report_field_deg(double centre_px, double size_px, double f_px);

#endif
