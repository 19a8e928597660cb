// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <deque>
#include <optional>
#include <stdexcept>
#include <thread>

#include "tools/simrig/render/frame.hpp"
#include "tools/simrig/render/motion.hpp"
#include "tools/simrig/render/nodes.hpp"
#include "tools/simrig/render/sampler.hpp"
#include "tools/simrig/render/sensor.hpp"
#include "tools/simrig/render/smooth.hpp"

namespace world {
namespace {

constexpr int kTile = 8;

// The lens's spot over the field, in steps of the squared radius.
class Spots {
  public:
    struct Spot {
        Aperture aperture;
        double rms_px;
    };
    explicit Spots(const Optics &optics) : optics_(optics) {
        const int steps = optics.spot_corner_px == 0 ? 1 : kSteps;
        for (int i = 0; i < steps; i++) {
            const double part2 = (i + 0.5) / kPerCorner;
            const double px = steps == 1
                                  ? optics.spot_rms_px
                                  : std::hypot(optics.spot_rms_px, optics.spot_corner_px * part2);
            spots_.push_back({Aperture(px), px});
        }
    }
    const Spot &at(Vec2 pixel) const {
        if (spots_.size() == 1) {
            return spots_[0];
        }
        const auto step = static_cast<std::size_t>(kPerCorner * optics_.corner_part2(pixel));
        return spots_[std::min(step, spots_.size() - 1)];
    }

  private:
    // The image centre may lie off the array's, so the radius may exceed the corner's.
    static constexpr int kPerCorner = 32, kSteps = 48;
    const Optics optics_;
    std::vector<Spot> spots_;
};

// What all tiles of a frame share.
struct Job {
    const Scene &scene;
    const RigCamera &rig_camera;
    const Mains &mains;
    const FrameRequest &request;
    Aperture pixel_alone;
    Spots spots;
    double texture;
    PixelReader reader;
    std::uint64_t key;  // of the rays
    double lit_us;      // how long a row is lit, but for the mains: what the rays' number is for
    std::vector<float> &lux;
    Frame &frame;

    std::size_t place(int column, int row) const {
        return static_cast<std::size_t>(row * frame.columns + column);
    }
    std::size_t lux_of(int column, int row) const {
        return place(column, row) *
               static_cast<std::size_t>(request.window.bin_x * request.window.bin_y);
    }

    View view_at(Vec2 pixel) const {
        const Spots::Spot &spot = spots.at(pixel);
        return {&scene, &pixel_alone, &spot.aperture, spot.rms_px, texture};
    }
};

double middle_us(const FrameRequest &request) {
    return 0.5 * (row_start_us(request, 0) +
                  row_start_us(request, request.window.output_rows() - 1) + request.exposure_us);
}

// Illuminance on a pixel for a luminance of 1 before the lens: pi T / (4 N^2), with falloff.
double lux_per_luminance(const Camera &camera, Vec2 slopes) {
    const double n = camera.optics.f_number;
    return kPi * camera.optics.transmission / (4 * n * n) * camera.falloff(slopes);
}

struct Block {
    int column_begin, column_end, row_begin, row_end;  // output pixels

