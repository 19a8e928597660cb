// SPDX-License-Identifier: Apache-2.0
/// Small vectors, rotations and rays. Set-up code: double, no allocation.
/// Camera frames: x right, y down, z forward. `R_AB` and `T_AB` take points of frame B
/// into frame A, so names chain: `R_AC = R_AB R_BC`. Matrices are row-major, 9 doubles.
/// Lengths in mm, angles in rad.
#ifndef VERGENCE_STEREO_GEOMETRY_GEOMETRY_H
#define VERGENCE_STEREO_GEOMETRY_GEOMETRY_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

double geometry_dot(const double a[3], const double b[3]);
double geometry_norm(const double a[3]);
void geometry_cross(const double a[3], const double b[3], double result[3]);

/// result = R a. `result` must not overlap `a`.
void geometry_rotate(const double R[9], const double a[3], double result[3]);
/// result = R^T a. `result` must not overlap `a`.
void geometry_rotate_back(const double R[9], const double a[3], double result[3]);
/// result = A B. `result` must not overlap A or B.
void geometry_multiply(const double A[9], const double B[9], double result[9]);

/// Rotation matrix of the rotation vector `r_rad` (axis times angle; Rodrigues' formula).
void geometry_rotation_from_vector(const double r_rad[3], double R[9]);

/// Rotation vector of a rotation matrix, angle in [0, pi]. ERROR_ROTATION if R is not orthonormal
/// within 1e-4, has determinant < 0 or contains a NaN; R within that tolerance is projected to the
/// nearest rotation first.
int geometry_vector_from_rotation(const double R[9], double r_rad[3]);

/// Pose of camera A in the frame of camera B, as point_b = R point_a + translation, from both poses
/// in one frame: their rotations into it, and their positions. Errors:
/// `geometry_vector_from_rotation`.
int geometry_relative_pose(const double R_frame_a[9], const double position_a_mm[3],
                           const double R_frame_b[9], const double position_b_mm[3],
                           double rotation_b_a_rad[3], double translation_b_a_mm[3]);

/// The two points of closest approach of the rays `origin_a + s direction_a` and
/// `origin_b + t direction_b` (directions need no unit length), in one frame.
struct geometry_midpoint {
    double point_mm[3];  // half way between the points of closest approach
    double miss_mm;      // The points of closest approach of the rays `origin_a + s direction_a`
                         // and `origin_b + t direction_b` (directions of any length), in one frame.
    double s, t;         // parameters along the rays; negative means behind the origin
};

/// Returns false (result untouched) for parallel rays: |a x b|^2 < 1e-24 |a|^2 |b|^2.
/// Source: Hartley and Sturm, "Triangulation", CVIU 68(2), 1997, section 5.3 (mid-point method).
bool geometry_rays_midpoint(const double origin_a_mm[3], const double direction_a[3],
                            const double origin_b_mm[3], const double direction_b[3],
                            struct geometry_midpoint *result);

#ifdef __cplusplus
}
#endif

#endif
