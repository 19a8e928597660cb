// SPDX-License-Identifier: Apache-2.0
// Prints the words of the calibration text as a dictionary for libFuzzer.
#include <cstdio>

#include "stereo/geometry/calibration_grammar.h"

int main() {
    for (int version = 1; version <= CALIBRATION_GRAMMAR_VERSIONS; version++) {
        std::printf("\"%s%d\\x0a\"\n", CALIBRATION_GRAMMAR_MAGIC, version);
    }
    for (int kind = 0; kind < LENS_KINDS; kind++) {
        std::printf("\"%s\"\n", lens_kind_name(static_cast<lens_kind>(kind)));
    }
    std::printf("\"%s \"\n\"yes\"\n\"no\"\n\"%s\"\n\"%s\"\n", KEYED_LINE_CRC, KEYED_LINE_UNKNOWN,
                CALIBRATION_GRAMMAR_NO_AXIS);
    const keyed_field *fields = calibration_grammar.fields;
    for (int i = 0; i < calibration_grammar.count; i++) {
        std::printf("\"\\x0a%s \"\n", fields[i].name);
        if (fields[i].decimals > 0) {
            std::printf("\"%lld.%0*d\"\n\"%lld.%0*d\"\n", static_cast<long long>(fields[i].min),
                        fields[i].decimals, 0, static_cast<long long>(fields[i].max),
                        fields[i].decimals, 0);
        }
    }
    return 0;
}
