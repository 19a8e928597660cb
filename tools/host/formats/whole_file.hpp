// SPDX-License-Identifier: Apache-2.0
/// Atomic replacement of a file: it appears complete or not at all.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_WHOLE_FILE_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_WHOLE_FILE_HPP

#include <string>

/// Writes `content` to the file `path`, which keeps its old content until the new one is on the
/// disk. If `path` is a link, the link stays and its target is written; a device or a pipe is
/// written directly. Returns false, with one sentence in `*message` that names `path`, when it
/// cannot be written.
bool whole_file_write(const std::string &path, const std::string &content, std::string *message);

#endif
