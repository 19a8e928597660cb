// SPDX-License-Identifier: Apache-2.0
/// The scene on stage and its moved objects.
#ifndef VERGENCE_SIMRIG_SERVER_STAGING_HPP
#define VERGENCE_SIMRIG_SERVER_STAGING_HPP

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tools/simrig/scene/scene.hpp"
#include "tools/simrig/wire/message.hpp"

namespace simrig {

class Staging {
  public:
    explicit Staging(std::string path) : path_(std::move(path)) {}

    /// Replaces the scene; nothing is moved. Throw std::runtime_error with one line.
    std::shared_ptr<world::Scene> change(const std::string &path);
    /// Moves one object of the scene. place: position_mm and, if there are six numbers,
    /// turn_deg, as in the scene's file.
    std::shared_ptr<world::Scene> move(const std::string &object, const std::vector<double> &place);

  private:
    using Moves = std::map<std::string, std::vector<double>>;
    static std::shared_ptr<world::Scene> loaded(const std::string &path, const Moves &moves);

    std::string path_;
    Moves moves_;
};

/// Resolves names of files: scenes and rigs that come with simrig, and files that it writes.

/// `name` is a path when it has a slash or ends in .yaml, and else one of those in tools/simrig;
/// folder: "scenes" or "rigs". Throws std::runtime_error with one line when it does not exist.
std::string place_of(const std::string &folder, const std::string &name);

/// All bytes of a scene's or rig's file; throws std::runtime_error with one line.
Body description_at(const std::string &path);

/// The path of an output file in `folder`. Throws std::runtime_error when the name is invalid or
/// `folder` is empty.
std::string place_for(const std::string &folder, const std::string &name);

/// Replaces characters that would break a one-line message.
std::string one_line(std::string text);

}  // namespace simrig

#endif
