// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/place.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "tools/simrig/wire/file.hpp"

namespace simrig {

namespace {

namespace fs = std::filesystem;
constexpr size_t kLongestDescription = size_t(4) << 20;
constexpr size_t kLongestName = 64;

/// The folder of scenes and rigs: next to the program in a build, else where they are installed.
fs::path files() {
    const fs::path here = fs::read_symlink("/proc/self/exe").parent_path();
    return fs::is_directory(here / "scenes") ? here : here / SIMRIG_FILES;
}

bool ends_with(const std::string &text, const std::string &end) {
    return text.size() >= end.size() &&
           text.compare(text.size() - end.size(), std::string::npos, end) == 0;
}

}  // namespace

std::string place_of(const std::string &folder, const std::string &name) {
    if (name.find('/') != std::string::npos || ends_with(name, ".yaml")) {
        return name;
    }
    const fs::path place = files() / folder;
    std::vector<std::string> names;
    std::error_code none;
    for (const fs::directory_entry &entry : fs::directory_iterator(place, none)) {
        names.push_back(entry.path().stem().string());
    }
    if (std::find(names.begin(), names.end(), name) != names.end()) {
        return (place / (name + ".yaml")).string();
    }
    std::sort(names.begin(), names.end());
    std::string list;
    for (const std::string &known : names) {
        list += (list.empty() ? "" : ", ") + known;
    }
    throw std::runtime_error("unknown name '" + name + "' in " + folder + " (expected " + list +
                             ", or a path with a slash or ending in .yaml)");
}

Body description_at(const std::string &path) {
    return whole_file(path, kLongestDescription);
}

std::string place_for(const std::string &folder, const std::string &name) {
    if (folder.empty()) {
        throw std::runtime_error("writing files requires simrig --files DIR");
    }
    const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
        return std::isalnum(c) != 0 || c == '_' || c == '-';
    });
    if (!plain || name.empty() || name.size() > kLongestName) {
        throw std::runtime_error("a name must have 1 to 64 letters, digits, - and _, not '" + name +
                                 "'");
    }
    return folder + "/" + name;
}

std::string one_line(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, '?');
    return text;
}

}  // namespace simrig
