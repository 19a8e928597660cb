// SPDX-License-Identifier: Apache-2.0
/// The historical baseline: a greedy path through disparity space, row by row.
///
/// A reconstruction, not a port. The first account of this instrument most likely matched with this
/// model: G. Guerra-Filho, "An optimal time-space algorithm for dense stereo matching", Journal of
/// Real-Time Image Processing, 2010, of which only the abstract was available. *Known* from it: a
/// greedy heuristic computes a path in disparity space; the work per pixel is constant, as the
/// range of disparities is not searched; time and space are O(n); a procedure repairs the map at
/// depth discontinuities. *Inferred* by us is everything else:
///
/// 1. Each pixel has a *signature*: 30 comparisons of grey values around it. The dissimilarity of
///    two pixels is the number of differing bits: 0 if equal, 15 by chance. A difference of
///    exposure does not matter.
/// 2. A *walk* follows the row. Its only state is its position: a column of the left row and one of
///    the right (their difference is the disparity). Before each step it compares a few moves by
///    the dissimilarity of the next 8 pixels plus a penalty: straight on; skip one pixel of either
///    row (a slant); and where straight on does not fit, skip up to 32 of either row (an
///    occlusion). The cheapest is taken and never revised.
/// 3. A greedy walk finds a surface late. So a second walk comes back from the other end and may
///    switch to the path of the first, and a third likewise to that of the second. Pixels on which
///    the last two agree are kept.
/// 4. *Repair*: between two kept pieces the edge is put where both fit best.
/// 5. *Validation*: sums along the path of the dissimilarities at the match and at one and two
///    disparities away give the sub-pixel position, the confidence and the reason to reject.
///
/// A surface more than 32 px away needs several lucky jumps; repeated patterns and rows without
/// texture mislead a walk for as long as they last. This is inherent in the method: it leaves
/// horizontal stripes.
///
/// Measured on eight recorded pairs with ground truth (the Middlebury ones of match.md), "filled"
/// by the rule of `vergence evaluate`: mean bad-1.0 is 7.7 %, from 1.8 % (venus) to 19.2 % (Art);
/// 10.3 % if a walk may not switch to the other's path, 8.7 % without repair. Of the kept pixels,
/// 3.3 % are off by more than 1 px, at a density of 87 %.
#ifndef VERGENCE_STEREO_MATCH_MATCH_PAPER_H
#define VERGENCE_STEREO_MATCH_MATCH_PAPER_H

#include <stddef.h>
#include <stdint.h>

#include "core/arena.h"
#include "stereo/match/match.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Upper bound of the evaluations of dissimilarity per row, as a multiple of its width, for any
/// images and range of disparities. On recorded pairs the mean is 60 per pixel.
enum { MATCH_PAPER_EVALUATIONS_MAX = 1597 };

/// Working memory of `match_paper_run` in bytes: O(width), independent of the height and the number
/// of disparities. 0 if an argument is out of range.
size_t match_paper_need_bytes(int width, const struct match_options *options);

/// Matches a pair of rectified images. Arguments, outputs, errors and cancellation are those of
/// `match_run`; `options->kernels` is ignored. Before speckles are removed, rows influence each
/// other only through the 4 rows above and below in the signatures.
///
/// The confidence compares the dissimilarity h at the match with the smaller one r of two
/// disparities above and below it: 255 (r - h) / (r + h). It shows how sharply the position is
/// determined, but not whether it is unique, as the path does not search everywhere. 0 where walks
/// disagree.
int match_paper_run(const struct match_input *input, const struct match_options *options,
                    match_progress *progress, void *progress_self, struct arena *arena,
                    struct match_output *output);

/// The same, and stores the number of evaluated dissimilarities, also if cancelled.
int match_paper_run_counted(const struct match_input *input, const struct match_options *options,
                            match_progress *progress, void *progress_self, struct arena *arena,
                            struct match_output *output, uint64_t *evaluations);

#ifdef __cplusplus
}
#endif

#endif
