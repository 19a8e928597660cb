// SPDX-License-Identifier: Apache-2.0
/// Small vectors of the renderer's inner loops: plain doubles that the compiler keeps in registers.
#ifndef VERGENCE_SIMRIG_WORLD_VEC_HPP
#define VERGENCE_SIMRIG_WORLD_VEC_HPP

#include <cmath>

namespace world {

constexpr double kPi = 3.14159265358979323846;

constexpr double radians(double degrees) {
    return degrees * (kPi / 180.0);
}

struct Vec2 {
    double x = 0;
    double y = 0;
};

inline Vec2 operator+(Vec2 a, Vec2 b) {
    return {a.x + b.x, a.y + b.y};
}
inline Vec2 operator-(Vec2 a, Vec2 b) {
    return {a.x - b.x, a.y - b.y};
}
inline Vec2 operator*(double s, Vec2 a) {
    return {s * a.x, s * a.y};
}
inline double dot(Vec2 a, Vec2 b) {
    return a.x * b.x + a.y * b.y;
}
inline double length(Vec2 a) {
    return std::sqrt(dot(a, a));
}

struct Vec3 {
    double x = 0;
    double y = 0;
    double z = 0;
};

inline Vec3 operator+(const Vec3 &a, const Vec3 &b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec3 operator-(const Vec3 &a, const Vec3 &b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vec3 operator-(const Vec3 &a) {
    return {-a.x, -a.y, -a.z};
}
inline Vec3 operator*(double s, const Vec3 &a) {
    return {s * a.x, s * a.y, s * a.z};
}
inline double dot(const Vec3 &a, const Vec3 &b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 cross(const Vec3 &a, const Vec3 &b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Vec3 &a) {
    return std::sqrt(dot(a, a));
}
inline Vec3 unit(const Vec3 &a) {
    return (1.0 / length(a)) * a;
}

/// Rows of a rotation.
struct Mat3 {
    Vec3 row0{1, 0, 0};
    Vec3 row1{0, 1, 0};
    Vec3 row2{0, 0, 1};
};

inline Vec3 operator*(const Mat3 &m, const Vec3 &v) {
    return {dot(m.row0, v), dot(m.row1, v), dot(m.row2, v)};
}
inline Mat3 transposed(const Mat3 &m) {
    return {{m.row0.x, m.row1.x, m.row2.x},
            {m.row0.y, m.row1.y, m.row2.y},
            {m.row0.z, m.row1.z, m.row2.z}};
}
inline Mat3 operator*(const Mat3 &a, const Mat3 &b) {
    const Mat3 columns = transposed(b);
    return {columns * a.row0, columns * a.row1, columns * a.row2};
}

/// Right-handed rotation by an angle about a unit axis (Rodrigues).
inline Mat3 rotation_about(const Vec3 &axis, double angle_rad) {
    const double c = std::cos(angle_rad);
    const double s = std::sin(angle_rad);
    const double k = 1 - c;
    const Vec3 &a = axis;
    return {{c + k * a.x * a.x, k * a.x * a.y - s * a.z, k * a.x * a.z + s * a.y},
            {k * a.y * a.x + s * a.z, c + k * a.y * a.y, k * a.y * a.z - s * a.x},
            {k * a.z * a.x - s * a.y, k * a.z * a.y + s * a.x, c + k * a.z * a.z}};
}

/// T_AB: takes points of frame B into frame A.
struct Pose {
    Mat3 rotation;
    Vec3 translation_mm;
};

inline Vec3 operator*(const Pose &pose, const Vec3 &point_mm) {
    return pose.rotation * point_mm + pose.translation_mm;
}
inline Pose operator*(const Pose &ab, const Pose &bc) {
    return {ab.rotation * bc.rotation, ab * bc.translation_mm};
}
inline Pose inverse(const Pose &pose) {
    const Mat3 back = transposed(pose.rotation);
    return {back, -(back * pose.translation_mm)};
}

/// Linear colour as the sensor's three filters see it: reflectance or irradiance.
struct Colour {
    double channel[3] = {0, 0, 0};
};

/// A half line; `direction` has length 1.
struct Ray {
    Vec3 origin_mm;
    Vec3 direction;
};

}  // namespace world

#endif
