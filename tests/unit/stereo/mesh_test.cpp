// SPDX-License-Identifier: Apache-2.0
#include "stereo/mesh.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <set>
#include <vector>

#include "random_rig.hpp"
#include "synthetic/seed.hpp"

namespace {

using random_rig::Random;
using random_rig::uniform;

// A field of vertices over an image, and the mesh that joins them.
struct Field {
    int width, height;
    std::vector<int32_t> disparity_q8;
    std::vector<uint32_t> vertex;
    std::vector<triangulate_point> point;
    std::vector<uint32_t> pixel;  // pixel of each vertex
    std::vector<std::array<uint32_t, 3>> triangles;

    Field(int w, int h)
        : width(w),
          height(h),
          disparity_q8(static_cast<size_t>(w * h)),
          vertex(static_cast<size_t>(w * h), MESH_NO_VERTEX),
          point(static_cast<size_t>(w * h)) {}

    void put(int x, int y, int32_t d_q8, const triangulate_point &p) {
        const size_t i = static_cast<size_t>(y * width + x);
        disparity_q8[i] = d_q8;
        point[i] = p;
        vertex[i] = static_cast<uint32_t>(pixel.size());
        pixel.push_back(static_cast<uint32_t>(i));
    }

    mesh_row row(int y) const {
        const size_t i = static_cast<size_t>(y * width);
        return {&disparity_q8[i], &vertex[i]};
    }

    void join(int32_t max_gap_q8) {
        const mesh_options options = {width, max_gap_q8};
        triangles.clear();
        for (int y = 1; y < height; y++) {
            const mesh_row above = row(y - 1), below = row(y);
            std::vector<std::array<uint32_t, 3>> room(static_cast<size_t>(2 * width));
            const int count = mesh_join_rows(&options, &above, &below,
                                             reinterpret_cast<uint32_t(*)[3]>(room.data()));
            REQUIRE(count <= 2 * (width - 1));
            triangles.insert(triangles.end(), room.begin(), room.begin() + count);
        }
    }

    int x_of(uint32_t v) const { return static_cast<int>(pixel[v]) % width; }
    int y_of(uint32_t v) const { return static_cast<int>(pixel[v]) / width; }
};

triangulate_point at_um(double x, double y, double z) {
    triangulate_point p = {};
    p.x_um = static_cast<int32_t>(std::lround(x));
    p.y_um = static_cast<int32_t>(std::lround(y));
    p.z_um = static_cast<int32_t>(std::lround(z));
    return p;
}

Field random_field(Random &random, int width, int height) {
    Field field(width, height);
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            if (random() % 5 != 0) {
                field.put(x, y, static_cast<int32_t>(random() % 600), at_um(x, y, 1000));
            }
        }
    }
    return field;
}

// Normal of a vertex from all its triangles.
std::array<double, 3> normal_of(const Field &field, uint32_t v) {
    int64_t sum[3] = {};
    for (const auto &t : field.triangles) {
        for (uint32_t corner : t) {
            if (corner == v) {
                mesh_accumulate_normal(&field.point[field.pixel[t[0]]],
                                       &field.point[field.pixel[t[1]]],
                                       &field.point[field.pixel[t[2]]], sum);
            }
        }
    }
    int16_t normal_q14[3];
    mesh_normal_q14(sum, normal_q14);
    return {normal_q14[0] / 16384.0, normal_q14[1] / 16384.0, normal_q14[2] / 16384.0};
}

}  // namespace

