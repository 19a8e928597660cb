// SPDX-License-Identifier: Apache-2.0
/// The historical baseline: a greedy path through disparity space, row by row.
///
/// A reconstruction, not a port. Its model is, most likely, what the first account of this
/// instrument matched with: G. Guerra-Filho, "An optimal time-space algorithm for dense stereo
/// matching", Journal of Real-Time Image Processing, 2010, of which only the abstract was at hand.
/// *Known* from it: a greedy heuristic computes a path in disparity space; the work per pixel is
/// constant, for there is no search over the range of disparities; time and space are O(n); a
/// procedure repairs the map at depth discontinuities. *Inferred*, and ours, is all that makes it
/// run:
///
/// 1. Each pixel has a *signature*: 30 comparisons of grey values around it. The dissimilarity of
///    two pixels is the count of differing bits: 0 when equal, 15 by chance. A difference of
///    exposure does not matter.
/// 2. A *walk* goes along the row and knows nothing but where it stands: a column of the left row
///    and one of the right (their difference is the disparity). Before each step it compares a few
///    moves by the dissimilarity of the next 8 pixels plus a penalty: straight on; skip one pixel
///    of either row (a slant); and where straight on does not fit, skip up to 32 of either row (an
///    occlusion). The cheapest is taken and never revised.
/// 3. A greedy walk finds a surface late, once it is on it. So a second walk comes back from the
///    other end and may go over to the first one's path, and a third likewise to the second's. What
///    the last two agree on is kept.
/// 4. *Repair*: between two kept pieces the edge is put where both fit best.
/// 5. *Vetting*: sums along the path of the dissimilarities at the match and at one and two
///    disparities beside it give the sub-pixel position, the confidence and the reason to reject.
///
/// A surface further off than 32 px is reached by several jumps, with luck; repeated patterns and
/// rows without texture mislead a walk for as long as they last. That is in the nature of the
/// method: it leaves horizontal stripes.
///
/// Measured on eight recorded pairs with ground truth (the Middlebury ones of match.md), "filled"
/// by the rule of `vergence evaluate`: bad-1.0 is 7.7 % in the mean, from 1.8 % (venus) to 19.2 %
/// (Art); 10.3 % when a walk may not go over to the other's path, 8.7 % without repair. Of what is
/// kept, 3.3 % is off by more than 1 px, at a density of 87 %.
#ifndef VERGENCE_STEREO_MATCH_MATCH_PAPER_H
#define VERGENCE_STEREO_MATCH_MATCH_PAPER_H

#include <stddef.h>
#include <stdint.h>

#include "core/arena.h"
#include "stereo/match/match.h"

#ifdef __cplusplus
extern "C" {
#endif

/// No row takes more evaluations of the dissimilarity of two pixels than this times its width,
/// whatever the images and the range of disparities. On recorded pairs it is 60 a pixel in the
/// mean.
enum { MATCH_PAPER_EVALUATIONS_MAX = 1597 };

/// Working memory that `match_paper_run` takes, in bytes: O(width), whatever the height and the
/// count of disparities. 0 when an argument is out of range.
size_t match_paper_need_bytes(int width, const struct match_options *options);

/// Matches a pair of rectified images. Arguments, outputs, errors and what happens on cancelling
/// are those of `match_run`; `options->kernels` means nothing here. Until speckles are looked for,
/// rows do not influence each other but by the 4 rows above and below that signatures look at.
///
/// The confidence compares the dissimilarity h at the match with the smaller one r of two
/// disparities above and below it: 255 (r - h) / (r + h). It says how sharply the place is
/// determined; that there is no other such place it cannot say, for the path never looks
/// everywhere. 0 where walks disagree.
int match_paper_run(const struct match_input *input, const struct match_options *options,
                    match_progress *progress, void *progress_self, struct arena *arena,
                    struct match_output *output);

/// The same, and stores the count of evaluated dissimilarities, also when cancelled.
int match_paper_run_counted(const struct match_input *input, const struct match_options *options,
                            match_progress *progress, void *progress_self, struct arena *arena,
                            struct match_output *output, uint64_t *evaluations);

#ifdef __cplusplus
}
#endif

#endif
