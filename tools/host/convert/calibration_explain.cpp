// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "core/error.h"
#include "stereo/geometry/calibration_grammar.h"
#include "stereo/zoom/zoom_grammar.h"
#include "tools/host/convert/calibration_file.hpp"

std::string calibration_file_explain(int code, const calibration_fault &fault) {
    std::string text;
    if (fault.line > 0) {
        text += "line " + std::to_string(fault.line);
    }
    const std::string field = fault.field;
    if (!field.empty()) {
        text += (text.empty() ? "" : ", ") + field;
    }
    text += text.empty() ? "" : ": ";
    if (code == ERROR_CRC) {
        char digits[16];
        std::snprintf(digits, sizeof digits, "%08x", fault.crc);
        return text + error_text(code) + ", which give " + digits;
    }
    text += *fault.reason != '\0' ? fault.reason : error_text(code);
    for (const keyed_table *table : {&calibration_grammar, &zoom_grammar}) {
        const int line = keyed_text_line(table, fault.field);
        if (code == ERROR_RANGE && *fault.reason == '\0' && line > 0) {
            const keyed_field &known = table->fields[line - 2];
            return text + ", which is " + std::to_string(known.min) + ".." +
                   std::to_string(known.max) + (*known.unit != '\0' ? " " : "") + known.unit;
        }
    }
    return text;
}
