// SPDX-License-Identifier: Apache-2.0
#include "bench/simrig_process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>

namespace rig_bench {

namespace {

constexpr const char *kScene = R"(room: {origin_mm: [125, 0, 1800], tilt_deg: 0}
lights:
  - {centre_mm: [-900, -900, -900], half_u_mm: [300, 0, 0], half_v_mm: [0, 300, 0],
     luminance: [600, 600, 600]}
ambient: [300, 300, 300]
floor_ambient: [300, 300, 300]
bounce_lux: 0
materials:
  - print: {kind: board, contrast: 0, colours: [[0.8, 0.8, 0.8], [0.05, 0.05, 0.05]],
      board: {columns: 9, rows: 7, square_mm: 40}}
objects:
  - sheet: {name: board, material: print, position_mm: [0, 0, 0], size_mm: [1200, 900]}
)";

}  // namespace

SimrigProcess::SimrigProcess(const std::string &scene, const std::vector<std::string> &arguments) {
    where_ = "unix:" + folder_ / "rig.sock";
    std::vector<std::string> words = {
        SIMRIG,  "--scene", scene.empty() ? folder_.write("scene.yaml", kScene) : scene,
        "--rig", "default", "--listen",
        where_};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char *> pointers;
    for (std::string &word : words) {
        pointers.push_back(word.data());
    }
    pointers.push_back(nullptr);
    int reported[2];
    REQUIRE(pipe2(reported, O_CLOEXEC) == 0);
    const pid_t parent = getpid();
    process_ = fork();
    REQUIRE(process_ >= 0);
    if (process_ == 0) {
        // It must not outlive a test that crashes.
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() == parent && dup2(reported[1], 1) == 1) {
            execv(SIMRIG, pointers.data());
        }
        _exit(127);
    }
    close(reported[1]);
    // It reports where it listens, or closes the pipe.
    std::string output_text;
    char byte = 0;
    while (output_text.find("listening on") == std::string::npos &&
           read(reported[0], &byte, 1) == 1) {
        output_text += byte;
    }
    close(reported[0]);
    REQUIRE_MESSAGE(output_text.find("listening on") != std::string::npos, output_text);
}

void SimrigProcess::kill() {
    if (process_ > 0) {
        ::kill(process_, SIGKILL);
        waitpid(process_, nullptr, 0);
        process_ = -1;
    }
}

SimrigProcess::~SimrigProcess() {
    if (process_ > 0) {
        ::kill(process_, SIGTERM);
        waitpid(process_, nullptr, 0);
    }
}

}  // namespace rig_bench
