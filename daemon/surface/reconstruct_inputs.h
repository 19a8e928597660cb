// SPDX-License-Identifier: Apache-2.0
/// What goes into a reconstruction: two images of one size and a calibration that fits them.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_INPUTS_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_INPUTS_H

#include "daemon/images/image_file.h"
#include "daemon/surface/calibration_loader.h"
#include "daemon/surface/reconstruct_request.h"
#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

struct reconstruct_inputs {
    struct image_file left, right;
    struct calibration calibration;  // of the images as they are in memory
    const char *calibration_path;    // for people; NULL: it was assumed
    char calibration_format[CALIBRATION_LOADER_FORMAT_BYTES];
    bool metric;
};

/// Where inputs come from. `read` gives what the request asks for; what is assumed or doubtful goes
/// to the context's warnings. Returns 0, or a negative error code with `message` set and nothing
/// left to free. What `self` points to lives until reconstruct_inputs_free.
struct reconstruct_source {
    int (*read)(void *self, const struct reconstruct_request *request,
                struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                struct message *message);
    void *self;
};

/// Files that the request names, of the formats that a program can read: the `self` of
/// reconstruct_inputs_read, which is a source's `read`.
struct reconstruct_files {
    const struct image_format *formats;
    int format_count;
    calibration_loader *load_calibration;
};
int reconstruct_inputs_read(void *files, const struct reconstruct_request *request,
                            struct reconstruct_inputs *inputs, struct reconstruct_context *context,
                            struct message *message);

/// For sources, when the images are there: loads the calibration that the request names, as it is
/// in its file, or assumes one of the images in memory where it names none.
int reconstruct_inputs_calibrate(const struct reconstruct_request *request,
                                 calibration_loader *load, struct reconstruct_inputs *inputs,
                                 struct reconstruct_context *context, struct message *message);

/// For sources: makes the calibration, which `name` names, one of the images in memory, which may
/// have been shrunk while reading. One that was made for images of their present size is taken as
/// it is. ERROR_SIZE_MISMATCH and others with `message` set.
int reconstruct_inputs_fit(struct reconstruct_inputs *inputs, const char *name,
                           struct message *message);

/// For sources: refuses images of two sizes and those that are too small, and says what is doubtful
/// about them.
int reconstruct_inputs_check(const struct reconstruct_inputs *inputs, struct message *message);
void reconstruct_inputs_doubt(const struct reconstruct_inputs *inputs,
                              struct reconstruct_context *context);

void reconstruct_inputs_free(struct reconstruct_inputs *inputs);

#ifdef __cplusplus
}
#endif

#endif
