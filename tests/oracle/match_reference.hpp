// SPDX-License-Identifier: Apache-2.0
/// A slow and plain reimplementation of the matcher's finest level: whole volumes of doubles, one
/// loop per formula, no code shared with core but its table of numbers (tuning.h). Written from
/// firmware/stereo/match/match.md and the definitions in the kernels. The disparities that a pixel
/// searches, and the slopes of the surface around it, are arguments.
#ifndef VERGENCE_TESTS_ORACLE_MATCH_REFERENCE_HPP
#define VERGENCE_TESTS_ORACLE_MATCH_REFERENCE_HPP

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace reference {

/// A value for every pixel.
template <typename T>
struct Grid {
    Grid(int width_px, int height_px, T value = T())
        : width(width_px),
          height(height_px),
          cells(static_cast<size_t>(width_px) * static_cast<size_t>(height_px), value) {}
    T &at(int x, int y) { return cells[index(x, y)]; }
    const T &at(int x, int y) const { return cells[index(x, y)]; }

    int width, height;
    std::vector<T> cells;

  private:
    size_t index(int x, int y) const {
        return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
    }
};

/// Values of the disparities of one pixel: lane i is disparity disparity_min + i. Infinite where
/// the pixel does not search it.
using Lanes = std::vector<double>;
using Volume = Grid<Lanes>;

struct Place {
    int x, y;
};

/// Columns [begin, end) of a row, or lanes of a pixel.
struct Span {
    int begin, end;
};

/// Of the surface at a pixel, in 1/256 disparities a row and a column: what comes from a neighbour
/// there moves up by as many lanes as the surface rises in between.
struct Slopes {
    int down, along;
};

struct View {
    Grid<uint8_t> grey;
    std::vector<Span> spans;                   // valid columns, by row
    std::vector<Grid<uint8_t>> channels = {};  // red, green and blue; empty: grey only
    int smoothing = 0;                         // what it got, see smoothing_of
};

struct Search {
    int disparity_min, disparity_count;
    int speckle_px;
    bool keep_all;
    int extra_below = 0, extra_above = 0;  // part of the count beyond the requested range

    /// The count, padded to whole vectors: lanes beyond the count take part in everything, but none
    /// of them may win a valid pixel.
    int lanes() const { return (disparity_count + 15) / 16 * 16; }
};

struct Answer {
    Grid<int> disparity_q8, reason, confidence;
};

/// Costs of the best paths that end at each pixel of a path, by lane:
///     path(i) = cost(i) + min(p(i), p(i - 1) + small, p(i + 1) + small, min p + large) - min p
/// with p the lanes of the pixel before; `large[n]` is the penalty on the way to pixel n. Lanes
/// searched only by the pixel before end there, except for their part in min p. On the way to pixel
/// n the lanes of p move up by `rise[n]`. Source: H. Hirschmueller, "Stereo processing by
/// semiglobal matching and mutual information", PAMI 30(2), 2008, equation 13.
std::vector<Lanes> path_costs(const std::vector<Lanes> &costs, double small,
                              const std::vector<double> &large, const std::vector<int> &rise);

/// The darkest and the brightest of the valid pixels: these may be clipped.
std::pair<int, int> limits_of(const View &view);

/// Whether a pixel of a block of 8x8 pixels, or of the rows above and below it, may be.
bool is_clipped(const View &view, std::pair<int, int> limits, int x_begin, int y_begin);

/// `lanes` minus their lowest: the kernels' representation of a path.
Lanes normalised(Lanes lanes);

/// For a grey level difference: the weight of a neighbour across it, in 1/65536.
double edge_weight(int step);

/// Level of a view's grey image or channel at any position: rows outside the image repeat its ends,
/// columns outside the span the span's ends; a row without a span is black.
int level_at(const View &view, const Grid<uint8_t> &image, int x, int y);
int grey_at(const View &view, int x, int y);

/// Weight of the neighbours when a pair is smoothed, in 1/16 along each direction.
int smoothing_of(const View &left, const View &right);

/// What is compared, and what steps are between: means of 3x3 pixels, by that weight.
View smoothed(const View &view, int side);

/// Costs of all disparities. The left support of a pixel is sheared by the slopes there.
Volume costs_of(const View &left, const View &right, const Search &search,
                const Grid<Slopes> &slopes);

/// The lanes that each pixel searches, out of a volume of all.
Volume windowed(const Volume &all, const Grid<Span> &windows);

/// Costs averaged along the rows.
Volume row_averages(const View &left, const Volume &costs, const Grid<Slopes> &slopes);

/// Inputs of the choice of winners.
struct Sums {
    Volume averages;  // costs averaged along rows and columns
    Volume totals;    // costs of the paths from above, from the left and from the right
};

/// Averages along the columns, and the paths through them.
Sums sum_up(const View &left, const Search &search, const Volume &row_averages,
            const Grid<Slopes> &slopes);

/// Accepts expensive winners where many are accepted. Rejects pixels of blocks with little texture
/// along the row, or with few accepted pixels, around, and what an object hides. `coarse`: whether
/// the texture of the pair is.
void check_neighbourhood(const View &left, const View &right, const Search &search, bool coarse,
                         Answer *answer);

/// A row of the left image, smoothed by (1 2 1) both ways, times 16; column 0 is at index 2.
std::vector<int> smooth_row(const View &left, int y);

/// Rejects plain pixels between some called occluded and an outline: what an object hides.
/// `noise_q8`: 256 times the variance of the noise of a pixel.
void reject_hidden(const View &left, double noise_q8, Answer *answer);

/// Winners, checks, smoothing, speckles. If `doubtful` is not 0, no winner is better than its
/// rivals by enough.
Answer decide(const View &left, const View &right, const Search &search, const Sums &sums,
              const Grid<int> &doubtful);

}  // namespace reference

#endif
