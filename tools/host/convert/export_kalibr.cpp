// SPDX-License-Identifier: Apache-2.0
/// Kalibr's camera chain. T_cn_cnm1 takes points of the camera before into this one's frame, in m;
/// "pinhole" holds fu fv pu pv, "radtan" k1 k2 r1 r2, which are OpenCV's k1 k2 p1 p2, and "equi"
/// the four coefficients of the equidistant model. Source: Kalibr wiki, "Yaml formats" and
/// "Supported models".
#include <cmath>

#include "calib/base/lens_refit.hpp"
#include "core/error.h"
#include "stereo/geometry/geometry.h"
#include "tools/host/convert/export.hpp"
#include "tools/host/convert/import.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

// Of the image's diagonal: an approximation with a larger error is rejected.
const double absurd_share = 0.01;

/// `*one` as Kalibr can hold it; returns the resulting error, "" for none.
std::string fit_radtan(const std::string &name, lens *one) {
    const bool rational = one->kind == LENS_RATIONAL;
    if (one->kind == LENS_EQUIDISTANT || (one->k3 == 0 && !rational)) {
        return "";
    }
    const std::string missing = rational ? "k3 to k6" : "k3";
    const calib::lens_refit refit = calib::refit_without_k3(*one);
    const std::string max = number_text(refit.max_px, 3);
    if (lens_validate(&refit.fitted) != ERROR_OK ||
        refit.max_px > absurd_share * std::hypot(one->width_px, one->height_px)) {
        throw export_failure{ERROR_DISTORTION,
                             "Kalibr's radtan model has no " + missing + ", and without it " +
                                 name + " is off by up to " + max + " px: calibrate with --model " +
                                 (rational ? "equidistant" : "k1-k2-p1-p2")};
    }
    *one = refit.fitted;
    return name + ": " + missing + (rational ? " are" : " is") +
           " not in Kalibr's model; k1 k2 p1 p2 fitted instead are off by " +
           number_text(refit.rms_px, 3) + " px rms, at most " + max + " px over the image";
}

std::string camera(int number, const lens &one, const std::string &pose) {
    const std::string other = number == 0 ? "1" : "0";
    const bool equi = one.kind == LENS_EQUIDISTANT;
    return "cam" + std::to_string(number) + ":\n" + pose + "  cam_overlaps: [" + other +
           "]\n  camera_model: pinhole\n  distortion_coeffs: [" +
           export_numbers(equi ? export_coefficients(one)
                               : std::vector<double>{one.k1, one.k2, one.p1, one.p2}) +
           "]\n  distortion_model: " + (equi ? "equi" : "radtan") + "\n  intrinsics: [" +
           export_numbers({one.fx_px, one.fy_px, one.cx_px, one.cy_px}) + "]\n  resolution: [" +
           std::to_string(one.width_px) + ", " + std::to_string(one.height_px) +
           "]\n  rostopic: /cam" + std::to_string(number) + "/image_raw\n";
}

}  // namespace

std::vector<export_file> export_kalibr(const calibration &value) {
    lens left = value.left, right = value.right;
    std::string loss, comments;
    for (const std::string &line : {fit_radtan("cam0", &left), fit_radtan("cam1", &right)}) {
        loss += (loss.empty() || line.empty() ? "" : "; ") + line;
        comments += line.empty() ? "" : "# " + line + "\n";
    }
    double R[9];
    geometry_rotation_from_vector(value.rotation_right_left_rad, R);
    const double *t_mm = value.translation_right_left_mm;
    std::string pose = "  T_cn_cnm1:\n";
    for (int row = 0; row < 3; row++) {
        const double *r = R + 3 * row;
        pose += "  - [" + export_numbers({r[0], r[1], r[2], t_mm[row] / metre_mm}) + "]\n";
    }
    pose += "  - [0.0, 0.0, 0.0, 1.0]\n";
    return {{"camchain.yaml", comments + camera(0, left, "") + camera(1, right, pose), loss}};
}
