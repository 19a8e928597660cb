// SPDX-License-Identifier: Apache-2.0
/// What a calibration capture has covered so far, and where the board should stand next. Nominal
/// lenses are good enough for both.
#ifndef VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_PLAN_HPP
#define VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_PLAN_HPP

#include <array>
#include <string>
#include <vector>

#include "tools/host/capture/capture_session.hpp"

/// The instrument, nominally.
struct capture_optics {
    double focal_wide_mm = 8.5, focal_tele_mm = 85, pixel_mm = 0.0032, focus_nearest_mm = 800;
    double zoom_min = 300, zoom_max = 850;  // counts, of the two focal lengths
    double f_number = 8;
    double baseline_mm = 250;
    int width_px = 2048, height_px = 1536;  // whole sensor of a camera behind a bridge

    double focal_mm(double counts) const;
    double focal_px(double counts) const { return focal_mm(counts) / pixel_mm; }
};

enum { CAPTURE_CORNERS_MIN = 12, CAPTURE_BOARDS_WANTED = 4, CAPTURE_CELLS = 12 };

/// `count` zooms from `first` to `last` (counts), equally spaced in the logarithm of the focal
/// length.
std::vector<int> capture_zooms(const capture_optics &optics, double first, double last, int count);

/// The zoom nearest to a position.
int capture_zoom_index(const std::vector<int> &zooms, double counts);

/// Where a board is, judged by the middle of its corners: its distance along the axis, and how much
/// it is tilted. False: too few corners.
struct capture_look {
    double x_px = 0, y_px = 0;                        // middle of the corners
    double distance_mm = 0, tilt_deg = 0, scale = 0;  // px a mm
};
bool capture_look_at(const calib::board &board, const calib::board_view &view, double focal_px,
                     capture_look *look);

/// Corners of a view that stay in the frame when the focal length grows by `ratio`.
int capture_corners_after_zoom(const capture_optics &optics, const calib::board_view &view,
                               double ratio);

/// Board positions in a frame: from the point between the cameras, x right, y down, z forward; mm,
/// and degrees about these axes, of the middle of the board facing the cameras.
struct capture_place {
    double x_mm = 0, y_mm = 0, z_mm = 0;
    double turn_deg[3] = {0, 0, 0};
    bool aim = false;  // the cameras turn to it, so that long focal lengths see it
};

/// How often each part of each picture was covered at each zoom.
struct capture_coverage {
    struct camera {
        int boards = 0;
        std::array<int, CAPTURE_CELLS> cells{};     // four columns of three
        std::vector<std::array<double, 2>> points;  // corners, for the drawing
    };
    std::vector<std::array<camera, 2>> zoom;
    std::vector<capture_place> tried;  // planned places of the positions before
};

capture_coverage capture_coverage_of(const capture_optics &optics, const std::vector<int> &zooms,
                                     const std::vector<capture_shot> &shots);

/// The place that adds most. `pan_deg`: where the cameras are turned now.
capture_place capture_next_place(const capture_optics &optics, const std::vector<int> &zooms,
                                 const calib::board &board, const capture_coverage &covered,
                                 const std::array<double, 2> &pan_deg, double near_mm,
                                 double far_mm);

/// The places that were planned for the positions of these shots, for a capture that is resumed.
std::vector<capture_place> capture_places_before(const capture_optics &optics,
                                                 const std::vector<int> &zooms,
                                                 const calib::board &board,
                                                 const std::vector<capture_shot> &shots,
                                                 double near_mm, double far_mm);

/// "1.80 m away, 12 cm right of the middle between the cameras, ..." for a person.
std::string capture_place_text(const capture_place &place);

/// The drawing: for each zoom what is covered, and the next place, in front of the instrument and
/// from above. Null: the capture is complete.
std::string capture_drawing(const capture_optics &optics, const std::vector<int> &zooms,
                            const calib::board &board, const capture_coverage &covered,
                            const capture_place *next, const std::array<double, 2> &pan_deg);

#endif
