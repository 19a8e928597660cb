// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "calib/zoom/zoom_seed.hpp"

namespace calib {

namespace {

class prior_maker {
  public:
    prior_maker(const zoom_problem &problem, const zoom_layout &layout, const zoom_estimate &start)
        : problem_(problem), layout_(layout), start_(start) {
        prior_.mean.assign(size_t(layout.size()), 0);
        prior_.sigma.assign(size_t(layout.size()), 1);
    }

    zoom_prior run() {
        for (int camera = 0; camera < CAMERAS; camera++) {
            add_lens(camera);
            add_mount(camera);
            if (problem_.reading_noise) {
                prior_.latent_sigma[size_t(camera)] = {0.5, 0.5, 0.5, 1e-4};
            }
        }
        for (size_t board = 0; board < problem_.boards.size(); board++) {
            const double half_mm = problem_.boards[board][LEFT].half_mm[0];
            for (int i = 0; i < WARP_PARAMETERS; i++) {
                set(layout_.warp_at(board) + i, 0,
                    i == board_model::STRETCH ? 5e-4 * half_mm : 2e-3 * half_mm);
            }
        }
        return prior_;
    }

  private:
    void set(int at, double mean, double sigma) {
        prior_.mean[size_t(at)] = mean;
        prior_.sigma[size_t(at)] = sigma;
    }

    void keep(int at, double sigma) { set(at, start_.shared[size_t(at)], sigma); }

    void add_lens(int camera) {
        // px, 1/m, px, px, px, px, px, px, px, mm
        static const double of_term[ZOOM_FUNCTIONS] = {1e5, 0.02, 100, 100, 100, 50, 20, 5, 5, 25};
        static const double of_effect[ZOOM_FUNCTIONS] = {30, 0, 10, 10, 3, 3, 0, 0, 0, 3};
        for (int function = 0; function < ZOOM_FUNCTIONS; function++) {
            // The pupil moves smoothly: of Chebyshev's terms each is some times smaller.
            const double decay = function == ZOOM_PUPIL ? 0.33 : 1;
            for (int i = 0; i < layout_.estimated_terms(function); i++) {
                set(layout_.terms_at(camera, function) + i, 0,
                    of_term[function] * std::pow(decay, i));
            }
            for (int k = 0; k < layout_.settings(camera); k++) {
                const int effect = layout_.effect_at(camera, function, k);
                if (effect >= 0) {
                    set(effect, 0, of_effect[function]);
                }
            }
        }
        // How far the lens is focused at the middle of its range, and over half of the range.
        keep(layout_.terms_at(camera, ZOOM_FOCUS_DIOPTRE), 1);
        set(layout_.focus_at(camera), 0, 1);
        set(layout_.focus_at(camera) + 1, 0, 0.1);
    }

    void add_mount(int camera) {
        static const double sigma[ZOOM_MOUNT_PARAMETERS] = {0.02, 0.02, 30,  60,  0.03, 1,
                                                            1,    1,    1e4, 1e4, 1e4};
        for (int i = 0; i < ZOOM_MOUNT_PARAMETERS; i++) {
            const int place = layout_.mount_at(camera, i);
            if (place >= 0) {
                keep(place, sigma[i]);
            }
        }
        for (int visit = 0; visit < problem_.visits; visit++) {
            set(layout_.pan_at(camera, visit), 0, problem_.pan_sigma_rad);
        }
    }

    const zoom_problem &problem_;
    const zoom_layout &layout_;
    const zoom_estimate &start_;
    zoom_prior prior_;
};

}  // namespace

zoom_prior wide_prior(const zoom_problem &problem, const zoom_layout &layout,
                      const zoom_estimate &start) {
    return prior_maker(problem, layout, start).run();
}

}  // namespace calib
