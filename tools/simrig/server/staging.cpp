// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/staging.hpp"

#include <yaml-cpp/yaml.h>

#include <sstream>
#include <stdexcept>

#include "tools/simrig/server/place.hpp"

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

}  // namespace simrig
