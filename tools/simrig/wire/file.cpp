// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/wire/file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace simrig {

namespace {

struct OpenFile {
    int number;
    explicit OpenFile(const std::string &path)
        : number(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {}
    ~OpenFile() {
        if (number >= 0) {
            close(number);
        }
    }
    OpenFile(const OpenFile &) = delete;
    OpenFile &operator=(const OpenFile &) = delete;
};

}  // namespace

Body whole_file(const std::string &path, size_t max) {
    const OpenFile file(path);
    struct stat found {};
    if (file.number < 0 || fstat(file.number, &found) != 0) {
        throw std::runtime_error(path + ": cannot be read: " + std::strerror(errno));
    }
    if (!S_ISREG(found.st_mode)) {
        throw std::runtime_error(path + ": not a file");
    }
    Body bytes;
    uint8_t buffer[65536];
    for (;;) {
        const ssize_t count = read(file.number, buffer, sizeof buffer);
        if (count < 0) {
            throw std::runtime_error(path + ": cannot be read: " + std::strerror(errno));
        }
        if (count == 0) {
            return bytes;
        }
        bytes.insert(bytes.end(), buffer, buffer + count);
        if (bytes.size() > max) {
            throw std::runtime_error(path + ": too long");
        }
    }
}

}  // namespace simrig
