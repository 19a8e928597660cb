// SPDX-License-Identifier: Apache-2.0
/// The frames of a pair, each merged from several. For rig/pair.c only.
#ifndef VERGENCE_RIG_PAIR_MERGE_H
#define VERGENCE_RIG_PAIR_MERGE_H

#include "rig/pair_frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Takes and merges the frames that the options ask for; see struct pair_options. Sets everything
/// of `pair` but its number and the axes. ERROR_MOVED: the scene changed; others as pair_capture.
/// The caller releases the images, also after errors.
int pair_merge_take(struct rig *rig, const struct pair_options *options, struct pair *pair);

#ifdef __cplusplus
}
#endif

#endif
