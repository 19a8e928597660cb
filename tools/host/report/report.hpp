// SPDX-License-Identifier: Apache-2.0
/// report.html: one file that shows a reconstruction to the user. It needs no network and no other
/// file, and opens from a disk.
#ifndef VERGENCE_TOOLS_HOST_REPORT_REPORT_HPP
#define VERGENCE_TOOLS_HOST_REPORT_REPORT_HPP

#include "daemon/surface/result/reconstruct_context.h"

/// Writes the page to `path` (a `result_writer`). Returns 0, or a negative error code with
/// `message` set; a partial file may remain. A result without points (ERROR_NO_SURFACE) gives a
/// page without a surface. Unusable ground truth is reported in the page and is not an error.
int report_write(const struct reconstruct_context *context, const char *path,
                 struct message *message);

#endif
