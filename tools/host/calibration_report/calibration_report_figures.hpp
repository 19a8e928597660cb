// SPDX-License-Identifier: Apache-2.0
/// Figures of the page beyond the solution itself: where corners are, how the boards were posed,
/// how well rows agree, what the boards measure.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_FIGURES_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATION_REPORT_CALIBRATION_REPORT_FIGURES_HPP

#include <string>
#include <vector>

#include "tools/host/calibration_report/calibration_page.hpp"
#include "tools/host/convert/export.hpp"

/// Pose of a board in front of a camera.
struct calibration_pose {
    std::size_t capture;
    double distance_mm;  // distance of the board's middle
    double tilt_deg;     // angle between the board's normal and the line of sight to its middle
    double turn_deg;     // tilt about the image's vertical axis, left edge away: positive
    double nod_deg;      // tilt about the image's horizontal axis, top edge away: positive
};

/// Measurements of the boards by the pair, independent of how the boards were solved for.
struct calibration_measured {
    std::size_t points = 0, lengths = 0;
    double square_mean_mm = 0;  // mean side of the squares
    double square_rms_mm = 0;   // RMS error of the sides relative to the stated side
    double plane_rms_mm = 0;    // distance of the points from each board's plane of best fit
};

constexpr int CALIBRATION_AREAS_X = 8, CALIBRATION_AREAS_Y = 6;

struct calibration_camera_figures {
    lens camera;
    std::vector<const calib::corner_residual_px *> corners;  // all, in the solution's order
    std::vector<calibration_pose> poses;
    double rms_px = 0;  // RMS over the used corners, per point
    std::size_t used = 0;
    int count[CALIBRATION_AREAS_Y][CALIBRATION_AREAS_X] = {};  // used corners by area
    int empty_areas = 0;
};

struct calibration_figures {
    int cameras = 0;
    std::vector<calibration_camera_figures> camera;
    double median_distance_mm = 0;  // median distance of the boards from the left camera
    bool rectified_known = false;
    export_rectified rectified;
    std::vector<double> vertical_px;  // left minus right row of each pair of corners
    double vertical_rms_px = 0, vertical_max_px = 0;
    calibration_measured measured;
    std::vector<std::string> hints;  // what to photograph next, most useful first; sentences
};

/// The solution must be solved.
calibration_figures calibration_figures_collect(const calib::observations &seen,
                                                const calib::solution &result);

/// Largest standard deviation, over all directions, of where a camera shows a point at a distance
/// (INFINITY: a direction), in px; negative where the pixel has no ray.
double calibration_figures_sigma_px(const calib::solution &result, int camera, double x_px,
                                    double y_px, double distance_mm);

/// Hints from the figures (whose other fields are set), see calibration_report_hints.cpp.
std::vector<std::string> calibration_figures_hints(const calib::observations &seen,
                                                   const calib::solution &result,
                                                   const calibration_figures &figures);

#endif
