// SPDX-License-Identifier: Apache-2.0
// Brightness and saturation of a picture against direct sums over its pixels.
#include "focus/exposure_measure.h"

#include <doctest/doctest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

TEST_CASE("brightness is measured in all layouts and depths") {
    struct Form {
        raw_layout layout;
        int bits, values, first_green, step;
    };
    for (const Form form : {Form{RAW_GREY, 8, 1, 0, 1}, Form{RAW_RGB, 8, 3, 1, 3},
                            Form{RAW_BAYER_GRBG, 10, 1, 0, 2}, Form{RAW_GREY, 16, 1, 0, 1}}) {
        INFO("bits " << form.bits << " layout " << form.layout);
        const int full = (1 << form.bits) - 1, black = full / 20, width = 2000;
        const auto part_of = [&](double value) { return (value - black) / (full - black); };
        std::vector<uint16_t> row(size_t(width) * size_t(form.values), uint16_t(full / 10));
        const size_t count = row.size();
        double sum = 0;
        int greens = 0;
        for (size_t i = size_t(form.first_green); i < count; i += size_t(form.step), greens++) {
            // 0.5 % white, 2 % bright, the others dark.
            row[i] = uint16_t(i < count / 200 * size_t(form.step)  ? full
                              : i < count / 40 * size_t(form.step) ? full / 2
                                                                   : full / 8);
            sum += row[i];
        }
        exposure_histogram histogram;
        exposure_histogram_begin(&histogram, form.layout, form.bits, uint16_t(black));
        exposure_histogram_row(&histogram, row.data(), width, 0);
        const exposure_measure measure = exposure_histogram_end(&histogram);
        CHECK(measure.mean == doctest::Approx(part_of(sum / greens)).epsilon(1e-9));
        CHECK(measure.saturated == doctest::Approx(0.005));
        CHECK(measure.high == doctest::Approx(1).epsilon(0.002));
        CHECK(measure.white == doctest::Approx(part_of(full / 2)).epsilon(0.002));
        CHECK(measure.excess > 1);
    }
}
