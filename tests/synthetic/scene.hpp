// SPDX-License-Identifier: Apache-2.0
/// Worlds of textured planes and spheres, for synthetic stereo pairs whose truth is exact by
/// construction: both views look at the same continuous texture. Shares no code with firmware/.
#ifndef VERGENCE_TESTS_SYNTHETIC_SCENE_HPP
#define VERGENCE_TESTS_SYNTHETIC_SCENE_HPP

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace synthetic {

struct Vector {
    double x = 0, y = 0, z = 0;
};

inline Vector operator+(const Vector &a, const Vector &b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vector operator-(const Vector &a, const Vector &b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vector operator*(double s, const Vector &a) {
    return {s * a.x, s * a.y, s * a.z};
}
inline double dot(const Vector &a, const Vector &b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
double norm(const Vector &a);

/// Uniform and normal numbers that are the same on every platform for a seed.
class Random {
  public:
    explicit Random(uint64_t seed) : state_(seed) {}
    uint64_t bits();                          // splitmix64 (Steele, Lea and Flood, 2014)
    double uniform(double low, double high);  // [low, high)
    double normal();                          // mean 0, sigma 1 (Box and Muller, 1958)

  private:
    uint64_t state_;
    std::optional<double> second_normal_;
};

/// Periodic table of random coefficients of a cubic B-spline: noise whose spectrum falls as sinc^4,
/// with its first zero at one cycle per cell. With cells of 2.5 px the amplitude at the Nyquist
/// frequency is 0.1 % of that at 0.
class Noise {
  public:
    explicit Noise(uint64_t seed);
    double at(double u, double v) const;  // mean 0, sigma 1; u, v in cells

  private:
    static constexpr int kCells = 128;
    std::vector<float> coefficients_;
};

/// Reflectance as a function of world (x, y), constant along z, so that its frequency in both
/// images does not depend on the slope of the surface.
struct Texture {
    enum class Kind { Noise, Constant, Stripes };
    Kind kind = Kind::Noise;
    double mean = 0.45;       // mean reflectance as a share of full scale
    double contrast = 0.15;   // sigma of the noise, amplitude of the stripes
    double cell_mm = 1;       // noise cell, or period of the stripes along x
    double coarse_share = 0;  // 0..1: share of the contrast in cells four times as large
    std::shared_ptr<const Noise> noise;

    double at(double x_mm, double y_mm) const;
};

/// Rectangle in world (x, y).
struct Rectangle {
    double x_begin_mm, x_end_mm, y_begin_mm, y_end_mm;
    bool contains(double x_mm, double y_mm) const {
        return x_mm >= x_begin_mm && x_mm < x_end_mm && y_mm >= y_begin_mm && y_mm < y_end_mm;
    }
};

struct Surface {
    enum class Kind { Plane, Sphere };
    Kind kind = Kind::Plane;
    Vector normal;  // plane: the points with normal . p = 1
    Vector centre;  // sphere
    double radius_mm = 0;
    std::optional<Rectangle> bounds;  // plane: nothing outside
    std::vector<Rectangle> holes;     // plane: nothing inside
    Texture texture;
};

struct Hit {
    double t;     // the point is origin + t direction
    int surface;  // index
    Vector point;
};

struct Scene {
    std::vector<Surface> surfaces;

    /// Nearest surface along a ray, t > 1e-9; the direction need not be normalised.
    std::optional<Hit> cast(const Vector &origin, const Vector &direction) const;
    double reflectance(const Hit &hit) const;
};

}  // namespace synthetic

#endif
