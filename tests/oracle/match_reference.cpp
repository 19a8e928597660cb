// SPDX-License-Identifier: Apache-2.0
#include "match_reference.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "stereo/match/tuning.h"

namespace reference {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMassOne = 512;

// What arrives along a row or a column at some pixel.
struct Running {
    Lanes average;
    double carried;  // mass of what arrives there from the pixels before
    double mass() const { return kMassOne + carried; }
};

struct Feature {
    std::vector<bool> brighter;
    double gradient;  // Sobel's along the row, a quarter of it, around 128
};

const Grid<uint8_t> &channel_of(const View &view, int channel) {
    return channel == MATCH_GREY ? view.grey : view.channels[static_cast<size_t>(channel)];
}

// The left position of what is `dx` columns and `dy` rows from a pixel in the right image, in 1/256
// columns from the left pixel: where `a` columns on minus the disparity that these and the rows
// gain is `dx`.
double support_of(const Slopes &slopes, int dx, int dy) {
    const double down = slopes.down / 256.0;
    const double along = std::min(slopes.along / 256.0, 0.5);
    return std::floor((dx + dy * down) / (1 - along) * 256 + 0.5);
}

// Between two pixels of a row, from column x on.
int between_pixels(const View &view, const Grid<uint8_t> &channel, int x, int y, double offset_q8) {
    const double whole = std::floor(offset_q8 / 256);
    const double share = offset_q8 / 256 - whole;
    const int before = level_at(view, channel, x + static_cast<int>(whole), y);
    const int after = level_at(view, channel, x + static_cast<int>(whole) + 1, y);
    return static_cast<int>(std::floor(before * (1 - share) + after * share + 0.5));
}

Feature feature_at(const View &view, bool in_colour, int x, int y, const Slopes &slopes) {
    // By distance from the centre.
    const auto level = [&](int channel, int dx, int dy) {
        return between_pixels(view, channel_of(view, channel), x, y + dy,
                              support_of(slopes, dx, dy));
    };
    Feature feature;
    for (const match_comparison &one :
         view.smoothing > TUNE_SMOOTHING_WEAK ? match_smoothed_census : match_finest_census) {
        const int channel = in_colour ? one.channel : int{MATCH_GREY};
        feature.brighter.push_back(level(channel, one.column - 2, one.row - 2) >
                                   level(channel, one.other_column - 2, one.other_row - 2));
    }
    double slope = 0;
    for (int dy = -1; dy <= 1; dy++) {
        const int row_weight = dy == 0 ? 2 : 1;
        slope += row_weight * (level(MATCH_GREY, 1, dy) - level(MATCH_GREY, -1, dy));
    }
    feature.gradient = std::clamp(128 + std::trunc(slope / 2), 0.0, 255.0);
    return feature;
}

Grid<Feature> features_of(const View &view, bool in_colour, const Grid<Slopes> &slopes) {
    Grid<Feature> features(view.grey.width, view.grey.height);
    for (int y = 0; y < features.height; y++) {
        for (int x = 0; x < features.width; x++) {
            features.at(x, y) = feature_at(view, in_colour, x, y, slopes.at(x, y));
        }
    }
    return features;
}

double cost_between(const Feature &left, const Feature &right) {
    int differing = 0;
    for (size_t i = 0; i < left.brighter.size(); i++) {
        differing += left.brighter[i] != right.brighter[i];
    }
    return TUNE_CENSUS_WEIGHT * differing +
           std::min<double>(std::abs(left.gradient - right.gradient), TUNE_GRADIENT_MAX);
}

// Weight of the first of two masses, in 1/128; both get at least one.
double share_of(double mass, double other_mass) {
    return std::clamp(std::floor(128 * mass / (mass + other_mass)), 1.0, 127.0);
}

// Mean of two values, of which the first has weight `share`.
Lanes blend(const Lanes &a, const Lanes &b, double share) {
    Lanes mean;
    for (size_t i = 0; i < a.size(); i++) {
        mean.push_back(std::floor((a[i] * share + b[i] * (128 - share)) / 128 + 0.5));
    }
    return mean;
}

double lane_or_infinity(const Lanes &lanes, size_t i) {
    return i < lanes.size() ? lanes[i] : kInfinity;  // i - 1 of 0 is also outside
}

double lower_neighbour(const Lanes &lanes, size_t i) {
    return std::min(lane_or_infinity(lanes, i - 1), lane_or_infinity(lanes, i + 1));
}

// Lanes by which a surface rises from row or column n - 1 to n, and from there back.
int rise_to(int slope, int n) {
    return static_cast<int>(std::floor(slope * (n + 1) / 256.0) - std::floor(slope * n / 256.0));
}

int rise_back(int slope, int n) {
    return -rise_to(slope, n + 1);
}

// The lanes of a window moved up by `rise`; `low` and `high` are those beyond its ends.
Lanes sheared(const Lanes &lanes, Span window, int rise, double low, double high) {
    Lanes result(lanes.size(), kInfinity);
    for (int i = window.begin; i < window.end; i++) {
        const int from = i - rise;
        const double inside =
            from < window.begin || from >= window.end ? 0 : lanes[static_cast<size_t>(from)];
        result[static_cast<size_t>(i)] =
            from < window.begin ? low : (from >= window.end ? high : inside);
    }
    return result;
}

// The searched lanes of a pixel.
Span window_of(const Lanes &costs) {
    Span window = {0, static_cast<int>(costs.size())};
    while (std::isinf(costs[static_cast<size_t>(window.begin)])) {
        window.begin++;
    }
    while (std::isinf(costs[static_cast<size_t>(window.end - 1)])) {
        window.end--;
    }
    return window;
}

// An average as it arrives in a pixel: of the lanes searched there, moved up by `rise`. For a lane
// that it does not have, the pixel's own cost is used; beyond the window, that of its end.
Lanes arriving(const Lanes &average, const Lanes &own, int rise) {
    Lanes result;
    for (size_t i = 0; i < own.size(); i++) {
        result.push_back(std::isinf(average[i]) || std::isinf(own[i]) ? own[i] : average[i]);
    }
    const Span window = window_of(own);
    return sheared(result, window, rise, own[static_cast<size_t>(window.begin)],
                   own[static_cast<size_t>(window.end - 1)]);
}

// Each lane, or a neighbour at a price: the average along a slanted surface.
Lanes leaning(const Lanes &lanes, double price) {
    Lanes result;
    for (size_t i = 0; i < lanes.size(); i++) {
        result.push_back(std::min(lanes[i], lower_neighbour(lanes, i) + price));
    }
    return result;
}

double carry(const Running &running, double weight) {
    return std::floor(running.mass() * weight / 65536);
}

// A recursive average of the first `count` pixels after each of them: `cost(n)` are the n-th
// pixel's lanes, `weight(n)` that of the edge between n - 1 and n, `rise(n)` that of the surface
// from n - 1 to n. `price`: of leaning.
template <typename Cost, typename Weight, typename Rise>
std::vector<Running> averages_along(int count, Cost cost, Weight weight, Rise rise, double price) {
    std::vector<Running> result = {{cost(0), 0}};
    for (int n = 1; n < count; n++) {
        const Running &before = result.back();
        const double carried = carry(before, weight(n));
        const Lanes lanes = leaning(arriving(before.average, cost(n), rise(n)), price);
        result.push_back({blend(lanes, cost(n), share_of(carried, kMassOne)), carried});
    }
    return result;
}

bool is_coloured(const View &view) {
    return !view.channels.empty() && (view.channels[0].cells != view.channels[1].cells ||
                                      view.channels[0].cells != view.channels[2].cells);
}

// The edge between two pixels: the difference of grey levels, or 5/8 of the largest of a channel's.
int step_between(const View &left, int x, int y, int other_x, int other_y) {
    if (!is_coloured(left)) {
        return std::abs(grey_at(left, x, y) - grey_at(left, other_x, other_y));
    }
    int largest = 0;
    for (const Grid<uint8_t> &channel : left.channels) {
        largest = std::max(largest, std::abs(level_at(left, channel, x, y) -
                                             level_at(left, channel, other_x, other_y)));
    }
    return (TUNE_COLOUR_STEP * largest + 4) / 8;
}

double large_penalty(int step) {
    return std::max<int>(TUNE_P2 - TUNE_P2_SLOPE * step, TUNE_P2_MIN);
}

// The weight of what comes from above is a sixteenth lower.
double downward(double weight) {
    return weight - std::floor(weight / int{TUNE_DOWN_LESS});
}

// Averages of one column. Upwards each sees six to thirteen rows: up to six below the band of eight
// rows that it belongs to.
std::vector<Lanes> column_averages(const View &left, const Volume &averages,
                                   const Grid<Slopes> &slopes, int x) {
    const int height = averages.height;
    const auto rise_up = [&](int y) { return rise_back(slopes.at(x, y).down, y); };
    const std::vector<Running> down = averages_along(
        height, [&](int y) { return averages.at(x, y); },
        [&](int y) { return downward(edge_weight(step_between(left, x, y, x, y - 1))); },
        [&](int y) { return rise_to(slopes.at(x, y).down, y); }, TUNE_LEAN_DOWN);
    std::vector<Lanes> result;
    for (int y = 0; y < height; y++) {
        const Running &above = down[static_cast<size_t>(y)];
        const int last = std::min(y / 8 * 8 + 8 + 6 - 1, height - 1);
        if (y == last) {
            result.push_back(above.average);
            continue;
        }
        const Running below =
            averages_along(
                last - y, [&](int n) { return averages.at(x, last - n); },
                [&](int n) {
                    return edge_weight(step_between(left, x, last - n, x, last - n + 1));
                },
                [&](int n) { return rise_up(last - n); }, TUNE_LEAN_DOWN)
                .back();
        const double carried = carry(below, edge_weight(step_between(left, x, y + 1, x, y)));
        const double share = 128 - share_of(above.mass(), carried);
        const Lanes lanes =
            leaning(arriving(below.average, averages.at(x, y), rise_up(y)), TUNE_LEAN_DOWN);
        result.push_back(blend(lanes, above.average, share));
    }
    return result;
}

// Adds up to `max` of the known path costs along a path through `places` to the totals. `rise(at)`
// is that of the surface on the way there.
template <typename Rise>
void add_paths(const View &left, const Volume &averages, const std::vector<Place> &places,
               Rise rise, double max, Volume *totals) {
    std::vector<Lanes> costs;
    std::vector<double> large;
    std::vector<int> rises;
    for (size_t n = 0; n < places.size(); n++) {
        const Place at = places[n];
        const Place before = places[n > 0 ? n - 1 : 0];
        costs.push_back(averages.at(at.x, at.y));
        large.push_back(large_penalty(step_between(left, at.x, at.y, before.x, before.y)));
        rises.push_back(rise(at));
    }
    const std::vector<Lanes> paths = path_costs(costs, TUNE_P1, large, rises);
    for (size_t n = 0; n < places.size(); n++) {
        const Lanes path = normalised(paths[n]);
        Lanes &total = totals->at(places[n].x, places[n].y);
        for (size_t i = 0; i < path.size(); i++) {
            total[i] = std::min(total[i] + std::min(path[i], max), 255.0);
        }
    }
}

// Sums of the paths from above, from the left and from the right; the last one is not limited.
Volume path_totals(const View &left, const Volume &averages, const Grid<Slopes> &slopes,
                   int lanes) {
    const int width = averages.width;
    const int height = averages.height;
    Volume totals(width, height, Lanes(static_cast<size_t>(lanes), 0));
    for (int x = 0; x < width; x++) {
        std::vector<Place> downwards;
        for (int y = 0; y < height; y++) {
            downwards.push_back({x, y});
        }
        const auto rise = [&](Place at) { return rise_to(slopes.at(at.x, at.y).down, at.y); };
        add_paths(left, averages, downwards, rise, 127, &totals);
    }
    for (int y = 0; y < height; y++) {
        std::vector<Place> to_the_right;
        for (int x = 0; x < width; x++) {
            to_the_right.push_back({x, y});
        }
        const auto rise = [&](Place at) { return rise_to(slopes.at(at.x, at.y).along, at.x); };
        add_paths(left, averages, to_the_right, rise, 127, &totals);
        const std::vector<Place> to_the_left(to_the_right.rbegin(), to_the_right.rend());
        const auto fall = [&](Place at) { return rise_back(slopes.at(at.x, at.y).along, at.x); };
        add_paths(left, averages, to_the_left, fall, kInfinity, &totals);
    }
    return totals;
}

}  // namespace

