// SPDX-License-Identifier: Apache-2.0
// Prints the words of the calibration text as a dictionary for libFuzzer.
#include <cstdio>

#include "stereo/geometry/calibration_grammar.h"

int main() {
    std::printf("\"%s\\x0a\"\n\"%s\\x0a\"\n\"%s\\x0a\"\n\"%s \"\n\"yes\"\n\"no\"\n\"%s\"\n\"%s\"\n",
                CALIBRATION_GRAMMAR_FIRST_LINE, CALIBRATION_GRAMMAR_FIRST_LINE_2,
                CALIBRATION_GRAMMAR_FIRST_LINE_3, CALIBRATION_GRAMMAR_CRC,
                CALIBRATION_GRAMMAR_UNKNOWN, CALIBRATION_GRAMMAR_NO_AXIS);
    int count;
    const calibration_field *fields = calibration_grammar_fields(&count);
    for (int i = 0; i < count; i++) {
        std::printf("\"\\x0a%s \"\n", fields[i].name);
        if (fields[i].decimals > 0) {
            std::printf("\"%lld.%0*d\"\n\"%lld.%0*d\"\n", static_cast<long long>(fields[i].min),
                        fields[i].decimals, 0, static_cast<long long>(fields[i].max),
                        fields[i].decimals, 0);
        }
    }
    return 0;
}
