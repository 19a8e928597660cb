// SPDX-License-Identifier: Apache-2.0
/// The value of --files: names of result files, separated by commas.
#ifndef VERGENCE_DAEMON_SURFACE_RESULT_RESULT_FILES_H
#define VERGENCE_DAEMON_SURFACE_RESULT_RESULT_FILES_H

#include <stdbool.h>

#include "daemon/base/message.h"
#include "daemon/surface/result/reconstruct_context.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Whether `list` names the file.
bool result_files_has(const char *list, const char *file_name);

/// 0, or ERROR_ARGUMENT with `message` naming a file that none of the writers (`count`) writes.
int result_files_check(const char *list, const struct result_writer *writers, int count,
                       struct message *message);

#ifdef __cplusplus
}
#endif

#endif
