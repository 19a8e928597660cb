// SPDX-License-Identifier: Apache-2.0
/// A rig with motorized zooms and pans, and the corners that it sees of boards: written from the
/// equations of a thin lens and of Brown and Conrady, sharing no code with firmware/, calib/ or the
/// simulated rig.
#ifndef VERGENCE_TESTS_SYNTHETIC_ZOOM_VIEWS_HPP
#define VERGENCE_TESTS_SYNTHETIC_ZOOM_VIEWS_HPP

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "calib/zoom/zoom_data.hpp"
#include "synthetic/camera.hpp"
#include "synthetic/scene.hpp"

namespace synthetic {

/// One lens over motor positions 300..850.
struct ZoomLens {
    double wide_mm = 8.5, tele_mm = 85, bow_mm = -1.5;  // focal length: a line, bent in the middle
    double ripple_mm = 0, ripple_periods = 6.3, ripple_phase_rad = 0.7;
    double pixel_mm = 0.0032;
    Pixel centre_px{6, -4},
        centre_drift_px{15, -10};  // offset from the image's middle; drift over the zoom
    double centre_ripple_px = 0;
    double barrel_wide = -0.06, barrel_tele = 0.01;  // share of the radius at the corner
    double fourth = 0.01, decentring_px = 0.5;
    double pupil_travel_mm = 25;
    double nearest_focus_mm = 800, focus_drift_per_m = 0.004;
};

struct ZoomCamera {
    ZoomLens lens;
    // At pan 0: rotation of the camera in the world, entrance pupil at the wide end, pan axis.
    Vector turn_rad, pupil_mm, axis_point_mm, axis{0, 1, 0};
};

struct ZoomRig {
    ZoomCamera camera[2];
};

struct ZoomPlan {
    int zooms = 13, boards = 12;
    bool same_boards = false;  // one board at places that all zooms look at; else each zoom its own
    bool log_spaced = false;   // zooms in f; else in counts
    double bow_mm = -1.5;
    double ripple_mm = 0, centre_ripple_px = 0;
    double noise_px = 0.1;
    double reading_counts = 0, settle_counts = 0;  // noise of the read position; of the true one
    // At every second zoom the lenses are focused by their scales, for a board so much nearer
    // (share of its distance), at the others by the picture. 0: all exactly, and how is not noted.
    double scale_error = 0;
    double toe_in_mm = 1800;
    double pan_sigma_rad = 0;  // servos, at each visit
    int pans = 1;              // visits
    // Shares of wrong pictures (the board moved, or its corners numbered from another one) and of
    // wrong corners.
    double wrong_views = 0, wrong_corners = 0;
};

/// Where the motors of one camera truly are.
struct ZoomMoment {
    double zoom = 300, focus = 300, pan_rad = 0;
};

ZoomRig make_zoom_rig(const ZoomPlan &plan, uint64_t seed);

/// The camera at a moment, in the world.
Camera camera_at(const ZoomCamera &camera, const ZoomMoment &moment);

/// Focal length in mm, focused at infinity; and the motor position of one.
double focal_mm(const ZoomLens &lens, double zoom);
double zoom_of_focal(const ZoomLens &lens, double focal_mm);

/// The focus position that shows a distance from the pupil sharply.
double focus_of(const ZoomLens &lens, double zoom, double distance_mm);

/// The nominal pan of a camera whose axis meets the other's at the plan's distance.
double toe_in_rad(const ZoomPlan &plan, int side);

struct ZoomViews {
    calib::zoom_observations seen;
    ZoomRig rig;
    double pan_off_rad[2] = {0, 0};                          // pan error of the last visit
    std::vector<std::string> wrong_views;                    // names of the images
    std::vector<std::pair<std::string, int>> wrong_corners;  // image's name, corner's index
};

ZoomViews make_zoom_views(const ZoomPlan &plan, uint64_t scene_seed, uint64_t noise_seed);

}  // namespace synthetic

#endif