    Vec2 middle(const Window &w) const {
        return 0.5 * (w.centre(column_begin, row_begin) + w.centre(column_end - 1, row_end - 1));
    }
};

// What the block and `around_px` pixels around it may see.
void find_block(const Job &job, const Block &b, State &state, double around_px = 0) {
    const Window &w = job.request.window;
    const Vec2 low = {static_cast<double>(w.array_column(b.column_begin, 0)),
                      static_cast<double>(w.array_row(b.row_begin, 0))};
    const Vec2 high = {static_cast<double>(w.array_column(b.column_end - 1, w.bin_x - 1)),
                       static_cast<double>(w.array_row(b.row_end - 1, w.bin_y - 1))};
    // Pairs of columns overlap when pixels are binned: the last but one may reach further. What red
    // or blue shows at a pixel green shows elsewhere.
    const double margin = around_px + job.spots.at(b.middle(w)).aperture.reach() - 0.5 +
                          2 * std::max(w.bin_x, w.bin_y) - 2 +
                          state.camera.optics.colour_shift_px(b.middle(w));
    find_candidates(job.scene, state.object_camera, beam_of(state.camera, low, high, margin),
                    state.candidates);
}

// Pixels of a block around which corners of pixels, each seen from another place of the pupil's
// rim, hit the same object without a step in depth: probably no edge is near.
class Smoothness {
  public:
    Smoothness(const Job &job, const Block &b, const State &state) : block_(b) {
        const Window &w = job.request.window;
        all_ = state.candidates.size() == 1 && state.candidates[0].covers;
        if (all_ || state.candidates.empty()) {
            return;
        }
        const double shift_px = state.camera.optics.colour_shift_px(b.middle(w));
        margin_ = static_cast<int>(std::ceil(shift_px / std::min(w.skip_x, w.skip_y)));
        columns_ = b.column_end - b.column_begin + 1 + 2 * margin_;
        const Vec2 first = {static_cast<double>(w.array_column(b.column_begin, 0)),
                            static_cast<double>(w.array_row(b.row_begin, 0))};
        const PixelView view = pixel_view(state.camera, first, state.camera.slopes_of(first));
        for (int y = 0; y <= b.row_end - b.row_begin + 2 * margin_; y++) {
            for (int x = 0; x < columns_; x++) {
                // Eight directions of the pupil's rim, where a cut through it begins.
                const double turn = kPi / 4 * ((3 * x + 5 * y + (y / 2) % 2) % 8);
                const Vec2 pupil = {0.98 * std::cos(turn), 0.98 * std::sin(turn)};
                // Between output pixels, which are some array pixels apart when skipping.
                const Vec2 at = {w.array_column(b.column_begin + x - margin_, 0) - first.x - 0.5,
                                 w.array_row(b.row_begin + y - margin_, 0) - first.y - 0.5};
                corners_.push_back(corner_at(view, at, pupil, state.candidates));
            }
        }
        step_ = 5 * view.pixel_slope * std::max(w.skip_x, w.skip_y);
        blur_mm_ = view.pupil_radius_mm;
        focus_mm_ = view.focus_mm;
    }

    // One flat sheet covers the whole block.
    bool all() const { return all_; }

    // z_from: nothing of the pixel is nearer.
    bool at(int column, int row, double &z_from) const {
        z_from = 0;
        if (corners_.empty()) {
            return all_;
        }
        // The pixel's corners and those around them, as far as its colours are shifted.
        const int rows = static_cast<int>(corners_.size()) / columns_;
        const int x0 = column - block_.column_begin + margin_;
        const int y0 = row - block_.row_begin + margin_;
        const int around = 1 + margin_;
        const int first = y0 * columns_ + x0;
        double low = 1e30;
        double high = 0;
        for (int y = std::max(y0 - around, 0); y <= std::min(y0 + 1 + around, rows - 1); y++) {
            for (int x = std::max(x0 - around, 0); x <= std::min(x0 + 1 + around, columns_ - 1);
                 x++) {
                const Corner &corner = corners_[static_cast<std::size_t>(y * columns_ + x)];
                const Corner &own = corners_[static_cast<std::size_t>(first)];
                const Vec3 bend = corner.normal - own.normal;
                if (corner.object != own.object || corner.object == nullptr ||
                    corner.tone != own.tone || dot(bend, bend) > 0.15) {
                    return false;
                }
                low = std::min(low, corner.z);
                high = std::max(high, corner.z);
            }
        }
        const Object &object = *corners_[static_cast<std::size_t>(first)].object;
        if (object.solid == nullptr && object.sheet.bend_per_mm == 0) {
            return true;  // a plane has no step, however far its depth reaches
        }
        z_from = low - (high - low) - 1;
        return high - low <
               (1 + 2 * around) * step_ * low + 5 * blur_mm_ * std::fabs(1 - low / focus_mm_);
    }

