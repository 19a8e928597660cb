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
#include <memory>

#include "core/error.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/file_io.h"
#include "daemon/files/input_file.h"

namespace {

using owned_file = std::unique_ptr<FILE, int (*)(FILE *)>;

const int links_max = 40;  // the kernel's limit

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
    return descriptor >= 0 &&
           close_after(descriptor, write_all(descriptor, content.data(), content.size()));
}

bool replace(const std::string &path, const std::string &content) {
    return atomic_file_write(AT_FDCWD, path.c_str(), 0666, content.data(), content.size());
}

}  // namespace

int whole_file_read(const std::string &path, std::size_t limit, const char *what,
                    std::string *content, std::string *message) {
    struct message last_error;
    const owned_file stream(input_file_open(path.c_str(), &last_error), std::fclose);
    if (stream == nullptr) {
        *message = last_error.text;
        return ERROR_ARGUMENT;
    }
    content->clear();
    char block[1 << 16];
    for (std::size_t got; (got = std::fread(block, 1, sizeof block, stream.get())) > 0;) {
        content->append(block, got);
        if (content->size() > limit) {
            *message = path + ": too large for " + what + " (at most " +
                       std::to_string(limit >> 20) + " MiB)";
            return ERROR_TOO_LARGE;
        }
    }
    if (std::ferror(stream.get()) != 0) {
        *message = path + ": cannot be read: " + std::strerror(errno);
        return ERROR_ARGUMENT;
    }
    return ERROR_OK;
}

std::string whole_file_head(const std::string &path, std::size_t bytes) {
    struct message last_error;  // reported when the whole file is read
    const owned_file stream(input_file_open(path.c_str(), &last_error), std::fclose);
    std::string head(bytes, '\0');
    head.resize(stream == nullptr ? 0 : std::fread(head.data(), 1, bytes, stream.get()));
    return head;
}

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
        good = follow_links(&file) && replace(file, content);
    }
    if (!good) {
        *message = path + ": cannot write: " + std::strerror(errno);
    }
    return good;
}
