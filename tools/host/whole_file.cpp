// SPDX-License-Identifier: Apache-2.0
#include "tools/host/whole_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "daemon/input_file.h"

bool whole_file_write(const std::string &path, const std::string &content, std::string *message) {
    const auto failed = [&](const std::string &temporary) {
        *message = path + ": cannot be written: " + std::strerror(errno);
        if (!temporary.empty()) {
            unlink(temporary.c_str());
        }
        return false;
    };
    if (input_file_is_directory(path.c_str())) {
        errno = EISDIR;
        return failed("");
    }
    std::string temporary = path + ".XXXXXX";
    const int descriptor = mkstemp(&temporary[0]);
    if (descriptor < 0) {
        return failed("");
    }
    bool good = true;
    for (std::size_t done = 0; good && done < content.size();) {
        const ssize_t count = write(descriptor, content.data() + done, content.size() - done);
        good = count > 0 || (count < 0 && errno == EINTR);
        done += count > 0 ? static_cast<std::size_t>(count) : 0;
    }
    const mode_t mask = umask(0);
    umask(mask);
    good = good && fchmod(descriptor, 0666 & ~mask) == 0 && fsync(descriptor) == 0;
    const int saved = errno;
    good = close(descriptor) == 0 && good;
    errno = good ? errno : saved;
    if (!good || std::rename(temporary.c_str(), path.c_str()) != 0) {
        return failed(temporary);
    }
    return true;
}
