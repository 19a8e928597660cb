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
    /// Starts it and waits until it listens. `scene`: "": a board in even light, quick to draw;
    /// else the name of one of simrig's.
    explicit SimrigProcess(const std::string &scene = "",
                           const std::vector<std::string> &arguments = {});
    ~SimrigProcess();
    SimrigProcess(const SimrigProcess &) = delete;
    SimrigProcess &operator=(const SimrigProcess &) = delete;

    /// Where it listens: unix:PATH.
    const std::string &where() const { return where_; }
    /// Ends it at once, as a crash would.
    void kill();

  private:
    scratch folder_;
    std::string where_;
    pid_t process_ = -1;
};

}  // namespace rig_bench

#endif
