// SPDX-License-Identifier: Apache-2.0
/// The minimal contents of a disk after a process's calls: the bytes of files that were synced, and
/// names whose directories were synced. After a power loss nothing else exists.
#ifndef VERGENCE_TESTS_POWER_LOSS_HPP
#define VERGENCE_TESTS_POWER_LOSS_HPP

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>

class power_loss {
  public:
    using path = std::filesystem::path;

    /// The path of an open descriptor, or of `name` in an open directory (or AT_FDCWD).
    static path of(int file) {
        return std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(file));
    }
    static path of(int directory, const char *name) {
        return name[0] == '/' || directory < 0 ? std::filesystem::absolute(name)
                                               : of(directory) / name;
    }

    void made_directory(const path &name) { names_.insert(name); }
    /// A file opened for writing: the disk has nothing of a new one.
    void opened(const path &name, bool is_new) {
        if (is_new) {
            names_.insert(name);
            bytes_[name] = 0;
        }
    }
    void renamed(const path &from, const path &to) {
        names_.erase(from);
        names_.insert(to);
        if (bytes_.count(from) != 0) {
            bytes_[to] = bytes_[from];
            bytes_.erase(from);
        }
    }
    void removed(const path &name) {
        names_.erase(name);
        bytes_.erase(name);
    }
    void cut(const path &name, std::uintmax_t bytes) {
        if (bytes_.count(name) != 0 && bytes_[name] > bytes) {
            bytes_[name] = bytes;
        }
    }
    void synced(int file) {
        const path what = of(file);
        if (!std::filesystem::is_directory(what)) {
            bytes_[what] = std::filesystem::file_size(what);
            return;
        }
        for (auto name = names_.begin(); name != names_.end();) {
            name = name->parent_path() == what ? names_.erase(name) : std::next(name);
        }
    }
    /// Removes everything that was not synced.
    void strike() const {
        for (const auto &[name, bytes] : bytes_) {
            if (std::filesystem::exists(name)) {
                std::filesystem::resize_file(name, bytes);
            }
        }
        for (const path &name : names_) {
            std::filesystem::remove_all(name);
        }
    }

  private:
    std::set<path> names_;                  ///< not yet synced by their directories
    std::map<path, std::uintmax_t> bytes_;  ///< synced length of each file
};

#endif
