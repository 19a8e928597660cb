// SPDX-License-Identifier: Apache-2.0
/// What goes into a reconstruction: two images of one size and a calibration that fits them.
#ifndef VERGENCE_DAEMON_RECONSTRUCT_INPUTS_H
#define VERGENCE_DAEMON_RECONSTRUCT_INPUTS_H

#include "daemon/calibration_loader.h"
#include "daemon/image_file.h"
#include "daemon/reconstruct_context.h"
#include "daemon/reconstruct_request.h"

#ifdef __cplusplus
extern "C" {
#endif

struct reconstruct_inputs {
    struct image_file left, right;
    struct calibration calibration;  // of the images as they are in memory
    char calibration_format[CALIBRATION_LOADER_FORMAT_BYTES];
    bool metric;
};

/// Reads everything the request names. What is assumed or doubtful goes to the context's warnings.
/// Returns 0, or a negative error code with `message` set and nothing left to free.
int reconstruct_inputs_read(const struct reconstruct_request *request,
                            const struct image_format *formats, int format_count,
                            calibration_loader *load, struct reconstruct_inputs *inputs,
                            struct reconstruct_context *context, struct message *message);

void reconstruct_inputs_free(struct reconstruct_inputs *inputs);

#ifdef __cplusplus
}
#endif

#endif