  private:
    Block block_;
    bool all_ = false;
    int columns_ = 0;
    int margin_ = 0;  // number of corners around the block on each side
    double step_ = 0;
    double blur_mm_ = 0;
    double focus_mm_ = 1;
    std::vector<Corner> corners_;
};

// Of the light at the corners of a block that one flat sheet covers.
BlockLight light_of_block(const Job &job, const Block &b, const View &view, const State &state) {
    const Window &w = job.request.window;
    BlockLight light;
    for (int i = 0; i < 4; i++) {
        const int column = i % 2 == 0 ? b.column_begin : b.column_end;
        const int row = i / 2 == 0 ? b.row_begin : b.row_end;
        const Vec2 pixel = {static_cast<double>(w.array_column(column, 0)),
                            static_cast<double>(w.array_row(row, 0))};
        light.corner[i] =
            light_on_sheet(view, pixel_view(state.camera, pixel, state.camera.slopes_of(pixel)),
                           state.candidates[0]);
    }
    return light;
}

// Of one body that fills a block: its pixels' middles at the corners, and the middle's.
Patch patch_of_block(const Job &job, const Block &b, const View &view, const State &state) {
    const Window &w = job.request.window;
    PixelView views[5];
    for (int i = 0; i < 5; i++) {
        const Vec2 part = i == 4 ? Vec2{0.5, 0.5} : Vec2{double(i % 2), double(i / 2)};
        const Vec2 low = {double(w.array_column(b.column_begin, 0)),
                          double(w.array_row(b.row_begin, 0))};
        const Vec2 high = {double(w.array_column(b.column_end, 0)),
                           double(w.array_row(b.row_end, 0))};
        const Vec2 pixel = {low.x + part.x * (high.x - low.x), low.y + part.y * (high.y - low.y)};
        views[i] = pixel_view(state.camera, pixel, state.camera.slopes_of(pixel));
    }
    return find_patch(view, views, state.candidates);
}

// A block as it is seen at one moment.
class BlockAtMoment {
  public:
    // `state` has the block's candidates.
    BlockAtMoment(const Job &job, const Block &b, const View &view, const State &state)
        : job_(job), block_(b), view_(view), state_(state), smoothness_(job, b, state) {
        if (smoothness_.all()) {
            light_ = light_of_block(job, b, view, state);
        }
    }

    // Whether an output pixel is smooth; then nothing of it is nearer than z_from.
    bool smooth(int column, int row, double &z_from) {
        if (!smoothness_.at(column, row, z_from)) {
            return false;
        }
        if (!smoothness_.all() && !patch_) {
            patch_ = patch_of_block(job_, block_, view_, state_);
        }
        return true;
    }

    // Of the next array pixel: `at` has what was seen of the one before.
    void see(Vec2 pixel, int channel, bool smooth, double z_from, PixelMoment &at) const {
        const Vec2 guess = at.view.slopes + Vec2{at.view.step[0], at.view.step[2]};
        at.view = pixel_view(state_.colour[channel], pixel, guess);
        at.candidates = &state_.candidates;
        at.z_from = z_from;
        at.block_light = smooth && smoothness_.all() ? &light_ : nullptr;
        const bool patched = smooth && patch_ && patch_->candidate != nullptr;
        at.patch = patched ? &*patch_ : nullptr;
        if (at.block_light == nullptr && at.patch == nullptr) {
            return;
        }
        const Window &w = job_.request.window;
        const int column = w.array_column(block_.column_begin, 0);
        const int row = w.array_row(block_.row_begin, 0);
        const Vec2 seen = pixel + state_.camera.optics.colour_shift(pixel, channel);
        at.block_place = {(seen.x - column) / (w.array_column(block_.column_end, 0) - column),
                          (seen.y - row) / (w.array_row(block_.row_end, 0) - row)};
    }

  private:
    const Job &job_;
    const Block &block_;
    const View &view_;
    const State &state_;
    Smoothness smoothness_;
    BlockLight light_;
    std::optional<Patch> patch_;
};

// What the pixels of a block share.
class BlockOfPixels {
  public:
    // `states`: of all moments of its exposure. `pitch`: of the nodes, 0: none.
    BlockOfPixels(const Job &job, const Block &b, std::vector<State> &states, Nodes &nodes,
                  int pitch)
        : job_(job),
          nodes_(nodes),
          pitch_(pitch),
          view_(job.view_at(b.middle(job.request.window))),
          states_(states),
          z_from_(states.size()),
          seen_(states.size()) {
        for (State &state : states) {
            find_block(job, b, state);
            moments_.emplace_back(job, b, view_, state);
        }
    }

    void render(int column, int row) {
        const Window &w = job_.request.window;
        std::size_t at = job_.lux_of(column, row);
        smooth_ = true;
        for (std::size_t i = 0; i < moments_.size() && smooth_; i++) {
            smooth_ = moments_[i].smooth(column, row, z_from_[i]);
        }
        for (int j = 0; j < w.bin_y; j++) {
            for (int i = 0; i < w.bin_x; i++) {
                job_.lux[at++] =
                    static_cast<float>(lux(w.array_column(column, i), w.array_row(row, j)));
            }
        }
    }

