// SPDX-License-Identifier: Apache-2.0
/// The control side of the simulated rig: text commands for scene, truth and faults.
#ifndef VERGENCE_SIMRIG_SERVER_CONTROL_HPP
#define VERGENCE_SIMRIG_SERVER_CONTROL_HPP

#include <functional>
#include <string>
#include <vector>

#include "tools/simrig/rig/scenery.hpp"
#include "tools/simrig/server/staging.hpp"

namespace simrig {

using Words = std::vector<std::string>;

/// Throw std::runtime_error with one line when a word is missing, invalid or unexpected.
const std::string &word_at(const Words &words, size_t at, const std::string &what);
void no_more_than(const Words &words, size_t count);
double number_at(const Words &words, size_t at, const std::string &what, double low, double high);
size_t one_of(const std::string &word, const Words &choices, const std::string &what);
Words words_of(const std::string &line);

/// The action of a fault; words: "fault", part, .... Throws std::runtime_error with one line that
/// says what is wrong.
std::function<void()> fault_of(Rig &rig, const Words &words);

class ControlServer {
  public:
    /// scene: the file that the stage shows. files: the folder to write into; empty: none.
    ControlServer(Rig &rig, Stage &stage, const std::string &scene, std::string files);

    /// Runs one command and returns its answer, which may have several lines. Throws
    /// std::runtime_error with one line that says what is wrong.
    std::string run(const std::string &command);
    /// What a camera's last frame was, and truth for some of its rows: see Stage. Throw as run(),
    /// also when there are no such rows.
    const Stage::Pictured &pictured(int camera) const;
    world::Truth truth_of(int camera, int first_row, int rows) const;

    /// The help text of the commands.
    static std::string help();

  private:
    /// Checks and prepares a command that runs now or later.
    struct Action {
        std::function<void()> run;
        std::string answer;
    };
    Action action(const Words &words);
    Action change_scene(const Words &words);
    Action move(const Words &words);
    Action light(const Words &words);
    Action cap(const Words &words);
    Action ring(const Words &words);
    std::string sharp(const Words &words);
    std::string status();
    std::string truth(const Words &words);
    std::string view(const Words &words);
    std::string at(const Words &words);

    Rig &rig_;
    Stage &stage_;
    Staging staging_;
    std::string files_;
};

}  // namespace simrig

#endif
