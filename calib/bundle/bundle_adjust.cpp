// SPDX-License-Identifier: Apache-2.0
// Supplies the residuals that Ceres minimises. One residual block holds all corners that one camera
// sees of one board position. Lens, rig, warp and position are separate parameter blocks, so that
// each can be shared. Poses are increments on a base that is fixed during one run, so no block
// needs a manifold.
#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <cmath>
#include <memory>

#include "calib/bundle/bundle.hpp"
#include "core/invariant.h"

namespace calib {

namespace {

using row_major = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Scales the rows of one corner so that half their squared norm is Cauchy's loss: the residual r
// becomes m(|r|) r / |r| with m = sqrt(rho).
// Source: B. Triggs et al., "Bundle adjustment - a modern synthesis", 2000, section 4.3.
struct corner_loss {
    double along = 1, across = 1, unit[2] = {1, 0}, shrink = 1;

    corner_loss(const double residual[2], double scale) {
        const double length2 = residual[0] * residual[0] + residual[1] * residual[1];
        const double ratio = scale > 0 ? length2 / (scale * scale) : 0;
        if (ratio < 1e-12) {
            return;
        }
        const double length = std::sqrt(length2);
        const double m = scale * std::sqrt(std::log1p(ratio));
        unit[0] = residual[0] / length;
        unit[1] = residual[1] / length;
        shrink = m / length;
        across = shrink;
        along = length / ((1 + ratio) * m);
    }

    void turn(double *x, double *y) const {
        const double radial = unit[0] * *x + unit[1] * *y;
        const double extra = (along - across) * radial;
        *x = across * *x + extra * unit[0];
        *y = across * *y + extra * unit[1];
    }
};

// Parameter blocks: lens, board increment, warp and, for the right camera, the rig's increment.
class view_cost final : public ceres::CostFunction {
  public:
    view_cost(const bundle &data, size_t capture, int camera, const bundle_state &base,
              double loss_scale)
        : data_(data),
          view_(data.captures[capture][size_t(camera)]),
          camera_(camera),
          kind_(base.lens[camera].kind),
          T_left_board_(base.T_left_board[capture]),
          T_right_left_(base.T_right_left),
          loss_scale_(loss_scale) {
        set_num_residuals(2 * view_.used_count());
        INVARIANT(loss_scale >= 0 && capture < base.T_left_board.size());
        *mutable_parameter_block_sizes() = {LENS_PARAMETERS, POSE_PARAMETERS, WARP_PARAMETERS};
        if (camera == RIGHT) {
            mutable_parameter_block_sizes()->push_back(POSE_PARAMETERS);
        }
    }

    bool Evaluate(double const *const *parameters, double *residuals,
                  double **jacobians) const override {
        static const double still[POSE_PARAMETERS] = {0, 0, 0, 0, 0, 0};
        const double *rig_increment = camera_ == RIGHT ? parameters[3] : still;
        lens_state lens;
        std::copy_n(parameters[0], int(LENS_PARAMETERS), lens.value.begin());
        lens.kind = kind_;
        const rigid T_left_board = moved_board(T_left_board_, parameters[1]);
        const rigid T_right_left = moved_rig(T_right_left_, rig_increment);
        turn_factors factors;
        left_jacobian(parameters[1], factors.board);
        left_jacobian(rig_increment, factors.rig);
        int row = 0;
        for (const bundle_corner &corner : view_.corners) {
            if (!corner.used) {
                continue;
            }
            corner_rows rows;
            if (!make_corner_rows(data_, camera_, corner, lens, T_left_board, T_right_left,
                                  parameters[2], &rows)) {
                return false;
            }
            store(rows, corner.sigma_px, factors, row, residuals, jacobians);
            row += 2;
        }
        INVARIANT(row == num_residuals());
        return true;
    }

  private:
    // Derivatives of the rotations by the increments, computed once per block.
    struct turn_factors {
        double board[9], rig[9];
    };

    void store(const corner_rows &rows, double sigma_px, const turn_factors &factors, int row,
               double *residuals, double **jacobians) const {
        INVARIANT(sigma_px > 0 && row + 1 < num_residuals());
        const double weight = 1 / sigma_px;
        double residual[2] = {weight * rows.residual_px[0], weight * rows.residual_px[1]};
        const corner_loss loss(residual, loss_scale_);
        residuals[row] = loss.shrink * residual[0];
        residuals[row + 1] = loss.shrink * residual[1];
        if (jacobians == nullptr) {
            return;
        }
        store_block(rows.by_lens, weight, loss, nullptr, row, jacobians[0]);
        store_block(rows.by_board, weight, loss, factors.board, row, jacobians[1]);
        store_block(rows.by_warp, weight, loss, nullptr, row, jacobians[2]);
        if (camera_ == RIGHT) {
            store_block(rows.by_rig, weight, loss, factors.rig, row, jacobians[3]);
        }
    }

