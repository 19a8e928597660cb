// SPDX-License-Identifier: Apache-2.0
/// Where a test writes files.
#ifndef VERGENCE_TESTS_SCRATCH_HPP
#define VERGENCE_TESTS_SCRATCH_HPP

#include <doctest/doctest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

/// A temporary directory, removed at the end of the test.
struct scratch {
    std::string path;

    scratch() : path((std::filesystem::temp_directory_path() / "vergence-XXXXXX").string()) {
        REQUIRE(mkdtemp(path.data()) != nullptr);
    }
    scratch(const scratch &) = delete;
    scratch &operator=(const scratch &) = delete;
    ~scratch() { std::filesystem::remove_all(path); }

    /// The path of `name` in it.
    std::string operator/(const std::string &name) const { return path + "/" + name; }

    /// Writes a file and returns its path.
    std::string write(const std::string &name, const std::string &text) const {
        std::ofstream(*this / name, std::ios::binary) << text;
        return *this / name;
    }
};

#endif
