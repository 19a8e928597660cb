// SPDX-License-Identifier: Apache-2.0
/// Files read and written as a whole.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_WHOLE_FILE_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_WHOLE_FILE_HPP

#include <cstddef>
#include <string>

/// Reads a regular file. Returns 0; ERROR_ARGUMENT (not there, or it cannot be read) or
/// ERROR_TOO_LARGE (more than `limit` bytes, which `what` never has), with one sentence in
/// `*message` that names `path`.
int whole_file_read(const std::string &path, std::size_t limit, const char *what,
                    std::string *content, std::string *message);

/// Its first bytes, as many as there are; none if it cannot be read.
std::string whole_file_head(const std::string &path, std::size_t bytes);

/// Writes `content` to the file `path`, which keeps its old content until the new one is on the
/// disk. If `path` is a link, the link stays and its target is written; a device or a pipe is
/// written directly. Returns false, with one sentence in `*message` that names `path`, when it
/// cannot be written.
bool whole_file_write(const std::string &path, const std::string &content, std::string *message);

#endif
