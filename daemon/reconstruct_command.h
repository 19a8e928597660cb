// SPDX-License-Identifier: Apache-2.0
/// `vergence reconstruct`: two images and a calibration in, a directory of results out. What it can
/// read and write is what its caller gives it: the board's main gives less than the host's.
#ifndef VERGENCE_DAEMON_RECONSTRUCT_COMMAND_H
#define VERGENCE_DAEMON_RECONSTRUCT_COMMAND_H

#include "daemon/calibration_loader.h"
#include "daemon/image_file.h"
#include "daemon/reconstruct_context.h"
#include "daemon/reconstruct_debug.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RECONSTRUCT_COMMAND_WRITERS_MAX = 24 };

struct reconstruct_command_abilities {
    const struct image_format *formats;
    int format_count;
    calibration_loader *load_calibration;
    const struct result_writer *writers;  // in this order; result.json must be the last
    int writer_count;                     // 1..RECONSTRUCT_COMMAND_WRITERS_MAX
    /// Reads the ground truth and the mask that `context` names, to refuse what cannot be read
    /// before the work; gives its width and height. NULL: no writer compares with ground truth.
    int (*check_truth)(const struct reconstruct_context *context, int size_px[2],
                       struct message *message);
    const struct reconstruct_debug_maker *debug_maker;  // NULL: --debug is refused
};

/// Runs the command and returns its exit code, see client.h.
int reconstruct_command_run(const struct reconstruct_command_abilities *abilities, int argc,
                            char **argv);

#ifdef __cplusplus
}
#endif

#endif
