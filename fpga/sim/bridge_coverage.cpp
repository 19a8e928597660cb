// SPDX-License-Identifier: Apache-2.0
#include "bridge_coverage.hpp"

#if VM_COVERAGE
#include <array>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <mutex>

#include "verilated_bridge.hpp"
#include "verilated_cov.h"

namespace {

constexpr size_t kPoints = sizeof(Vbridge_sim__Syms::__Vcoverage) / sizeof(uint32_t);
std::mutex lock;
std::array<uint64_t, kPoints> sums;

// Verilator's file is written by one model, as counts and places belong together.
void write() {
    const char *path = std::getenv("VERGENCE_COVERAGE");
    if (path == nullptr) {
        return;
    }
    VerilatedContext context;
    Vbridge_sim top(&context, "");
    for (size_t i = 0; i < kPoints; i++) {
        top.rootp->vlSymsp->__Vcoverage[i] = uint32_t(sums[i] < UINT32_MAX ? sums[i] : UINT32_MAX);
    }
    context.coveragep()->write(path);
}

}  // namespace

void add_coverage(Vbridge_sim &top) {
    const std::lock_guard<std::mutex> guard(lock);
    static const bool first = std::atexit(write) == 0;
    for (size_t i = 0; first && i < kPoints; i++) {
        sums[i] += top.rootp->vlSymsp->__Vcoverage[i];
    }
}
#endif