int level_at(const View &view, const Grid<uint8_t> &image, int x, int y) {
    const int row = std::clamp(y, 0, image.height - 1);
    const Span span = view.spans[static_cast<size_t>(row)];
    return span.begin < span.end ? image.at(std::clamp(x, span.begin, span.end - 1), row) : 0;
}

int grey_at(const View &view, int x, int y) {
    return level_at(view, view.grey, x, y);
}

std::vector<Lanes> path_costs(const std::vector<Lanes> &costs, double small,
                              const std::vector<double> &large, const std::vector<int> &rise) {
    std::vector<Lanes> paths = {costs[0]};
    for (size_t n = 1; n < costs.size(); n++) {
        const Lanes &before = paths.back();
        const double lowest = *std::min_element(before.begin(), before.end());
        Lanes shared, path;
        for (size_t i = 0; i < before.size(); i++) {
            shared.push_back(std::isinf(costs[n][i]) ? kInfinity : before[i]);
        }
        shared = sheared(shared, window_of(costs[n]), rise[n], kInfinity, kInfinity);
        for (size_t i = 0; i < before.size(); i++) {
            const double way =
                std::min({shared[i], lower_neighbour(shared, i) + small, lowest + large[n]});
            path.push_back(costs[n][i] + way - lowest);
        }
        paths.push_back(path);
    }
    return paths;
}

