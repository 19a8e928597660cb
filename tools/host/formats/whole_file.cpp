// SPDX-License-Identifier: Apache-2.0
#include "tools/host/formats/whole_file.hpp"

#include <fcntl.h>
#include <limits.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

const int links_max = 40;    // as many as the kernel follows
const int names_max = 1000;  // of one process, at a time, for one file

/// The file that `*path` means once all links at its end are followed; it need not exist. Returns
/// false with errno set.
bool follow_links(std::string *path) {
    struct stat status;
    for (int links = 0; lstat(path->c_str(), &status) == 0 && S_ISLNK(status.st_mode); links++) {
        char target[PATH_MAX];
        const ssize_t length = readlink(path->c_str(), target, sizeof target);
        if (length < 0 || links == links_max) {
            errno = length < 0 ? errno : ELOOP;
            return false;
        }
        const std::string text(target, static_cast<std::size_t>(length));
        const std::size_t slash = path->rfind('/');
        const bool stays = text[0] != '/' && slash != std::string::npos;
        *path = (stays ? path->substr(0, slash + 1) : "") + text;
    }
    return true;
}

bool write_all(int descriptor, const std::string &content) {
    for (std::size_t done = 0; done < content.size();) {
        const ssize_t count = write(descriptor, content.data() + done, content.size() - done);
        if (count <= 0 && errno != EINTR) {
            return false;
        }
        done += count > 0 ? static_cast<std::size_t>(count) : 0;
    }
    return true;
}

/// Closes without losing the errno of an earlier failure.
bool close_after(int descriptor, bool good) {
    const int saved = errno;
    const bool closed = close(descriptor) == 0;
    errno = good ? errno : saved;
    return good && closed;
}

/// Anything but a regular file (a device, a pipe) is written directly.
bool write_through(const std::string &path, const std::string &content) {
    const int descriptor = open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
    return descriptor >= 0 && close_after(descriptor, write_all(descriptor, content));
}

/// A new file next to another one, with the permissions that the kernel gives files of this
/// process: its umask cannot be read without changing it for all threads.
int create_beside(const std::string &path, std::string *name) {
    int descriptor = -1;
    for (int i = 0; descriptor < 0 && i < names_max; i++) {
        *name = path + '.' + std::to_string(getpid()) + '-' + std::to_string(i);
        descriptor = open(name->c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor < 0 && errno != EEXIST) {
            break;
        }
    }
    return descriptor;
}

bool write_and_rename(const std::string &path, const std::string &content) {
    std::string temporary;
    const int descriptor = create_beside(path, &temporary);
    if (descriptor < 0) {
        return false;
    }
    const bool good = write_all(descriptor, content) && fsync(descriptor) == 0;
    if (!close_after(descriptor, good) || std::rename(temporary.c_str(), path.c_str()) != 0) {
        const int saved = errno;
        unlink(temporary.c_str());
        errno = saved;
        return false;
    }
    return true;
}

}  // namespace

bool whole_file_write(const std::string &path, const std::string &content, std::string *message) {
    struct stat status;
    const bool exists = stat(path.c_str(), &status) == 0;
    bool good = false;
    if (exists && S_ISDIR(status.st_mode)) {
        errno = EISDIR;
    } else if (exists && !S_ISREG(status.st_mode)) {
        good = write_through(path, content);
    } else {
        std::string file = path;
        good = follow_links(&file) && write_and_rename(file, content);
    }
    if (!good) {
        *message = path + ": cannot write: " + std::strerror(errno);
    }
    return good;
}
