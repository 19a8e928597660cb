// SPDX-License-Identifier: Apache-2.0
#include "stereo/geometry/geometry.h"

#include <math.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"

double geometry_dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double geometry_norm(const double a[3]) {
    return sqrt(geometry_dot(a, a));
}

void geometry_cross(const double a[3], const double b[3], double result[3]) {
    INVARIANT(result != a && result != b);
    result[0] = a[1] * b[2] - a[2] * b[1];
    result[1] = a[2] * b[0] - a[0] * b[2];
    result[2] = a[0] * b[1] - a[1] * b[0];
}

void geometry_rotate(const double R[9], const double a[3], double result[3]) {
    INVARIANT(result != a);
    for (int row = 0; row < 3; row++) {
        result[row] = geometry_dot(R + 3 * row, a);
    }
}

void geometry_rotate_back(const double R[9], const double a[3], double result[3]) {
    INVARIANT(result != a);
    for (int column = 0; column < 3; column++) {
        result[column] = R[column] * a[0] + R[3 + column] * a[1] + R[6 + column] * a[2];
    }
}

void geometry_multiply(const double A[9], const double B[9], double result[9]) {
    INVARIANT(result != A && result != B);
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++) {
            result[3 * row + column] = A[3 * row] * B[column] + A[3 * row + 1] * B[3 + column] +
                                       A[3 * row + 2] * B[6 + column];
        }
    }
}

void geometry_rotation_from_vector(const double r_rad[3], double R[9]) {
    const double x = r_rad[0], y = r_rad[1], z = r_rad[2];
    const double angle_rad = geometry_norm(r_rad);
    // R = I + a [r]x + b [r]x^2 with a = sin(angle)/angle and b = (1 - cos(angle))/angle^2; the
    // half angle avoids the cancellation in 1 - cos.
    double a = 1.0, b = 0.5;
    if (angle_rad > 1e-8) {
        const double half_sine = math_sin(0.5 * angle_rad);
        a = math_sin(angle_rad) / angle_rad;
        b = 2.0 * half_sine * half_sine / (angle_rad * angle_rad);
    }
    R[0] = 1.0 - b * (y * y + z * z);
    R[1] = b * x * y - a * z;
    R[2] = b * x * z + a * y;
    R[3] = b * x * y + a * z;
    R[4] = 1.0 - b * (x * x + z * z);
    R[5] = b * y * z - a * x;
    R[6] = b * x * z - a * y;
    R[7] = b * y * z + a * x;
    R[8] = 1.0 - b * (x * x + y * y);
}

// Cofactors of A: its inverse is the transposed cofactors over the determinant.
static double cofactors(const double A[9], double cofactor[9]) {
    geometry_cross(A + 3, A + 6, cofactor);
    geometry_cross(A + 6, A, cofactor + 3);
    geometry_cross(A, A + 3, cofactor + 6);
    return geometry_dot(A, cofactor);
}

static bool is_near_rotation(const double R[9]) {
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            const double error = geometry_dot(R + 3 * i, R + 3 * j) - (i == j ? 1.0 : 0.0);
            if (!(error >= -1e-4 && error <= 1e-4)) {  // also rejects a NaN
                return false;
            }
        }
    }
    double cofactor[9];
    return cofactors(R, cofactor) > 0;
}

// Nearest rotation: Newton's iteration for the polar decomposition, X <- (X + X^-T) / 2
// (N. J. Higham, SIAM J. Sci. Stat. Comput. 7(4), 1986). From 1e-4 it is exact after four steps.
static void nearest_rotation(const double R[9], double rotation[9]) {
    for (int i = 0; i < 9; i++) {
        rotation[i] = R[i];
    }
    for (int step = 0; step < 4; step++) {
        double cofactor[9];
        const double determinant = cofactors(rotation, cofactor);
        INVARIANT(determinant > 0.9);
        for (int i = 0; i < 9; i++) {
            rotation[i] = 0.5 * (rotation[i] + cofactor[i] / determinant);
        }
    }
}