Lanes normalised(Lanes lanes) {
    const double lowest = *std::min_element(lanes.begin(), lanes.end());
    for (double &lane : lanes) {
        lane -= lowest;
    }
    return lanes;
}

double edge_weight(int step) {
    // 0.9 (1 - step / 112)^8, rounded down at each step: three squarings, then the factor.
    const double unit = std::floor(65535.0 / int{TUNE_EDGE_STEP});
    double weight = unit * (TUNE_EDGE_STEP - std::min<int>(step, TUNE_EDGE_STEP));
    for (int i = 0; i < 3; i++) {
        weight = std::floor(weight * weight / 65536);
    }
    return std::floor(weight * int{TUNE_EDGE_WEIGHT} / 65536);
}

// Right pixels outside the image have the features of its ends.
Volume costs_of(const View &left, const View &right, const Search &search,
                const Grid<Slopes> &slopes) {
    const int width = left.grey.width;
    const bool in_colour = is_coloured(left) && is_coloured(right);
    const Grid<Feature> left_features = features_of(left, in_colour, slopes);
    const Grid<Feature> right_features =
        features_of(right, in_colour, {width, right.grey.height, {0, 0}});
    Volume costs(width, left.grey.height);
    for (int y = 0; y < costs.height; y++) {
        for (int x = 0; x < width; x++) {
            for (int lane = 0; lane < search.lanes(); lane++) {
                const int right_x = std::clamp(x - search.disparity_min - lane, 0, width - 1);
                costs.at(x, y).push_back(
                    cost_between(left_features.at(x, y), right_features.at(right_x, y)));
            }
        }
    }
    return costs;
}