  private:
    // On one array pixel, the mean of all moments of its exposure.
    double lux(int x, int y) {
        PixelTask task;
        task.channel = bayer_channel(bayer_place(x, y));
        task.starts_smooth = smooth_;
        task.moments = &seen_;
        double lux = 0;  // for a luminance of 1
        for (std::size_t i = 0; i < moments_.size(); i++) {
            moments_[i].see({static_cast<double>(x), static_cast<double>(y)}, task.channel, smooth_,
                            z_from_[i], seen_[i]);
            lux += lux_per_luminance(states_[i].camera, seen_[i].view.slopes);
        }
        task.key =
            mixed(job_.key, static_cast<std::uint64_t>(y) << 32 | static_cast<std::uint64_t>(x));
        lux /= static_cast<double>(moments_.size());
        task.electrons_per_luminance =
            lux * electrons_per_lux(job_.rig_camera.sensor, task.channel, job_.lit_us);
        return luminance(task, {static_cast<double>(x), static_cast<double>(y)}) * lux;
    }

    // Far out of focus, where one ray does not do, it is that between the nodes.
    double luminance(const PixelTask &task, Vec2 pixel) {
        double smooth = 0;
        if (pitch_ == 0) {
            return pixel_luminance(view_, task);
        }
        if (smooth_pixel_luminance(view_, task, smooth)) {
            return smooth;
        }
        const Optics &optics = states_[0].camera.optics;
        return nodes_.luminance(pixel + optics.colour_shift(pixel, task.channel), task.channel,
                                pitch_);
    }