// Unit quaternion (w, x, y, z) with w >= 0, from the largest of its four squares
// (S. W. Shepperd, J. Guidance and Control 1(3), 1978), which never divides by a small number.
static void quaternion_from_rotation(const double R[9], double q[4]) {
    const double square[4] = {1.0 + R[0] + R[4] + R[8], 1.0 + R[0] - R[4] - R[8],
                              1.0 - R[0] + R[4] - R[8], 1.0 - R[0] - R[4] + R[8]};
    int largest = 0;
    for (int i = 1; i < 4; i++) {
        largest = square[i] > square[largest] ? i : largest;
    }
    INVARIANT(square[largest] > 0.99);
    const double twice[4][4] = {
        {square[0], R[7] - R[5], R[2] - R[6], R[3] - R[1]},
        {R[7] - R[5], square[1], R[1] + R[3], R[2] + R[6]},
        {R[2] - R[6], R[1] + R[3], square[2], R[5] + R[7]},
        {R[3] - R[1], R[2] + R[6], R[5] + R[7], square[3]},
    };
    const double sign = twice[largest][0] < 0 ? -1.0 : 1.0;
    const double divisor = sign * 2.0 * sqrt(square[largest]);
    for (int i = 0; i < 4; i++) {
        q[i] = twice[largest][i] / divisor;
    }
}

int geometry_vector_from_rotation(const double R[9], double r_rad[3]) {
    if (!is_near_rotation(R)) {
        return ERROR_ROTATION;
    }
    double rotation[9], q[4];
    nearest_rotation(R, rotation);
    quaternion_from_rotation(rotation, q);
    const double half_sine = geometry_norm(q + 1);
    const double factor = half_sine < 1e-150 ? 2.0 : 2.0 * math_atan2(half_sine, q[0]) / half_sine;
    for (int i = 0; i < 3; i++) {
        r_rad[i] = factor * q[1 + i];
    }
    return ERROR_OK;
}

int geometry_relative_pose(const double R_frame_a[9], const double position_a_mm[3],
                           const double R_frame_b[9], const double position_b_mm[3],
                           double rotation_b_a_rad[3], double translation_b_a_mm[3]) {
    const double *a = R_frame_a, *b = R_frame_b;
    double R_b_a[9], arm_mm[3];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            R_b_a[3 * i + j] = b[i] * a[j] + b[3 + i] * a[3 + j] + b[6 + i] * a[6 + j];
        }
        arm_mm[i] = position_a_mm[i] - position_b_mm[i];
    }
    geometry_rotate_back(b, arm_mm, translation_b_a_mm);
    return geometry_vector_from_rotation(R_b_a, rotation_b_a_rad);
}

bool geometry_rays_midpoint(const double origin_a_mm[3], const double direction_a[3],
                            const double origin_b_mm[3], const double direction_b[3],
                            struct geometry_midpoint *result) {
    double normal[3];
    geometry_cross(direction_a, direction_b, normal);
    const double normal2 = geometry_dot(normal, normal);
    if (!(normal2 >= 1e-24 * geometry_dot(direction_a, direction_a) *
                         geometry_dot(direction_b, direction_b)) ||
        normal2 == 0) {
        return false;
    }
    double between_mm[3], moment[3];
    for (int i = 0; i < 3; i++) {
        between_mm[i] = origin_b_mm[i] - origin_a_mm[i];
    }
    geometry_cross(between_mm, direction_b, moment);
    const double s = geometry_dot(moment, normal) / normal2;
    geometry_cross(between_mm, direction_a, moment);
    const double t = geometry_dot(moment, normal) / normal2;
    const double gap = geometry_dot(between_mm, normal) / sqrt(normal2);
    for (int i = 0; i < 3; i++) {
        result->point_mm[i] =
            0.5 * ((origin_a_mm[i] + s * direction_a[i]) + (origin_b_mm[i] + t * direction_b[i]));
    }
    result->miss_mm = gap < 0 ? -gap : gap;
    result->s = s;
    result->t = t;
    return true;
}
