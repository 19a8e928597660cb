// SPDX-License-Identifier: Apache-2.0
// Painted decoration: brush-like motifs at blue-noise positions, all different.
#include <algorithm>
#include <cmath>

#include "tools/simrig/scene/raster.hpp"
#include "tools/simrig/world/random.hpp"

namespace world {
namespace {

constexpr double kSoftMm = 0.16;

Colour varied(const Colour &c, Random &random, double part) {
    const double all = 1 + part * random.uniform(-1, 1);
    return {{c.channel[0] * all * (1 + 0.5 * part * random.uniform(-1, 1)),
             c.channel[1] * all * (1 + 0.5 * part * random.uniform(-1, 1)),
             c.channel[2] * all * (1 + 0.5 * part * random.uniform(-1, 1))}};
}

// Places in a strip that keep a distance from each other (dart throwing; wraps around).
std::vector<Vec2> blue_noise(Random &random, double width, double low, double high, double distance,
                             int tries) {
    std::vector<Vec2> places;
    for (int i = 0; i < tries; i++) {
        const Vec2 p = {random.uniform(0, width), random.uniform(low, high)};
        const bool free = std::none_of(places.begin(), places.end(), [&](Vec2 q) {
            double dx = std::fabs(p.x - q.x);
            dx = std::min(dx, width - dx);
            return std::hypot(dx, p.y - q.y) < distance;
        });
        if (free) {
            places.push_back(p);
        }
    }
    return places;
}

void dot_at(Raster &raster, Vec2 at, double radius, const Colour &colour, double strength = 1) {
    const double r = radius + 1;
    raster.paint({at.x - r, at.y - r, at.x + r, at.y + r}, colour, kSoftMm, strength,
                 [=](double x, double y) { return radius - std::hypot(x - at.x, y - at.y); });
}

// A leaf from its stalk: two arcs that meet in points, with a vein and a darker half.
void leaf(Raster &raster, Random &random, Vec2 at, double size, double turn, const Colour &colour) {
    const double c = std::cos(turn);
    const double s = std::sin(turn);
    const double wide = size * random.uniform(0.22, 0.34);
    const double bow = random.uniform(-0.25, 0.25);
    const auto shape = [=](double x, double y, double &u, double &v) {
        const double dx = x - at.x;
        const double dy = y - at.y;
        u = (dx * c + dy * s) / size;
        v = dy * c - dx * s - bow * size * u * (1 - u);
        // Far outside of every edge below, however soft, a rough distance will do.
        const double bound = 1.1 * wide - std::fabs(v);
        if (bound < -0.5) {
            return bound;
        }
        return wide * 2 * std::sqrt(std::max(u * (1 - u), 0.0)) * (1.1 - 0.5 * u) - std::fabs(v) -
               (u < 0   ? -u * size
                : u > 1 ? (u - 1) * size
                        : 0);
    };
    const double reach = wide * 1.2 + 0.08 * size + 0.5;
    const double box[4] = {
        at.x + std::min(0.0, c * size) - reach, at.y + std::min(0.0, s * size) - reach,
        at.x + std::max(0.0, c * size) + reach, at.y + std::max(0.0, s * size) + reach};
    raster.paint(box, colour, kSoftMm, 0.95, [&](double x, double y) {
        double u = 0;
        double v = 0;
        return shape(x, y, u, v);
    });
    const Colour dark = {
        {colour.channel[0] * 0.5, colour.channel[1] * 0.55, colour.channel[2] * 0.5}};
    raster.paint(box, dark, 0.8, 0.55, [&](double x, double y) {
        double u = 0;
        double v = 0;
        const double inside = shape(x, y, u, v);
        return std::min(inside, v);
    });
    raster.paint(box, {{0.75, 0.78, 0.55}}, kSoftMm, 0.7, [&](double x, double y) {
        double u = 0;
        double v = 0;
        const double inside = shape(x, y, u, v);
        return std::min(inside - 0.3, 0.16 + 0.1 * (1 - u) - std::fabs(v));
    });
}

// Petals around a heart, each with its own length; strokes run out from the middle.
void flower(Raster &raster, Random &random, Vec2 at, double radius, const Colour &colour,
            const Colour &heart) {
    const int petals = 5 + static_cast<int>(random.uniform(0, 4));
    const double turn = random.uniform(0, 2 * kPi);
    double lengths[8];
    for (double &v : lengths) {
        v = random.uniform(0.82, 1.08);
    }
    const double rim = radius * random.uniform(0.55, 0.7);
    const double box[4] = {at.x - 1.2 * radius, at.y - 1.2 * radius, at.x + 1.2 * radius,
                           at.y + 1.2 * radius};
    const auto edge = [&](double x, double y, double &part) {
        const double dx = x - at.x;
        const double dy = y - at.y;
        const double r = std::hypot(dx, dy);
        const double bound = 1.08 * radius - r;
        if (bound < -kSoftMm) {
            return bound;
        }
        double a = (std::atan2(dy, dx) + turn) * petals / (2 * kPi);
        a -= std::floor(a / petals) * petals;
        const int n = static_cast<int>(a) % petals;
        part = a - std::floor(a) - 0.5;
        const double round = std::sqrt(std::max(1 - 4 * part * part * 0.96, 0.0));
        return rim + (radius * lengths[n] - rim) * round - r;
    };
    double part = 0;
    raster.paint(box, colour, kSoftMm, 0.95, [&](double x, double y) { return edge(x, y, part); });
    const Colour deep = {
        {colour.channel[0] * 0.72, colour.channel[1] * 0.5, colour.channel[2] * 0.6}};
    raster.paint(box, deep, radius * 0.5, 0.8, [&](double x, double y) {
        const double within = rim * 0.75 - std::hypot(x - at.x, y - at.y);
        return within < -0.25 * radius ? within : std::min(edge(x, y, part), within);
    });
    raster.paint(box, deep, kSoftMm, 0.5, [&](double x, double y) {
        const double inside = edge(x, y, part);
        const double stroke =
            std::min({std::fabs(part), std::fabs(part - 0.22), std::fabs(part + 0.22)});
        const double r = std::hypot(x - at.x, y - at.y);
        return std::min(
            {inside - 0.12 * radius, 0.13 - stroke * r * 2 * kPi / petals, r - 0.2 * radius});
    });
    dot_at(raster, at, 0.27 * radius, heart);
    for (int i = 0; i < 14; i++) {
        const double a = random.uniform(0, 2 * kPi);
        const double r = radius * 0.24 * std::sqrt(random.uniform());
        dot_at(raster, {at.x + r * std::cos(a), at.y + r * std::sin(a)},
               radius * random.uniform(0.02, 0.045), {{0.30, 0.13, 0.03}}, 0.8);
    }
}

// A line that wanders: sum of three waves around a height, whole numbers of periods around.
struct Vine {
    double middle, width;
    double amplitude[3], phase[3];
    int periods[3];

