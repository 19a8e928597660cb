// SPDX-License-Identifier: Apache-2.0
/// Inputs of a reconstruction: two images and a calibration that fits them.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_INPUTS_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_INPUTS_H

#include "daemon/images/image_file.h"
#include "daemon/surface/calibration_loader.h"
#include "daemon/surface/reconstruct_program.h"
#include "daemon/surface/reconstruct_request.h"
#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

struct reconstruct_inputs {
    struct image_file left, right;
    struct calibration calibration;  // calibration of the images as they are in memory
    const char *calibration_path;    // path as displayed to users; NULL: assumed
    char calibration_format[CALIBRATION_LOADER_FORMAT_BYTES];
    bool metric;
};

/// The `source` of reconstruct_inputs_read.
struct reconstruct_source {
    const struct reconstruct_program *program;
    /// Reads the image of a side (0 left, 1 right) that is in memory, as image_file_read does;
    /// `file` is named already. NULL: the files that the request names are read.
    int (*read_image)(void *self, int side, const struct image_request *request,
                      struct image_file *file, struct message *message);
    void *self;
    /// A loaded calibration in place of the file that the request names, and its format. NULL:
    /// none.
    const struct calibration *calibration;
    const char *calibration_format;
};

/// A caller's `read` of two images. `source`: a struct reconstruct_source.
int reconstruct_inputs_read(void *source, const struct reconstruct_request *request,
                            struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                            struct message *message);

/// For functions `read` of a caller, once the images are read: loads the calibration that the
/// request names, unchanged, or assumes one for the images if it names none.
int reconstruct_inputs_calibrate(const struct reconstruct_request *request,
                                 calibration_loader *load, struct reconstruct_inputs *inputs,
                                 struct reconstruct_context *context, struct message *message);

/// Likewise, the calibration in memory that `source` has.
int reconstruct_inputs_copy(const struct reconstruct_request *request,
                            const struct reconstruct_source *source,
                            struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                            struct message *message);

/// For functions `read` of a caller: fits the calibration named `name` to the images in memory,
/// which may have been shrunk while reading. A calibration for images of their present size is used
/// unchanged. ERROR_SIZE_MISMATCH and others with `message` set.
int reconstruct_inputs_fit(struct reconstruct_inputs *inputs, const char *name,
                           struct message *message);

/// For functions `read` of a caller: rejects images that are too small; and warns of doubts about
/// them.
int reconstruct_inputs_check(const struct reconstruct_inputs *inputs, struct message *message);
void reconstruct_inputs_doubt(const struct reconstruct_inputs *inputs,
                              struct reconstruct_context *context);

void reconstruct_inputs_free(struct reconstruct_inputs *inputs);

#ifdef __cplusplus
}
#endif

#endif
