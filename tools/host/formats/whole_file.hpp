// SPDX-License-Identifier: Apache-2.0
/// One file that appears complete or not at all.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_WHOLE_FILE_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_WHOLE_FILE_HPP

#include <string>

/// Writes `content` to the file `path`, which keeps its old content until the new one is on the
/// disk. A link stays, and the file it leads to is written; a device or a pipe is written to as it
/// stands. False, with one sentence in `*message` that names `path`, when it cannot be written.
bool whole_file_write(const std::string &path, const std::string &content, std::string *message);

#endif
