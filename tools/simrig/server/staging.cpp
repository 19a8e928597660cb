// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/staging.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "tools/simrig/wire/message.hpp"

namespace simrig {

namespace {

void set_vector(YAML::Node object, const char *key, const double *values) {
    YAML::Node list(YAML::NodeType::Sequence);
    for (int i = 0; i < 3; i++) {
        std::ostringstream text;
        text.precision(17);
        text << values[i];
        list.push_back(text.str());
    }
    object[key] = list;
}

/// The object of that name in a valid scene.
YAML::Node find(const YAML::Node &scene, const std::string &name) {
    std::string names;
    for (const YAML::Node &item : scene["objects"]) {
        const YAML::Node object = item.begin()->second;
        const std::string found = object["name"].as<std::string>();
        if (found == name) {
            return object;
        }
        names += (names.empty() ? "" : ", ") + found;
    }
    throw std::runtime_error("unknown object '" + name + "' (expected " + names + ")");
}

}  // namespace

std::shared_ptr<world::Scene> Staging::loaded(const std::string &path, const Moves &moves) {
    const Body bytes = description_at(path);
    if (moves.empty()) {
        return std::make_shared<world::Scene>(world::load_scene(path));
    }
    const YAML::Node scene = YAML::Load(std::string(bytes.begin(), bytes.end()));
    for (const auto &[name, place] : moves) {
        const YAML::Node object = find(scene, name);
        set_vector(object, "position_mm", place.data());
        if (place.size() > 3) {
            set_vector(object, "turn_deg", place.data() + 3);
        }
    }
    std::ostringstream text;
    text << scene;
    return std::make_shared<world::Scene>(world::load_scene(path, text.str()));
}

std::shared_ptr<world::Scene> Staging::change(const std::string &path) {
    auto scene = loaded(path, {});
    path_ = path;
    moves_.clear();
    return scene;
}

std::shared_ptr<world::Scene> Staging::move(const std::string &object,
                                            const std::vector<double> &place) {
    Moves moves = moves_;
    moves[object] = place;
    auto scene = loaded(path_, moves);
    moves_ = moves;
    return scene;
}

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
