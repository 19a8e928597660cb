// SPDX-License-Identifier: Apache-2.0
/// A folder for readers that need a path, in memory where possible.
#ifndef VERGENCE_TESTS_FUZZ_MEMORY_FOLDER_HPP
#define VERGENCE_TESTS_FUZZ_MEMORY_FOLDER_HPP

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "fuzz_check.hpp"

class MemoryFolder {
  public:
    MemoryFolder() {
        const std::string memory = "/dev/shm";
        path_ =
            (access(memory.c_str(), W_OK) == 0 ? memory
                                               : std::filesystem::temp_directory_path().string()) +
            "/vergence-fuzz-XXXXXX";
        FUZZ_CHECK(mkdtemp(path_.data()) != nullptr);
    }
    ~MemoryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    MemoryFolder(const MemoryFolder &) = delete;
    MemoryFolder &operator=(const MemoryFolder &) = delete;

    const std::string &path() const { return path_; }

    void write(const char *name, const std::string &text) const {
        const int fd =
            open((path_ + "/" + name).c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
        FUZZ_CHECK(fd >= 0);
        FUZZ_CHECK(::write(fd, text.data(), text.size()) == ssize_t(text.size()));
        close(fd);
    }

  private:
    std::string path_;
};

#endif