Volume windowed(const Volume &all, const Grid<Span> &windows) {
    Volume result = all;
    for (int y = 0; y < all.height; y++) {
        for (int x = 0; x < all.width; x++) {
            const Span window = windows.at(x, y);
            Lanes &lanes = result.at(x, y);
            std::fill(lanes.begin(), lanes.begin() + window.begin, kInfinity);
            std::fill(lanes.begin() + window.end, lanes.end(), kInfinity);
        }
    }
    return result;
}

Volume row_averages(const View &left, const Volume &costs, const Grid<Slopes> &slopes) {
    const int width = costs.width;
    Volume result(width, costs.height);
    for (int y = 0; y < costs.height; y++) {
        const auto weight = [&](int x) { return edge_weight(step_between(left, x, y, x - 1, y)); };
        const std::vector<Running> from_left = averages_along(
            width, [&](int x) { return costs.at(x, y); }, weight,
            [&](int x) { return rise_to(slopes.at(x, y).along, x); }, TUNE_LEAN_ALONG);
        const auto fall = [&](int x) { return rise_back(slopes.at(x, y).along, x); };
        const std::vector<Running> from_right = averages_along(
            width, [&](int n) { return costs.at(width - 1 - n, y); },
            [&](int n) { return weight(width - n); }, [&](int n) { return fall(width - 1 - n); },
            TUNE_LEAN_ALONG);
        for (int x = 0; x < width; x++) {
            const Running &before = from_left[static_cast<size_t>(x)];
            result.at(x, y) = before.average;
            if (x + 1 < width) {
                const Running &after = from_right[static_cast<size_t>(width - 2 - x)];
                const Lanes lanes =
                    leaning(arriving(after.average, costs.at(x, y), fall(x)), TUNE_LEAN_ALONG);
                const double share = share_of(before.mass(), carry(after, weight(x + 1)));
                result.at(x, y) = blend(before.average, lanes, share);
            }
        }
    }
    return result;
}

Sums sum_up(const View &left, const Search &search, const Volume &row_averages,
            const Grid<Slopes> &slopes) {
    const int width = row_averages.width;
    const int height = row_averages.height;
    Volume averages(width, height);
    for (int x = 0; x < width; x++) {
        const std::vector<Lanes> column = column_averages(left, row_averages, slopes, x);
        for (int y = 0; y < height; y++) {
            averages.at(x, y) = column[static_cast<size_t>(y)];
        }
    }
    return {averages, path_totals(left, averages, slopes, search.lanes())};
}

}  // namespace reference
