// SPDX-License-Identifier: Apache-2.0
/// The zoom rig's parameters as one vector, and what they make of one camera at one setting.
///
/// Parameters that all captures share: for each camera the terms of the lens functions, their
/// deviation at each setting of the zoom (a random effect), focus terms, mount, and the angle by
/// which the servo was off in each visit; for each board its warp. Each board position has
/// parameters of its own: its pose, and how far each reading of a zoom position was off.
#ifndef VERGENCE_CALIB_ZOOM_ZOOM_MODEL_HPP
#define VERGENCE_CALIB_ZOOM_ZOOM_MODEL_HPP

#include <array>
#include <vector>

#include "calib/bundle/bundle.hpp"
#include "calib/zoom/zoom_data.hpp"
#include "stereo/zoom/zoom_calibration.h"

namespace calib {

using zoom_orders = std::array<int, ZOOM_FUNCTIONS>;  // number of terms

/// One camera's scales and clusters of zoom positions.
struct zoom_side {
    lens_frame frame;
    double pixel_mm = 0;
    zoom_range zoom{}, focus{}, log_focal{};
    std::vector<double> settings;  // mean position of each, counts
};

/// The measurements in the solver's form.
struct zoom_problem {
    struct capture {
        size_t board, place;  // `place`: index of the board position
        int visit;
        // Of the dioptre at which the lenses were focused, at a long focal length, 1/m; 0: unknown.
        double focused_sigma;
        std::array<int, CAMERAS> setting;
        std::array<zoom_axes, CAMERAS> axes;
        std::array<bundle_view, CAMERAS> view;
    };
    struct place {
        size_t board;
        std::vector<size_t> captures;
    };
    std::array<zoom_side, CAMERAS> side;
    std::vector<std::array<bundle, CAMERAS>> boards;  // points, and as RIGHT each camera's frame
    std::vector<capture> captures;
    std::vector<place> places;
    int visits = 0;
    double pan_sigma_rad = 0;
    bool reading_noise = true;  // false: positions are exact, and there are no latents
};

/// How one view differs from others at the same setting and visit.
enum zoom_latent {
    LATENT_READING,   // true minus read zoom position, counts
    LATENT_CENTRE_X,  // the lens does not return to quite the same place, px
    LATENT_CENTRE_Y,
    LATENT_PAN,  // the servo creeps, rad
    LATENTS
};
using zoom_latents = std::array<double, LATENTS>;

/// Where each parameter is.
class zoom_layout {
  public:
    zoom_layout() = default;
    zoom_layout(const zoom_problem &problem, const zoom_orders &orders);

    int size() const { return size_; }
    const zoom_orders &orders() const { return orders_; }
    /// First of the terms. The pupil has no constant term.
    int terms_at(int camera, int function) const { return at_[size_t(camera)].terms[function]; }
    int estimated_terms(int function) const {
        return orders_[size_t(function)] - (function == ZOOM_PUPIL && orders_[ZOOM_PUPIL] > 0);
    }
    /// -1: this function has no deviations.
    int effect_at(int camera, int function, int setting) const;
    int settings(int camera) const { return settings_[camera]; }
    /// Of the focus terms.
    int focus_at(int camera) const { return at_[size_t(camera)].focus; }
    /// -1: fixed (the left camera is the frame).
    int mount_at(int camera, int parameter) const;
    int pan_at(int camera, int visit) const { return at_[size_t(camera)].pan + visit; }
    int warp_at(size_t board) const { return warp_ + int(board) * WARP_PARAMETERS; }
    int visits() const { return visits_; }
    int boards() const { return boards_; }
    /// Index of the first parameter that is a deviation of a setting; they are the last ones.
    int first_effect() const { return first_effect_; }
    /// Change of a parameter from which derivatives are computed: small enough for the curvature
    /// not to matter, large enough for rounding.
    double step(int column) const { return steps_[size_t(column)]; }
    /// Parameters that a view of this camera at this setting and visit depends on.
    std::vector<int> columns(int camera, int setting, int visit) const;

  private:
    struct camera_places {
        int terms[ZOOM_FUNCTIONS], effects[ZOOM_FUNCTIONS], focus, mount, pan;
    };
    zoom_orders orders_{};
    std::array<camera_places, CAMERAS> at_{};
    int settings_[CAMERAS] = {0, 0}, warp_ = 0, size_ = 0, visits_ = 0, boards_ = 0;
    int first_effect_ = 0;
    std::vector<double> steps_;
};

/// The functions that deviate from their smooth curves from setting to setting.
bool zoom_deviates(int function);

/// The `lens_parameter` that a function of the lens is; -1: none.
int zoom_lens_parameter(int function);

/// What is known of the parameters beforehand: gaussian, independent.
struct zoom_prior {
    std::vector<double> mean, sigma;  // mean and sigma of each shared parameter
    /// 0: there is no such difference. Either all are 0 or none.
    std::array<zoom_latents, CAMERAS> latent_sigma{};

    bool has_latents() const { return latent_sigma[0][0] > 0; }
};

struct zoom_estimate {
    std::vector<double> shared;
    std::vector<rigid> T_instrument_board;                  // board poses by place
    std::vector<std::array<zoom_latents, CAMERAS>> latent;  // latents by capture
};

/// One camera at one setting: lens and pose.
struct posed_camera {
    lens_state lens;
    rigid T_camera_instrument;
    double focal_px = 0;       // focused at infinity
    double focus_dioptre = 0;  // 1/m
};

struct zoom_view_state {
    int camera;
    int setting, visit;  // -1: none, without its deviations
    zoom_axes axes;
};

/// One camera's model from the shared parameters; centres from the middle of the frame; without
/// frame, irregularities and sigmas.
zoom_camera zoom_camera_of(const zoom_problem &problem, const zoom_layout &layout,
                           const double *shared, int camera);

posed_camera camera_at(const zoom_problem &problem, const zoom_layout &layout, const double *shared,
                       const zoom_view_state &view_state, const zoom_latents &latent);

/// Focal length in px, focused at infinity.
double focal_at(const zoom_problem &problem, const zoom_layout &layout, const double *shared,
                int camera, int setting, double zoom_counts);

/// The state of one view of a capture.
zoom_view_state view_state_of(const zoom_problem::capture &capture, int camera);

}  // namespace calib

#endif
