// SPDX-License-Identifier: Apache-2.0
// The second half of the slow matcher: from the sums of the paths to the result.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "match_reference.hpp"
#include "stereo/image/reason.h"
#include "stereo/match/tuning.h"

namespace reference {

namespace {

// Data of a pixel's winner.
struct Winner {
    int lane = -1;  // -1: no winner, as the pixel is outside the shared view
    int right_x = 0;
    double margin = 0;
    double before = 0, cost = 0, after = 0;  // averages at the winner and beside it
};

// The first of the lowest lanes in [begin, end) that the pixel searches and whose right pixel is
// valid.
Winner winner_of(const Lanes &totals, const Lanes &averages, int begin, int end) {
    while (begin < end && std::isinf(averages[static_cast<size_t>(begin)])) {
        begin++;
    }
    while (begin < end && std::isinf(averages[static_cast<size_t>(end - 1)])) {
        end--;
    }
    Winner winner;
    for (int lane = begin; lane < end; lane++) {
        if (winner.lane < 0 ||
            totals[static_cast<size_t>(lane)] < totals[static_cast<size_t>(winner.lane)]) {
            winner.lane = lane;
        }
    }
    if (winner.lane < 0) {
        return winner;
    }
    double rival = 255;
    for (int lane = begin; lane < end; lane++) {
        if (std::abs(lane - winner.lane) >= 2) {
            rival = std::min(rival, totals[static_cast<size_t>(lane)]);
        }
    }
    const size_t at = static_cast<size_t>(winner.lane);
    winner.margin = rival - totals[at];
    const bool inside = winner.lane > begin && winner.lane + 1 < end;
    winner.cost = averages[at];
    winner.before = inside ? averages[at - 1] : winner.cost;
    winner.after = inside ? averages[at + 1] : winner.cost;
    return winner;
}

Grid<Winner> winners_of(const View &left, const View &right, const Search &search,
                        const Sums &sums) {
    Grid<Winner> winners(sums.totals.width, sums.totals.height);
    for (int y = 0; y < winners.height; y++) {
        const Span left_span = left.spans[static_cast<size_t>(y)];
        const Span right_span = right.spans[static_cast<size_t>(y)];
        for (int x = left_span.begin; x < left_span.end; x++) {
            // Lane i is right pixel x - disparity_min - i.
            const int begin = x - search.disparity_min - (right_span.end - 1);
            const int end = x - search.disparity_min - right_span.begin + 1;
            if (begin >= search.disparity_count) {
                continue;  // everything searched is outside the right row
            }
            Winner &winner = winners.at(x, y);
            winner = winner_of(sums.totals.at(x, y), sums.averages.at(x, y), std::max(begin, 0),
                               std::min(end, search.lanes()));
            winner.right_x = x - search.disparity_min - winner.lane;
        }
    }
    return winners;
}

// Whether the right pixel of (x, y) is assigned to it or to another one at most a lane off. It is
// assigned to the left pixel of the lowest cost, and of these to the one with the largest
// disparity.
bool is_consistent(const Grid<Winner> &winners, int x, int y) {
    const Winner &own = winners.at(x, y);
    const Winner *owner = &own;
    for (int other_x = 0; other_x < winners.width; other_x++) {
        const Winner &other = winners.at(other_x, y);
        const bool meets = other.lane >= 0 && other.right_x == own.right_x;
        if (meets &&
            (other.cost < owner->cost || (other.cost == owner->cost && other.lane > owner->lane))) {
            owner = &other;
        }
    }
    return match_accepts(MATCH_LEFT_RIGHT, std::abs(owner->lane - own.lane));
}

// Within the requested range, not at an end of it (unless more is searched there or there is
// nothing else), and with a low enough cost.
bool is_fit(const Winner &winner, const Search &search, bool is_smoothed) {
    const int beyond = search.disparity_count - search.extra_above;
    const int ends = beyond - search.extra_below > 2 ? 1 : 0;
    const int first = search.extra_below + (search.extra_below > 0 ? 0 : ends);
    const int last = beyond - 1 - (search.extra_above > 0 ? 0 : ends);
    return winner.lane >= first && winner.lane <= last &&
           match_accepts(MATCH_COST,
                         static_cast<int>(winner.cost) + (is_smoothed ? TUNE_COST_SMOOTHED : 0));
}

// The grey levels between the darkest and the brightest of the pixels around x, moved into the
// span.
int contrast_at(const View &left, int x, int y) {
    const Span span = left.spans[static_cast<size_t>(y)];
    const int columns = TUNE_CONTRAST_COLUMNS;
    const int begin = std::max(std::min(x - columns / 2, span.end - columns), span.begin);
    const int end = std::min(begin + columns, span.end);
    int darkest = 255, brightest = 0;
    for (int column = begin; column < end; column++) {
        darkest = std::min<int>(darkest, left.grey.at(column, y));
        brightest = std::max<int>(brightest, left.grey.at(column, y));
    }
    return brightest - darkest;
}

int reason_of(const View &left, const Search &search, const Grid<Winner> &winners, bool is_smoothed,
              int x, int y) {
    const Winner &winner = winners.at(x, y);
    if (winner.lane < 0) {
        return REASON_BORDER;
    }
    if (search.keep_all) {
        return REASON_VALID;
    }
    const bool fit = is_fit(winner, search, is_smoothed);
    if (!is_consistent(winners, x, y)) {
        return match_rules[MATCH_LEFT_RIGHT].reason;
    }
    const int contrast = contrast_at(left, x, y);
    const int most = TUNE_CONTRAST_FAINT + TUNE_MARGIN_MIN - TUNE_MARGIN_LEAST;
    const int more = std::clamp<int>(contrast, TUNE_CONTRAST_FAINT, most) - TUNE_CONTRAST_FAINT;
    if (fit && match_accepts(MATCH_MARGIN, static_cast<int>(winner.margin) + more)) {
        return REASON_VALID;
    }
    if (!match_accepts(MATCH_CONTRAST, contrast)) {
        return match_rules[MATCH_CONTRAST].reason;
    }
    return match_rules[fit ? MATCH_MARGIN : MATCH_COST].reason;
}

// Lowest point of the "V" through three costs, in 1/256 px from the middle one: its steeper side
// rises as fast as the other one falls. Half way if a neighbour is not more expensive.
double sub_pixel_q8(const Winner &winner) {
    const double rise_before = winner.before - winner.cost;
    const double rise_after = winner.after - winner.cost;
    const double direction = rise_before > rise_after ? 1 : (rise_before < rise_after ? -1 : 0);
    if (std::min(rise_before, rise_after) <= 0) {
        return 128 * direction;
    }
    const double steeper = std::max(rise_before, rise_after);
    return std::trunc(128 * (rise_before - rise_after) / steeper);
}

int disparity_q8_of(const Winner &winner, const Search &search) {
    const int last = search.disparity_count - 1;
    const int whole_q8 = 256 * (search.disparity_min + std::clamp(winner.lane, 0, last));
    const bool inside = winner.lane >= 0 && winner.lane <= last;
    return whole_q8 + (inside ? static_cast<int>(sub_pixel_q8(winner)) : 0);
}

int median(int a, int b, int c) {
    return std::max(std::min(a, b), std::min(std::max(a, b), c));
}

// Processing of the disparities after the winners: medians of three along the rows, then along the
// columns; the ends do not change.
Grid<int> smoothed(const Grid<int> &raw) {
    Grid<int> along = raw;
    for (int y = 0; y < raw.height; y++) {
        for (int x = 1; x + 1 < raw.width; x++) {
            along.at(x, y) = median(raw.at(x - 1, y), raw.at(x, y), raw.at(x + 1, y));
        }
    }
    Grid<int> result = along;
    for (int y = 1; y + 1 < raw.height; y++) {
        for (int x = 0; x < raw.width; x++) {
            result.at(x, y) = median(along.at(x, y - 1), along.at(x, y), along.at(x, y + 1));
        }
    }
    return result;
}

// Number of valid pixels connected with (x, y), by steps of at most two pixels of disparity between
// neighbours; counts at most `enough`.
size_t island_around(const Answer &answer, int x, int y, size_t enough) {
    Grid<int> reached(answer.reason.width, answer.reason.height, 0);
    reached.at(x, y) = 1;
    std::vector<Place> island = {{x, y}};
    for (size_t n = 0; n < island.size() && island.size() < enough; n++) {
        const Place at = island[n];
        for (const Place to : {Place{at.x + 1, at.y}, Place{at.x - 1, at.y}, Place{at.x, at.y + 1},
                               Place{at.x, at.y - 1}}) {
            if (to.x < 0 || to.y < 0 || to.x >= reached.width || to.y >= reached.height ||
                reached.at(to.x, to.y) != 0 || answer.reason.at(to.x, to.y) != REASON_VALID ||
                std::abs(answer.disparity_q8.at(to.x, to.y) - answer.disparity_q8.at(at.x, at.y)) >
                    TUNE_ISLAND_STEP) {
                continue;
            }
            reached.at(to.x, to.y) = 1;
            island.push_back(to);
        }
    }
    return island.size();
}

void reject_islands(const Search &search, Answer *answer) {
    Grid<int> reason = answer->reason;
    const auto enough = static_cast<size_t>(search.speckle_px);
    for (int y = 0; y < reason.height; y++) {
        for (int x = 0; x < reason.width; x++) {
            if (reason.at(x, y) == REASON_VALID && island_around(*answer, x, y, enough) < enough) {
                reason.at(x, y) = match_rules[MATCH_ISLAND].reason;
            }
        }
    }
    answer->reason = reason;
}

}  // namespace

Answer decide(const View &left, const View &right, const Search &search, const Sums &sums,
              const Grid<int> &doubtful) {
    const int side = smoothing_of(left, right);
    const int width = sums.totals.width;
    const int height = sums.totals.height;
    Grid<Winner> winners = winners_of(left, right, search, sums);
    for (size_t i = 0; i < winners.cells.size(); i++) {
        Winner &winner = winners.cells[i];
        winner.margin = doubtful.cells[i] != 0
                            ? std::min(winner.margin, int{TUNE_MARGIN_LEAST} - 1.0)
                            : winner.margin;
    }
    Answer answer = {{width, height}, {width, height}, {width, height}};
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const Winner &winner = winners.at(x, y);
            answer.disparity_q8.at(x, y) = disparity_q8_of(winner, search);
            answer.reason.at(x, y) = reason_of(left, search, winners, side != 0, x, y);
            answer.confidence.at(x, y) = winner.lane < 0 ? 0 : static_cast<int>(winner.margin);
        }
    }
    answer.disparity_q8 = smoothed(answer.disparity_q8);
    if (!search.keep_all) {
        check_neighbourhood(left, right, search, side == TUNE_SMOOTHING_COARSE, &answer);
        reject_islands(search, &answer);
    }
    return answer;
}

}  // namespace reference