TEST_CASE("a full flat field is covered once, counter-clockwise seen from the camera") {
    Field field(17, 9);
    for (int y = 0; y < 9; y++) {
        for (int x = 0; x < 17; x++) {
            field.put(x, y, 1000, at_um(1000 * x, 1000 * y, 1e6));
        }
    }
    field.join(MESH_DEFAULT_GAP_Q8);
    CHECK(field.triangles.size() == 2 * 16 * 8);
    double area = 0;
    for (const auto &t : field.triangles) {
        const double ax = field.x_of(t[0]), ay = field.y_of(t[0]);
        const double ux = field.x_of(t[1]) - ax, uy = field.y_of(t[1]) - ay;
        const double vx = field.x_of(t[2]) - ax, vy = field.y_of(t[2]) - ay;
        // With y downwards, counter-clockwise as seen is a negative cross product.
        REQUIRE(ux * vy - uy * vx == -1);
        area += 0.5;
    }
    CHECK(area == 16 * 8);
    CHECK(normal_of(field, 20)[2] == -1);  // the normal points towards the camera
}

TEST_CASE("no triangle bridges a gap, and none is left out") {
    Random random(synthetic::test_seed());
    for (int i = 0; i < 200; i++) {
        Field field = random_field(random, 2 + static_cast<int>(random() % 30),
                                   2 + static_cast<int>(random() % 10));
        const int32_t max_gap_q8 = static_cast<int32_t>(random() % 500);
        field.join(max_gap_q8);
        std::set<std::array<uint32_t, 3>> seen;
        for (const auto &t : field.triangles) {
            for (int k = 0; k < 3; k++) {
                const uint32_t a = t[static_cast<size_t>(k)];
                const uint32_t b = t[static_cast<size_t>((k + 1) % 3)];
                REQUIRE(a < field.pixel.size());
                REQUIRE(std::abs(field.disparity_q8[field.pixel[a]] -
                                 field.disparity_q8[field.pixel[b]]) <= max_gap_q8);
                REQUIRE(std::abs(field.x_of(a) - field.x_of(b)) <= 1);
                REQUIRE(std::abs(field.y_of(a) - field.y_of(b)) <= 1);
            }
            REQUIRE(seen.insert(t).second);
        }
        // Cell by cell: the number of triangles allowed by the smaller diagonal.
        size_t expected = 0;
        for (int y = 1; y < field.height; y++) {
            for (int x = 1; x < field.width; x++) {
                const auto corner = [&](int dx, int dy) {
                    return static_cast<size_t>((y - 1 + dy) * field.width + x - 1 + dx);
                };
                const size_t a = corner(0, 0), b = corner(1, 0), c = corner(0, 1), d = corner(1, 1);
                const auto gap = [&](size_t p, size_t q) {
                    return field.vertex[p] == MESH_NO_VERTEX || field.vertex[q] == MESH_NO_VERTEX
                               ? 1000000
                               : std::abs(field.disparity_q8[p] - field.disparity_q8[q]);
                };
                const auto fits = [&](size_t p, size_t q, size_t r) {
                    return gap(p, q) <= max_gap_q8 && gap(q, r) <= max_gap_q8 &&
                           gap(r, p) <= max_gap_q8;
                };
                expected += gap(a, d) <= gap(b, c) ? fits(a, c, d) + fits(a, d, b)
                                                   : fits(a, c, b) + fits(b, c, d);
            }
        }
        REQUIRE(field.triangles.size() == expected);
    }
}

TEST_CASE("a step stays open and a hole stays a hole") {
    Field field(20, 10);
    for (int y = 0; y < 10; y++) {
        for (int x = 0; x < 20; x++) {
            const bool near = x >= 10;
            if (x != 5 || y != 5) {
                field.put(x, y, near ? 40 * 256 : 30 * 256, at_um(x, y, near ? 1 : 2));
            }
        }
    }
    field.join(MESH_DEFAULT_GAP_Q8);
    CHECK(field.triangles.size() == 2 * 9 * 9 + 2 * 9 * 9 - 8 + 4);  // four cells keep one each
    for (const auto &t : field.triangles) {
        const bool near = field.x_of(t[0]) >= 10;
        CHECK(near == (field.x_of(t[1]) >= 10));
        CHECK(near == (field.x_of(t[2]) >= 10));
    }
}

