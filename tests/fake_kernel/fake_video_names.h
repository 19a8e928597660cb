// SPDX-License-Identifier: Apache-2.0
/// Descriptions of video requests in the record.
#ifndef VERGENCE_TESTS_FAKE_VIDEO_NAMES_H
#define VERGENCE_TESTS_FAKE_VIDEO_NAMES_H

#include <stddef.h>

struct fake_file;

/// `describe` of the device.
void fake_video_describe(struct fake_file *file, unsigned long request, const void *argument,
                         char *line, size_t bytes);

#endif
