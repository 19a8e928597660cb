// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "core/error.h"
#include "stereo/geometry/calibration_grammar.h"
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
    int count;
    const calibration_field *fields = calibration_grammar_fields(&count);
    for (int i = 0; i < count; i++) {
        if (code == ERROR_RANGE && *fault.reason == '\0' && field == fields[i].name) {
            text += ", which is " + std::to_string(fields[i].min) + ".." +
                    std::to_string(fields[i].max) + (*fields[i].unit != '\0' ? " " : "") +
                    fields[i].unit;
        }
    }
    return text;
}
