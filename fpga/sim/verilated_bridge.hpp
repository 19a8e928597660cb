// SPDX-License-Identifier: Apache-2.0
// What Verilator made of the bridge, with its vector of triggers (which clocks have an edge now) as
// bits of one word: as the array of bool that it is, it is a fifth of the simulation's time.
#ifndef VERGENCE_FPGA_SIM_VERILATED_BRIDGE_HPP
#define VERGENCE_FPGA_SIM_VERILATED_BRIDGE_HPP

#include "verilated_config.h"

// Other versions may use their own class otherwise; they keep it.
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
        // Not moved to place 0, so that questions for several bits are one mask.
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

// Verilator remembers each clock's level to find its edges. Makes it believe that it has seen the
// control clock low; false: this version of Verilator calls its memory by another name.
template <class Root>
auto believe_clock_low(Root &root, int) -> decltype(root.__Vtrigrprev__TOP__clk_i = 0, bool()) {
    root.__Vtrigrprev__TOP__clk_i = 0;
    return true;
}
template <class Root>
bool believe_clock_low(Root &, long) {
    return false;
}

// One past the last of the registers. What follows is Verilator's own, after bytes that nobody
// sets.
template <class Root>
auto end_of_registers(const Root &root, int)
    -> decltype(root.bridge_sim__DOT__core__DOT__counters__DOT__memory,
                static_cast<const unsigned char *>(nullptr)) {
    return reinterpret_cast<const unsigned char *>(
        &root.bridge_sim__DOT__core__DOT__counters__DOT__memory + 1);
}
template <class Root>
const unsigned char *end_of_registers(const Root &root, long) {
    return reinterpret_cast<const unsigned char *>(&root.vlSymsp);
}

#endif