    // `turn`, if set, is applied to the first three columns of a pose.
    template <int Columns>
    static void store_block(const double (&rows)[2][Columns], double weight,
                            const corner_loss &loss, const double *turn, int row,
                            double *jacobian) {
        if (jacobian == nullptr) {
            return;
        }
        double *x = jacobian + row * Columns, *y = x + Columns;
        for (int i = 0; i < Columns; i++) {
            double along[2] = {rows[0][i], rows[1][i]};
            if constexpr (Columns == POSE_PARAMETERS) {
                for (int axis = 0; turn != nullptr && i < 3 && axis < 2; axis++) {
                    along[axis] = rows[axis][0] * turn[i] + rows[axis][1] * turn[3 + i] +
                                  rows[axis][2] * turn[6 + i];
                }
            }
            x[i] = weight * along[0];
            y[i] = weight * along[1];
            loss.turn(&x[i], &y[i]);
        }
    }

    const bundle &data_;
    const bundle_view &view_;
    const int camera_;
    const lens_kind kind_;
    const rigid T_left_board_, T_right_left_;
    const double loss_scale_;
};

// The blocks that Ceres varies.
struct blocks {
    lens_state lens[CAMERAS];
    double rig[POSE_PARAMETERS] = {0, 0, 0, 0, 0, 0};
    double warp_mm[WARP_PARAMETERS];
    std::vector<std::array<double, POSE_PARAMETERS>> board;
};

template <size_t Parameters>
void hold(const std::array<bool, Parameters> &free, double *block, ceres::Problem *problem) {
    std::vector<int> constant;
    for (size_t parameter = 0; parameter < Parameters; parameter++) {
        if (!free[parameter]) {
            constant.push_back(int(parameter));
        }
    }
    if (constant.size() == Parameters) {
        problem->SetParameterBlockConstant(block);
    } else if (!constant.empty()) {
        problem->SetManifold(block, new ceres::SubsetManifold(int(Parameters), constant));
    }
}

// Returns the number of residuals.
int describe(const bundle &data, const bundle_options &options, const bundle_state &base,
             blocks *moving, ceres::Problem *problem, ceres::ParameterBlockOrdering *ordering) {
    bool sees[CAMERAS] = {false, false};
    INVARIANT(moving->board.size() == data.captures.size());
    for (size_t i = 0; i < data.captures.size(); i++) {
        for (int camera = 0; camera < data.cameras; camera++) {
            if (!data.captures[i][size_t(camera)].used) {
                continue;
            }
            std::vector<double *> parameters = {moving->lens[camera].value.data(),
                                                moving->board[i].data(), moving->warp_mm};
            if (camera == RIGHT) {
                parameters.push_back(moving->rig);
            }
            problem->AddResidualBlock(new view_cost(data, i, camera, base, options.loss_scale),
                                      nullptr, parameters);
            ordering->AddElementToGroup(moving->board[i].data(), 0);
            sees[camera] = true;
        }
    }
    for (int camera = 0; camera < CAMERAS; camera++) {
        if (sees[camera]) {
            hold(options.free_lens, moving->lens[camera].value.data(), problem);
            ordering->AddElementToGroup(moving->lens[camera].value.data(), 1);
        }
    }
    if (sees[LEFT] || sees[RIGHT]) {
        ordering->AddElementToGroup(moving->warp_mm, 1);
        hold(options.free_warp, moving->warp_mm, problem);
    }
    if (sees[RIGHT]) {
        ordering->AddElementToGroup(moving->rig, 1);
    }
    return problem->NumResiduals();
}

}  // namespace

bundle_summary adjust(const bundle &data, const bundle_options &options, bundle_state *state) {
    INVARIANT(data.cameras == 1 || data.cameras == CAMERAS);
    INVARIANT(state->T_left_board.size() == data.captures.size());
    INVARIANT(options.max_iterations > 0 && options.tolerance > 0);
    blocks moving;
    moving.lens[LEFT] = state->lens[LEFT];
    moving.lens[RIGHT] = state->lens[RIGHT];
    std::copy_n(state->warp_mm, int(WARP_PARAMETERS), moving.warp_mm);
    moving.board.assign(data.captures.size(), {});
    ceres::Problem problem;
    ceres::Solver::Options solver;
    solver.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    if (describe(data, options, *state, &moving, &problem, solver.linear_solver_ordering.get()) ==
        0) {
        return {};
    }
    solver.linear_solver_type = ceres::DENSE_SCHUR;
    solver.num_threads = 1;  // the order of summation would depend on more threads
    solver.max_num_iterations = options.max_iterations;
    solver.function_tolerance = options.tolerance;
    solver.parameter_tolerance = 1e-12;
    solver.gradient_tolerance = 1e-14;
    solver.initial_trust_region_radius = 1e6;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);

    state->lens[LEFT] = moving.lens[LEFT];
    state->lens[RIGHT] = moving.lens[RIGHT];
    std::copy_n(moving.warp_mm, int(WARP_PARAMETERS), state->warp_mm);
    for (const lens_state &lens : state->lens) {  // the solver takes no step that is not finite
        INVARIANT(std::isfinite(lens.value[LOG_FOCAL]));
    }
    state->T_right_left = moved_rig(state->T_right_left, moving.rig);
    orthonormalise(state->T_right_left.R);
    for (size_t i = 0; i < data.captures.size(); i++) {
        if (data.used(i)) {
            state->T_left_board[i] = moved_board(state->T_left_board[i], moving.board[i].data());
            orthonormalise(state->T_left_board[i].R);
        }
    }
    return {summary.termination_type == ceres::CONVERGENCE, summary.final_cost,
            int(summary.iterations.size())};
}

}  // namespace calib