TEST_CASE("normals of a slanted plane") {
    Field field(12, 12);
    for (int y = 0; y < 12; y++) {
        for (int x = 0; x < 12; x++) {
            field.put(x, y, 256, at_um(5000 * x, 5000 * y, 1e6 + 5000 * (0.5 * x - 0.25 * y)));
        }
    }
    field.join(MESH_DEFAULT_GAP_Q8);
    const double length = std::sqrt(0.5 * 0.5 + 0.25 * 0.25 + 1);
    for (uint32_t v : {0u, 13u, 77u, 143u}) {
        const auto n = normal_of(field, v);
        CHECK(n[0] == doctest::Approx(0.5 / length).epsilon(1e-3));
        CHECK(n[1] == doctest::Approx(-0.25 / length).epsilon(1e-3));
        CHECK(n[2] == doctest::Approx(-1 / length).epsilon(1e-3));
    }
}

TEST_CASE("normals of a sphere point away from its centre") {
    const double radius_um = 50000, centre_um = 500000;
    Field field(41, 41);
    for (int y = 0; y < 41; y++) {
        for (int x = 0; x < 41; x++) {
            const double px = 2000.0 * (x - 20), py = 2000.0 * (y - 20);
            const double left = radius_um * radius_um - px * px - py * py;
            if (left > 0) {
                field.put(x, y, 256, at_um(px, py, centre_um - std::sqrt(left)));
            }
        }
    }
    field.join(MESH_DEFAULT_GAP_Q8);
    int checked = 0;
    for (uint32_t v = 0; v < field.pixel.size(); v++) {
        const triangulate_point &p = field.point[field.pixel[v]];
        if (std::hypot(p.x_um, p.y_um) > 0.7 * radius_um) {
            continue;
        }
        const auto n = normal_of(field, v);
        const double cosine =
            (n[0] * p.x_um + n[1] * p.y_um + n[2] * (p.z_um - centre_um)) / radius_um;
        CHECK(cosine > 0.999);
        checked++;
    }
    CHECK(checked > 500);
}

TEST_CASE("normals neither overflow nor lose small triangles") {
    Random random(synthetic::test_seed());
    for (int i = 0; i < 20000; i++) {
        const double reach_um = std::pow(10, uniform(random, 1, 9.3));
        triangulate_point p[3];
        for (triangulate_point &one : p) {
            one = at_um(uniform(random, -1, 1) * reach_um, uniform(random, -1, 1) * reach_um,
                        uniform(random, -1, 1) * reach_um);
        }
        int64_t sum[3] = {};
        for (int k = 0; k < 8; k++) {
            mesh_accumulate_normal(&p[0], &p[1], &p[2], sum);
        }
        const double u[3] = {static_cast<double>(p[1].x_um) - p[0].x_um,
                             static_cast<double>(p[1].y_um) - p[0].y_um,
                             static_cast<double>(p[1].z_um) - p[0].z_um};
        const double v[3] = {static_cast<double>(p[2].x_um) - p[0].x_um,
                             static_cast<double>(p[2].y_um) - p[0].y_um,
                             static_cast<double>(p[2].z_um) - p[0].z_um};
        double n[3];
        geometry_cross(u, v, n);
        const double length = geometry_norm(n);
        if (length < 0.02 * geometry_norm(u) * geometry_norm(v) || length == 0) {
            continue;  // nearly a line
        }
        int16_t normal_q14[3];
        mesh_normal_q14(sum, normal_q14);
        for (int k = 0; k < 3; k++) {
            REQUIRE(std::fabs(normal_q14[k] - 16384 * n[k] / length) < 2);
        }
    }
    int64_t zero[3] = {};
    int16_t normal_q14[3];
    mesh_normal_q14(zero, normal_q14);
    CHECK(normal_q14[0] == 0);
    CHECK(normal_q14[2] == -16384);
}