    double at(double x) const {
        double y = middle;
        for (int i = 0; i < 3; i++) {
            y += amplitude[i] * std::sin(2 * kPi * periods[i] * x / width + phase[i]);
        }
        return y;
    }
    double slope(double x) const { return (at(x + 0.1) - at(x - 0.1)) / 0.2; }
};

Vine vine_at(Random &random, double width, double middle, double amplitude) {
    Vine vine{};
    vine.middle = middle;
    vine.width = width;
    for (int i = 0; i < 3; i++) {
        vine.amplitude[i] = amplitude * random.uniform(0.5, 1) / (i + 1);
        vine.phase[i] = random.uniform(0, 2 * kPi);
        vine.periods[i] = 3 + 2 * i + static_cast<int>(random.uniform(0, 3));
    }
    return vine;
}

// A function of x at the middles of all columns, for lookups row by row.
template <class Value, class Function>
std::vector<Value> by_column(const Raster &raster, Function function) {
    std::vector<Value> values(static_cast<std::size_t>(raster.columns()));
    for (std::size_t i = 0; i < values.size(); i++) {
        values[i] = function((static_cast<double>(i) + 0.5) / raster.columns_per_mm());
    }
    return values;
}

void stroke(Raster &raster, const Vine &vine, double thick, const Colour &colour) {
    double low = vine.middle;
    double high = vine.middle;
    for (const double a : vine.amplitude) {
        low -= std::fabs(a) + thick;
        high += std::fabs(a) + thick;
    }
    struct Place {
        double middle, half, across;
    };
    const auto places = by_column<Place>(raster, [&](double x) {
        const double s = vine.slope(x);
        const double swell = 0.7 + 0.5 * std::sin(x * 0.13) * std::sin(x * 0.031 + 1);
        return Place{vine.at(x), thick * swell, std::sqrt(1 + s * s)};
    });
    raster.paint({0, low, raster.width_mm() - 1e-6, high}, colour, kSoftMm, 0.95,
                 [&](double x, double y) {
                     const Place &at = places[raster.column_of(x)];
                     return at.half - std::fabs(y - at.middle) / at.across;
                 });
}

void band(Raster &raster, double low, double high, const Colour &colour) {
    const auto waves = by_column<double>(
        raster, [](double x) { return 0.12 * std::sin(x * 0.21) + 0.08 * std::sin(x * 0.53 + 2); });
    raster.paint({0, low - 1, raster.width_mm() - 1e-6, high + 1}, colour, kSoftMm, 0.96,
                 [&](double x, double y) {
                     const double w = waves[raster.column_of(x)];
                     return std::min(y - low - w, high - y + 0.7 * w);
                 });
}

const Colour kIndigo = {{0.035, 0.055, 0.19}};
const Colour kGold = {{0.55, 0.33, 0.08}};
const Colour kHearts = {{0.62, 0.40, 0.05}};
const Colour kGreens[3] = {{{0.06, 0.19, 0.07}}, {{0.11, 0.25, 0.09}}, {{0.05, 0.15, 0.10}}};
const Colour kPetals[5] = {{{0.50, 0.06, 0.06}},
                           {{0.10, 0.13, 0.42}},
                           {{0.60, 0.24, 0.27}},
                           {{0.66, 0.36, 0.06}},
                           {{0.30, 0.10, 0.32}}};

void garland(Raster &raster, Random &random, double middle, double amplitude, double scale) {
    const double width = raster.width_mm();
    const Vine vine = vine_at(random, width, middle, amplitude);
    stroke(raster, vine, 0.55 * scale, kGreens[0]);
    for (double x = 0; x < width - 2 * scale; x += scale * random.uniform(2.5, 6)) {
        const double side = random.uniform() < 0.5 ? -1 : 1;
        const double turn = std::atan(vine.slope(x)) + side * random.uniform(0.5, 1.2);
        const int green = static_cast<int>(random.uniform(0, 3));
        leaf(raster, random, {x, vine.at(x)}, scale * random.uniform(5, 11), turn,
             varied(kGreens[green], random, 0.3));
    }
}

void border(Raster &raster, Random &random, double low, double high) {
    band(raster, low, high, kIndigo);
    const double middle = 0.5 * (low + high);
    const double width = raster.width_mm();
    band(raster, low - 1.6, low - 0.9, kGold);
    band(raster, high + 0.9, high + 1.6, kGold);
    const double r = 0.3 * (high - low);
    for (double x = 0; x < width - 2 * r; x += r * random.uniform(2.5, 3.4)) {
        if (random.uniform() < 0.5) {
            flower(raster, random, {x + r, middle + random.uniform(-0.4, 0.4)}, r,
                   varied({{0.62, 0.58, 0.48}}, random, 0.15), kHearts);
        } else {
            leaf(raster, random, {x + 0.2 * r, middle}, 1.7 * r, random.uniform(-0.5, 0.5),
                 varied(kGold, random, 0.2));
        }
    }
}

void blossoms(Raster &raster, Random &random, double low, double high, double distance,
              double size) {
    for (const Vec2 at : blue_noise(random, raster.width_mm(), low, high, distance, 3000)) {
        const int petal = static_cast<int>(random.uniform(0, 5));
        for (int i = 0; i < 3; i++) {
            leaf(raster, random, at, size * random.uniform(1.5, 2.1), random.uniform(0, 2 * kPi),
                 varied(kGreens[static_cast<int>(random.uniform(0, 3))], random, 0.3));
        }
        flower(raster, random, at, size * random.uniform(0.8, 1.25),
               varied(kPetals[petal], random, 0.25), varied(kHearts, random, 0.2));
    }
}

void sprinkle(Raster &raster, Random &random, double low, double high, double distance) {
    for (const Vec2 at : blue_noise(random, raster.width_mm(), low, high, distance, 6000)) {
        dot_at(raster, at, random.uniform(0.35, 0.8),
               varied(random.uniform() < 0.5 ? kPetals[1] : kPetals[0], random, 0.3), 0.9);
    }
}

Raster draw_garden(double width, double height, const Colour &ground, Random &random) {
    Raster raster(width, height, 0.14, ground);
    sprinkle(raster, random, 26, height - 24, 6.5);
    garland(raster, random, 0.33 * height, 9, 1.2);
    garland(raster, random, 0.52 * height, 10, 1.2);
    garland(raster, random, 0.72 * height, 9, 1.2);
    blossoms(raster, random, 42, height - 40, 33, 11);
    border(raster, random, 9, 23);
    border(raster, random, height - 22, height - 8);
    raster.finish();
    return raster;
}

Raster draw_meadow(double width, double height, const Colour &ground, Random &random) {
    Raster raster(width, height, 0.14, ground);
    band(raster, 2.2, 4.6, kIndigo);
    band(raster, 6.0, 6.5, kIndigo);
    garland(raster, random, 0.52 * height, 5, 0.9);
    blossoms(raster, random, 0.40 * height, 0.66 * height, 26, 7);
    band(raster, height - 8, height - 7.4, kIndigo);
    band(raster, height - 6, height - 3, kIndigo);
    raster.finish();
    return raster;
}

}  // namespace

bool is_ornament(const std::string &name) {
    return name == "garden" || name == "meadow";
}

Raster draw_ornament(const std::string &name, double width_mm, double height_mm,
                     const Colour &ground, std::uint64_t seed) {
    Random random(mixed(seed));
    return name == "garden" ? draw_garden(width_mm, height_mm, ground, random)
                            : draw_meadow(width_mm, height_mm, ground, random);
}

}  // namespace world
