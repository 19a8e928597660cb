// SPDX-License-Identifier: Apache-2.0
// The Verilated bridge, with its vector of triggers (the clocks that have an edge now) as bits of
// one word: the original array of bool takes a fifth of the simulation's time.
#ifndef VERGENCE_FPGA_SIM_VERILATED_BRIDGE_HPP
#define VERGENCE_FPGA_SIM_VERILATED_BRIDGE_HPP

#include "verilated_config.h"

// Other versions may use their own class differently; they keep it.
#if VERILATOR_VERSION_INTEGER == 5006000

#define VlTriggerVec VlTriggerVecOfVerilator
#include "verilated.h"
#undef VlTriggerVec

template <std::size_t T_size>
class VlTriggerVec final {
    static_assert(T_size <= 64, "the bits of one word");

    struct Bit {
        uint64_t &word;
        std::size_t place;
        Bit &operator=(unsigned value) {
            word = (word & ~(uint64_t{1} << place)) | uint64_t{(value & 1u) != 0} << place;
            return *this;
        }
        // Not shifted to bit 0, so that tests for several bits are one mask.
        operator uint64_t() const { return word & uint64_t{1} << place; }
    };

    uint64_t bits_ = 0;

  public:
    void clear() { bits_ = 0; }
    Bit at(std::size_t place) { return Bit{bits_, place}; }
    bool any() const { return bits_ != 0; }
    void set(const VlTriggerVec &other) { bits_ |= other.bits_; }
    void andNot(const VlTriggerVec &a, const VlTriggerVec &b) { bits_ = a.bits_ & ~b.bits_; }
};

#endif

#include "Vbridge_sim.h"
#include "Vbridge_sim__Syms.h"
#include "Vbridge_sim___024root.h"

// Verilator stores each clock's level to find its edges. Makes it believe that the control clock
// was low; false: this version of Verilator names the variable differently.
template <class Root>
auto believe_clock_low(Root &root, int) -> decltype(root.__Vtrigrprev__TOP__clk_i = 0, bool()) {
    root.__Vtrigrprev__TOP__clk_i = 0;
    return true;
}
template <class Root>
bool believe_clock_low(Root &, long) {
    return false;
}

#endif
