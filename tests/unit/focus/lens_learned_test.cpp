// SPDX-License-Identifier: Apache-2.0
// Tables of what was learned about a lens: kept in order, merged when full, and close to the truth
// after a few noisy measurements, also when the object moves in between.
#include "focus/lens_learned.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "synthetic/seed.hpp"

namespace {

constexpr int kSpan = 550;

double deviation(const lens_table &table, int zoom, double *sigma = nullptr) {
    double value = 0, spread = 0;
    lens_learned_deviation(&table, zoom, kSpan, &value, &spread);
    if (sigma != nullptr) {
        *sigma = spread / 16;
    }
    return value / 16;
}

// A lens whose focus deviates from the nominal one, and an object.
struct Lens {
    double bend;
    double truth(int zoom, double object) const {
        return object + bend * std::sin((zoom - 300) / 550.0 * 2);
    }
};

}  // namespace

TEST_CASE("a table stays sorted, replaces equal positions, and merges the closest when full") {
    std::mt19937_64 random(synthetic::test_seed());
    lens_table table{};
    double value = 0;
    CHECK(!lens_table_value(&table, 300, &value));
    for (int i = 0; i < 2000; i++) {
        const int at = 300 + int(random() % 551);
        const lens_point point = {at, at * 2, 10, 1};
        lens_table_put(&table, &point);
        REQUIRE(lens_table_is_valid(&table));
        REQUIRE(table.count <= LENS_POINTS_MAX);
    }
    CHECK(table.count == LENS_POINTS_MAX);
    for (int at = table.point[0].at; at < table.point[LENS_POINTS_MAX - 1].at; at += 7) {
        REQUIRE(lens_table_value(&table, at, &value));
        CHECK(std::abs(value - at * 2) < 2.01);
    }
    REQUIRE(lens_table_value(&table, 100, &value));
    CHECK(value == table.point[0].value);
    lens_table broken = table;
    std::swap(broken.point[1], broken.point[2]);
    CHECK(!lens_table_is_valid(&broken));
    broken.count = LENS_POINTS_MAX + 1;
    CHECK(!lens_table_is_valid(&broken));
}

TEST_CASE("a falling table gives the position of a value") {
    lens_table table{};
    const lens_point points[] = {{300, 10000, 1, 1}, {500, 4000, 1, 1}, {850, 1000, 1, 1}};
    for (const lens_point &point : points) {
        lens_table_put(&table, &point);
    }
    double at = 0, value = 0;
    for (const double wanted : {10000.0, 7000.0, 4000.0, 2000.0, 1000.0}) {
        REQUIRE(lens_table_position(&table, wanted, &at));
        REQUIRE(lens_table_value(&table, at, &value));
        CHECK(value == doctest::Approx(wanted));
    }
    CHECK(!lens_table_position(&table, 999, &at));
    CHECK(!lens_table_position(&table, 10001, &at));
}

TEST_CASE("from a few zooms of one object the focus at the others follows, at any distance") {
    std::mt19937_64 random(synthetic::test_seed());
    std::normal_distribution<double> noise(0, 0.7);
    const Lens lens = {6};
    lens_table table{};
    lens_object object{};
    for (int round = 0; round < 3; round++) {
        for (int zoom = 300; zoom <= 850; zoom += 110) {
            const double found = lens.truth(zoom, 544) + noise(random);
            lens_learned_focus(&table, 0, &object, zoom, kSpan, int(std::lround(found * 16)), 11,
                               INT32_MIN);
        }
    }
    CHECK(table.count == 6);
    // Another object, focused at one zoom.
    const double found = lens.truth(850, 420) + noise(random);
    CHECK(!lens_learned_focus(&table, 0, &object, 850, kSpan, int(std::lround(found * 16)), 11,
                              INT32_MIN));
    for (int zoom = 300; zoom <= 850; zoom += 55) {
        double sigma = 0;
        const double predicted = object.position_q4 / 16.0 + deviation(table, zoom, &sigma);
        CAPTURE(zoom);
        CHECK(std::abs(predicted - lens.truth(zoom, 420)) < 3.5);
        CHECK(sigma < 6);
    }
}

TEST_CASE("two lenses share the object: the second starts where the first one found it") {
    lens_table left{}, right{};
    lens_object object{};
    const int zoom = 700;
    CHECK(!lens_learned_focus(&left, 0, &object, zoom, kSpan, 540 * 16, 11, INT32_MIN));
    CHECK(lens_learned_focus(&right, 1, &object, zoom, kSpan, 546 * 16, 11, INT32_MIN));
    CHECK(std::abs(deviation(right, zoom) - 6) < 1);
    CHECK(!lens_learned_focus(&left, 0, &object, zoom, kSpan, 440 * 16, 11, INT32_MIN));
    CHECK(std::abs(object.position_q4 / 16.0 + deviation(right, zoom) - 446) < 1.5);
}

TEST_CASE("a measured distance makes the table absolute") {
    lens_table table{};
    lens_object object{};
    CHECK(lens_learned_focus(&table, 0, &object, 500, kSpan, 550 * 16, 11, 544 * 16));
    CHECK(object.position_q4 == 544 * 16);
    CHECK(std::abs(deviation(table, 500) - 6) < 0.2);
}

TEST_CASE("a wrong entry heals") {
    std::mt19937_64 random(synthetic::test_seed());
    std::normal_distribution<double> noise(0, 0.7);
    lens_table table{};
    lens_object object{};
    const lens_point wrong = {850, 15 * 16, 8, 5}, right = {300, 0, 8, 5};
    lens_table_put(&table, &wrong);
    lens_table_put(&table, &right);
    for (int i = 0; i < 40; i++) {
        const int zoom = i % 2 == 0 ? 850 : 300;
        const double found = 544 + noise(random);
        lens_learned_focus(&table, 0, &object, zoom, kSpan, int(std::lround(found * 16)), 11,
                           INT32_MIN);
    }
    CHECK(std::abs(deviation(table, 850) - deviation(table, 300)) < 3);
}

TEST_CASE("objects at random distances leave the table as it is") {
    std::mt19937_64 random(synthetic::test_seed());
    std::normal_distribution<double> noise(0, 0.7);
    const Lens lens = {4};
    lens_table table{};
    lens_object object{};
    double worst = 0;
    for (int i = 0; i < 500; i++) {
        const double distance = 350 + double(random() % 450);
        for (const int zoom : {300, 520, 850}) {
            const double found = lens.truth(zoom, distance) + noise(random);
            const double predicted = object.position_q4 / 16.0 + deviation(table, zoom);
            // The first zoom of an object shows where it is.
            worst = i > 20 && zoom != 300 ? std::max(worst, std::abs(predicted - found)) : worst;
            lens_learned_focus(&table, 0, &object, zoom, kSpan, int(std::lround(found * 16)), 11,
                               INT32_MIN);
        }
    }
    CHECK(worst < 7);
    CHECK(table.count == 3);
}