    const Job &job_;
    Nodes &nodes_;
    const int pitch_;
    const View view_;
    const std::vector<State> &states_;
    std::deque<BlockAtMoment> moments_;
    std::vector<double> z_from_;
    std::vector<PixelMoment> seen_;
    bool smooth_ = false;
};

// The scene's light in the middle of a row's exposure.
double share_of_light(const FrameRequest &request, int row) {
    const double middle_us = row_start_us(request, row) + 0.5 * request.exposure_us;
    return request.light ? request.light(middle_us) : 1;
}

// The numbers of a row whose light is known.
void read_row(const Job &job, int row) {
    const Window &w = job.request.window;
    const int binned = w.bin_x * w.bin_y;
    const double lit_us =
        share_of_light(job.request, row) *
        lit_time_us(job.mains, row_start_us(job.request, row), job.request.exposure_us);
    double electrons[3];
    for (int c = 0; c < 3; c++) {
        electrons[c] = electrons_per_lux(job.rig_camera.sensor, c, lit_us);
    }
    std::size_t at = job.lux_of(0, row);
    for (int column = 0; column < job.frame.columns; column++) {
        double sum = 0;
        const int place = bayer_place(w.array_column(column, 0), w.array_row(row, 0));
        for (int j = 0; j < w.bin_y; j++) {
            for (int i = 0; i < w.bin_x; i++) {
                const double mean = electrons[bayer_channel(place)] * double(job.lux[at++]);
                sum += job.reader.collected(mean, w.array_column(column, i), w.array_row(row, j));
            }
        }
        job.frame.pixels[job.place(column, row)] = job.reader.number(
            sum / binned, binned, place, w.array_column(column, 0), w.array_row(row, 0));
    }
}

// Blocks are those of the whole array where no pixel is left out, so that a window shows what the
// whole frame would.
int first_of_blocks(int first, int skip) {
    return skip == 1 ? -(first % kTile) : 0;
}

// All blocks of some rows, which have their moments together.
void render_rows(const Job &job, Motion &motion, Nodes &nodes, int top, int bottom) {
    const Window &w = job.request.window;
    for (int left = first_of_blocks(w.column, w.skip_x); left < job.frame.columns; left += kTile) {
        const Block block = {left, left + kTile, top, bottom};
        State &first = motion.states(1)[0];
        find_block(job, block, first, kTile);
        const int pitch =
            w.skip_x * w.skip_y == 1 ? Nodes::pitch_for(motion.least_blur_px(first.candidates)) : 0;
        const int moments = motion.moments(block.middle(w), first.candidates);
        BlockOfPixels pixels(job, block, motion.states(moments), nodes, pitch);
        for (int row = std::max(top, 0); row < std::min(bottom, job.frame.rows); row++) {
            for (int column = std::max(left, 0);
                 column < std::min(block.column_end, job.frame.columns); column++) {
                pixels.render(column, row);
            }
        }
    }
}

void render_strip(const Job &job, Nodes &nodes, int top) {
    const int begin = std::max(top, 0);
    const int end = std::min(top + kTile, job.frame.rows);
    Motion motion(job.scene, job.rig_camera, job.request, begin, end);
    if (motion.rows_alike()) {
        render_rows(job, motion, nodes, top, top + kTile);
        return;
    }
    for (int row = begin; row < end; row++) {
        Motion of_row(job.scene, job.rig_camera, job.request, row, row + 1);
        render_rows(job, of_row, nodes, row, row + 1);
    }
}

bool lies_on_the_array(const Window &window) {
    return window.column >= 0 && window.row >= 0 && window.columns >= 2 && window.rows >= 2 &&
           window.column + window.columns <= kArrayColumns &&
           window.row + window.rows <= kArrayRows;
}

bool can_skip(int skip, int bin) {
    return skip >= 1 && skip <= 16 && bin >= 1 && bin <= skip;
}

void check(const FrameRequest &request) {
    if (request.window.fault() != nullptr) {
        throw std::invalid_argument(request.window.fault());
    }
    if (!request.mechanics) {
        throw std::invalid_argument("mechanics is empty");
    }
}

}  // namespace

const char *Window::fault() const {
    if (!lies_on_the_array(*this)) {
        return "the window is not within the array";
    }
    if ((column | row | columns | rows) % 2 != 0) {
        return "the window's position and size must be even";
    }
    if (!can_skip(skip_x, bin_x) || !can_skip(skip_y, bin_y)) {
        return "skip must be 1 to 16, and bin 1 to skip";
    }
    if (output_columns() < 2 || output_rows() < 2) {
        return "the window is empty after skipping";
    }
    return nullptr;
}

namespace {

// Of the whole frame.
bool is_still(const FrameRequest &request, Mechanics &mechanics) {
    constexpr int kSteps = 64;
    const double begin_us = row_start_us(request, 0);
    const double end_us =
        row_start_us(request, request.window.output_rows() - 1) + request.exposure_us;
    mechanics = request.mechanics(begin_us);
    for (int i = 1; i <= kSteps; i++) {
        if (!(request.mechanics(begin_us + (end_us - begin_us) * i / kSteps) == mechanics)) {
            return false;
        }
    }
    return true;
}

}  // namespace

Frame render(const Scene &scene, const Rig &rig, Side side, const FrameRequest &request,
             StillLight *kept) {
    check(request);
    Frame frame;
    frame.columns = request.window.output_columns();
    frame.rows = request.window.output_rows();
    frame.pixels.resize(static_cast<std::size_t>(frame.columns * frame.rows));
    const RigCamera &rig_camera = rig.of(side);
    const std::uint64_t key = mixed(request.seed, static_cast<std::uint64_t>(side));
    const std::uint64_t noise_key = mixed(key, request.frame);
    // An iris that moves meanwhile has the spot of the frame's middle.
    const Optics optics = camera_at(rig_camera, request.mechanics(middle_us(request))).optics;
    StillLight light = {&scene, side, request.window, {}, request.seed, 0, {}};
    light.lit_us = share_of_light(request, frame.rows / 2) * request.exposure_us;
    const bool still = is_still(request, light.mechanics);
    const bool known = still && kept != nullptr && kept->of(light);
    if (known) {
        light.lux.swap(kept->lux);
    } else {
        light.lux.resize(frame.pixels.size() *
                         static_cast<std::size_t>(request.window.bin_x * request.window.bin_y));
    }
    // The rays of cameras at rest do not depend on the frame, so that it need not be rendered.
    const Job job = {scene,
                     rig_camera,
                     rig.mains,
                     request,
                     Aperture(0),
                     Spots(optics),
                     rig.texture,
                     PixelReader(rig_camera.sensor, request.gains, mixed(noise_key)),
                     still ? key : noise_key,
                     light.lit_us,
                     light.lux,
                     frame};
    std::atomic<int> next{0};
    const int first = first_of_blocks(request.window.row, request.window.skip_y);
    const auto work = [&] {
        Nodes nodes(
            scene, rig_camera, request, [&job](Vec2 pixel) { return job.view_at(pixel); }, job.key);
        for (int top = first + kTile * next++; top < frame.rows; top = first + kTile * next++) {
            if (!known) {
                render_strip(job, nodes, top);
            }
            for (int row = std::max(top, 0); row < std::min(top + kTile, frame.rows); row++) {
                read_row(job, row);
            }
        }
    };
    std::vector<std::thread> pool;
    for (int i = 1; i < request.threads; i++) {
        pool.emplace_back(work);
    }
    work();
    for (std::thread &thread : pool) {
        thread.join();
    }
    if (kept != nullptr && still) {
        *kept = std::move(light);
    }
    return frame;
}

}  // namespace world
