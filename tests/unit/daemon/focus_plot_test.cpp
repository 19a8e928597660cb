// SPDX-License-Identifier: Apache-2.0
// The drawing and the table of a focus curve, from synthetic curves.
#include "daemon/images/focus_plot.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <regex>
#include <string>

namespace {

/// A sweep over 300..850 with peaks at these positions, and a few samples at rest on the first.
std::unique_ptr<focus_search> searched(double first, double second = 0) {
    auto search = std::make_unique<focus_search>();
    search->options.min = 300;
    search->options.max = 850;
    search->result.verdict = second > 0 ? FOCUS_TWO_PEAKS : FOCUS_FOCUSED;
    search->result.position = first;
    search->result.blur_px = 0.4;
    search->result.peak = {first, 0.2, 6, 0.09, 0.01, 8, false};
    if (second > 0) {
        search->result.second = {second, 0.4, 6, 0.06, 0.01, 8, false};
    }
    const auto add = [&search](double position, double value, int leg) {
        focus_sample &sample = search->curve.samples[search->curve.count++];
        sample.position = static_cast<float>(position);
        std::fill_n(sample.sharpness, FOCUS_CHANNELS, static_cast<float>(value));
        sample.mean = 300;
        sample.time_ms = search->curve.count * 20u;
        sample.leg = static_cast<uint8_t>(leg);
    };
    for (double position = 850; position >= 300; position -= 2.5) {
        const auto peak = [position](double at) {
            return 1 / (1 + std::pow((position - at) / 6, 2));
        };
        add(position, 0.01 + 0.08 * peak(first) + (second > 0 ? 0.05 * peak(second) : 0),
            FOCUS_LEG_SWEEP);
    }
    add(first, 0.09, FOCUS_LEG_REST);
    add(first, 0.088, FOCUS_LEG_REST);
    return search;
}

template <typename Writer>
std::string written(Writer writer, const std::vector<focus_plot> &plots) {
    char *text = nullptr;
    size_t bytes = 0;
    std::FILE *stream = open_memstream(&text, &bytes);
    REQUIRE(stream != nullptr);
    writer(stream, plots.data(), static_cast<int>(plots.size()));
    REQUIRE(std::fclose(stream) == 0);
    const std::string result(text, bytes);
    std::free(text);
    return result;
}

size_t count_of(const std::string &text, const std::string &part) {
    size_t count = 0;
    for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
        count++;
    }
    return count;
}

}  // namespace

TEST_CASE("a drawing shows both lenses, their samples, peaks and verdicts") {
    const auto left = searched(545.25), right = searched(620, 480);
    const std::string svg =
        written(focus_plot_svg, {{"left", "zoom 850", left.get()}, {"right", "", right.get()}});
    CHECK(svg.rfind("<svg xmlns", 0) == 0);
    CHECK(svg.find("</svg>\n") == svg.size() - 7);
    CHECK(count_of(svg, "<circle ") == 2u * left->curve.count);
    CHECK(count_of(svg, "<polyline ") == 2);
    CHECK(svg.find("left lens: focused, peak at 545.2 counts") != std::string::npos);
    CHECK(svg.find("blur 0.4 px") != std::string::npos);
    CHECK(svg.find("zoom 850") != std::string::npos);
    CHECK(svg.find("right lens: two peaks") != std::string::npos);
    CHECK(svg.find(">480.0<") != std::string::npos);
    CHECK(count_of(svg, "stroke-dasharray") == 1);
    CHECK(count_of(svg, "focus ring (counts") == 2);
    CHECK(count_of(svg, ">sweep<") == 2);
    CHECK(count_of(svg, ">rest<") == 2);
    CHECK(count_of(svg, ">pass<") == 0);
    // Everything lies within the drawing, whose size it states.
    const std::regex circle("cx=\"([0-9.]+)\" cy=\"([0-9.]+)\"");
    for (std::sregex_iterator at(svg.begin(), svg.end(), circle), end; at != end; ++at) {
        CHECK(std::stod((*at)[1]) >= 80);
        CHECK(std::stod((*at)[1]) <= 780);
        CHECK(std::stod((*at)[2]) <= 600);
    }
    CHECK(svg.find("nan") == std::string::npos);
    CHECK(svg.find("inf") == std::string::npos);
    CHECK(svg.size() < 60000);
}

TEST_CASE("a sweep without a search does not claim to be focused") {
    const auto left = searched(545);
    left->options.curve_only = true;
    const std::string svg = written(focus_plot_svg, {{"left", "", left.get()}});
    CHECK(svg.find("left lens: one peak, peak at 545.0") != std::string::npos);
    CHECK(svg.find("focused") == std::string::npos);
}

TEST_CASE("an empty or dark curve is drawn as well") {
    auto dark = searched(500);
    for (focus_sample &sample : dark->curve.samples) {
        std::fill_n(sample.sharpness, FOCUS_CHANNELS, 0.0F);
    }
    dark->result = focus_result{};
    dark->result.verdict = FOCUS_NO_CONTRAST;
    dark->result.blur_px = -1;
    CHECK(written(focus_plot_svg, {{"left", "", dark.get()}}).find("no contrast") !=
          std::string::npos);
    dark->curve.count = 0;
    CHECK(written(focus_plot_svg, {{"left", "", dark.get()}}).find("nan") == std::string::npos);
    CHECK(count_of(written(focus_plot_csv, {{"left", "", dark.get()}}), "\n") == 1);
}

TEST_CASE("a table has a line for every sample") {
    const auto left = searched(545.25), right = searched(620);
    const std::string csv =
        written(focus_plot_csv, {{"left", "", left.get()}, {"right", "", right.get()}});
    CHECK(csv.rfind("lens,leg,position_counts,sharpness,", 0) == 0);
    CHECK(count_of(csv, "\n") == 1u + 2u * left->curve.count);
    CHECK(csv.find("left,rest,545.25,0.09,0,0.09,0,0.09,0,300.0,0,") != std::string::npos);
    const size_t columns = count_of(csv.substr(0, csv.find('\n')), ",");
    CHECK(count_of(csv, ",") == columns * count_of(csv, "\n"));
}
