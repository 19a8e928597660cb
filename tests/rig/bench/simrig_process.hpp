// SPDX-License-Identifier: Apache-2.0
/// A running simrig.
#ifndef VERGENCE_TESTS_RIG_BENCH_SIMRIG_PROCESS_HPP
#define VERGENCE_TESTS_RIG_BENCH_SIMRIG_PROCESS_HPP

#include <sys/types.h>

#include <string>
#include <vector>

#include "scratch.hpp"

namespace rig_bench {

class SimrigProcess {
  public:
    /// Starts it and waits until it listens. `scene`: "": an evenly lit board, fast to render;
    /// otherwise the name of a simrig scene.
    explicit SimrigProcess(const std::string &scene = "",
                           const std::vector<std::string> &arguments = {});
    ~SimrigProcess();
    SimrigProcess(const SimrigProcess &) = delete;
    SimrigProcess &operator=(const SimrigProcess &) = delete;

    /// Its address: unix:PATH.
    const std::string &where() const { return where_; }
    /// Ends it at once, like a crash.
    void kill();

  private:
    scratch folder_;
    std::string where_;
    pid_t process_ = -1;
};

}  // namespace rig_bench

#endif
