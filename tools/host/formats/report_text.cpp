// SPDX-License-Identifier: Apache-2.0
#include "tools/host/formats/report_text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "core/invariant.h"
#include "core/math.h"

namespace {

std::size_t sequence_length(unsigned first) {
    if (first >= 0xC2 && first <= 0xDF) {
        return 2;
    }
    if (first >= 0xE0 && first <= 0xEF) {
        return 3;
    }
    return first >= 0xF0 && first <= 0xF4 ? 4 : 0;
}

int decimals_of(double size) {
    if (size >= 1000) {
        return 0;
    }
    if (size >= 100) {
        return 1;
    }
    return size >= 1 ? 2 : 3;
}

/// Length in bytes of the well-formed UTF-8 character at text[at], 0 when it is not one.
std::size_t utf8_length(const std::string &text, std::size_t at) {
    const unsigned first = static_cast<unsigned char>(text[at]);
    if (first < 0x80) {
        return 1;
    }
    const std::size_t length = sequence_length(first);
    if (length == 0 || at + length > text.size()) {
        return 0;
    }
    for (std::size_t i = 1; i < length; i++) {
        if ((static_cast<unsigned char>(text[at + i]) & 0xC0U) != 0x80U) {
            return 0;
        }
    }
    return length;
}

/// Copies `text` character by character; `replace` returns another text for some ASCII ones.
std::string rewrite(const std::string &text, std::string (*replace)(char c)) {
    std::string result;
    for (std::size_t i = 0; i < text.size();) {
        const std::size_t length = utf8_length(text, i);
        if (length == 0) {
            result += "\xEF\xBF\xBD";
            i++;
            continue;
        }
        result += length == 1 ? replace(text[i]) : text.substr(i, length);
        i += length;
    }
    return result;
}

std::string html_character(char c) {
    switch (c) {
        case '&':
            return "&amp;";
        case '<':
            return "&lt;";
        case '>':
            return "&gt;";
        case '"':
            return "&quot;";
        case '\'':
            return "&#39;";
        default:
            return static_cast<unsigned char>(c) < 0x20 ? std::string(" ") : std::string(1, c);
    }
}

std::string json_character(char c) {
    if (c == '"' || c == '\\') {
        return std::string("\\") + c;
    }
    if (static_cast<unsigned char>(c) < 0x20 || c == '<' || c == '>' || c == '&') {
        return report_text_format("\\u%04x", static_cast<unsigned>(static_cast<unsigned char>(c)));
    }
    return std::string(1, c);
}

}  // namespace

std::string report_text_format(const char *format, ...) {
    va_list arguments, again;
    va_start(arguments, format);
    va_copy(again, arguments);
    const int length = std::vsnprintf(nullptr, 0, format, arguments);
    va_end(arguments);
    INVARIANT(length >= 0);
    std::vector<char> text(static_cast<std::size_t>(length) + 1);
    std::vsnprintf(text.data(), text.size(), format, again);
    va_end(again);
    return std::string(text.data(), static_cast<std::size_t>(length));
}

std::string report_text_escape(const std::string &text) {
    return rewrite(text, html_character);
}

std::string report_text_json(const std::string &text) {
    return "\"" + rewrite(text, json_character) + "\"";
}

std::string report_text_count(std::size_t count) {
    const std::string digits = std::to_string(count);
    std::string text;
    for (std::size_t i = 0; i < digits.size(); i++) {
        if (i > 0 && (digits.size() - i) % 3 == 0) {
            text += "\xE2\x80\xAF";  // narrow no-break space
        }
        text += digits[i];
    }
    return text;
}

std::string report_text_length(double length_mm, const char *unit) {
    const double size = std::fabs(length_mm);
    if (std::strcmp(unit, "mm") == 0 && size >= 10000) {
        return report_text_format("%.*f m", size >= 100000 ? 1 : 2, length_mm / 1000);
    }
    return report_text_format("%.*f %s", decimals_of(size), length_mm, unit);
}

std::string report_text_bytes(std::size_t bytes) {
    return report_text_format("%.1f MB", static_cast<double>(bytes) / 1e6);
}

std::string report_text_file_name(const std::string &path) {
    const std::size_t end = path.find_last_not_of('/');
    const std::size_t slash = path.find_last_of('/', end);
    return path.substr(slash == std::string::npos ? 0 : slash + 1,
                       end == std::string::npos ? end : end - (slash + 1) + 1);
}

std::string report_text_fill(const std::string &page,
                             const std::map<std::string, std::string> &parts) {
    std::string result;
    std::size_t at = 0;
    for (;;) {
        const std::size_t open = page.find("{{", at);
        const std::size_t close =
            open == std::string::npos ? std::string::npos : page.find("}}", open);
        if (close == std::string::npos) {
            return result + page.substr(at);
        }
        const auto part = parts.find(page.substr(open + 2, close - open - 2));
        INVARIANT(part != parts.end());
        result += page.substr(at, open - at) + part->second;
        at = close + 2;
    }
}

std::string number_text(double value, int digits) {
    char text[64];
    const bool large = std::abs(value) >= std::pow(10.0, digits) && std::abs(value) < 1e15;
    const auto end =
        large ? std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, 0)
              : std::to_chars(text, text + sizeof text, value, std::chars_format::general, digits);
    return std::string(text, end.ptr);
}

std::string number_text_with_sigma(double value, double sigma) {
    if (!(sigma > 0) || !std::isfinite(sigma) || !std::isfinite(value)) {
        return number_text(value, 7) + " +- " + number_text(sigma, 2);
    }
    constexpr int decimals_max = 9;
    const std::string rounded = report_text_format("%.1e", sigma);
    const int place = std::atoi(rounded.c_str() + rounded.find('e') + 1) - 1;  // of the last digit
    const int decimals = std::clamp(-place, 0, decimals_max);
    const double step = std::pow(10.0, place);
    // Zero has no sign.
    return report_text_format("%.*f +- %.*f", decimals, step * std::round(value / step) + 0.0,
                              decimals, step * std::round(sigma / step));
}

double report_field_deg(double centre_px, double size_px, double f_px) {
    return MATH_DEGREE_PER_RAD *
           (std::atan((centre_px + 0.5) / f_px) + std::atan((size_px - 0.5 - centre_px) / f_px));
}
