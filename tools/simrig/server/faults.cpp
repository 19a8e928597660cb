// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "tools/simrig/server/control.hpp"

namespace simrig {

namespace {

using Action = std::function<void()>;

size_t side_at(const Words &words) {
    return one_of(word_at(words, 2, "left or right"), {"left", "right"}, "side");
}

Action fault_servo(Rig &rig, const Words &words) {
    const size_t side = side_at(words);
    const bool jam = one_of(word_at(words, 3, "jam or free"), {"free", "jam"}, "servo fault") == 1;
    no_more_than(words, 4);
    return [&rig, side, jam] { rig.servo(int(side)).jam(rig.now_us(), jam); };
}

Action fault_lens(Rig &rig, const Words &words) {
    const size_t side = side_at(words);
    const size_t axis =
        one_of(word_at(words, 3, "the motor"), {"zoom", "focus", "iris"}, "lens motor");
    const bool jam = one_of(word_at(words, 4, "jam or free"), {"free", "jam"}, "motor fault") == 1;
    no_more_than(words, 5);
    return [&rig, side, axis, jam] {
        rig.lenses().motor(side, LensAxis(axis)).jam(rig.now_us(), jam);
    };
}

Action fault_camera(Rig &rig, const Words &words) {
    const size_t side = side_at(words);
    const std::string &kind = word_at(words, 3, "a camera's fault");
    SensorFaults faults;
    switch (one_of(kind, {"ok", "unplug", "silent", "stuck", "torn"}, "camera fault")) {
        case 1:
            faults.unplugged = true;
            break;
        case 2:
            faults.silent = true;
            break;
        case 3:
            faults.sda_stuck = true;
            break;
        case 4:
            faults.torn_bits = uint16_t(1u << unsigned(number_at(words, 4, "the bit", 0, 9)));
            break;
        default:
            break;
    }
    no_more_than(words, faults.torn_bits != 0 ? 5 : 4);
    return [&rig, side, faults] { rig.sensor(int(side)).set_faults(faults); };
}

Action fault_bus(Rig &rig, const Words &words) {
    const size_t line = one_of(word_at(words, 2, "the line"), {"ok", "sda", "scl"}, "bus fault");
    BusFaults faults;
    faults.sda_stuck = line == 1;
    faults.scl_stuck = line == 2;
    no_more_than(words, 3);
    return [&rig, faults] { rig.host().set_faults(faults); };
}

Action fault_serial(Rig &rig, const Words &words) {
    const std::string &kind = word_at(words, 2, "a serial fault");
    SerialFaults faults;
    switch (one_of(kind, {"ok", "silent", "late", "split", "garbage", "lost"}, "serial fault")) {
        case 1:
            faults.silent = true;
            break;
        case 2:
            faults.late_ms = number_at(words, 3, "the delay in ms", 0, 60000);
            break;
        case 3:
            faults.split_ms = number_at(words, 3, "the pause in ms", 0, 60000);
            break;
        case 4:
            faults.garbage_chance = number_at(words, 3, "the share of bytes", 0, 1);
            break;
        case 5:
            faults.lost_chance = number_at(words, 3, "the share of bytes", 0, 1);
            break;
        default:
            break;
    }
    no_more_than(words, kind == "ok" || kind == "silent" ? 3 : 4);
    return [&rig, faults] { rig.serial().faults = faults; };
}

}  // namespace

Action fault_of(Rig &rig, const Words &words) {
    const std::string &part = word_at(words, 1, "a part");
    switch (one_of(part, {"servo", "lens", "camera", "bus", "serial"}, "part")) {
        case 0:
            return fault_servo(rig, words);
        case 1:
            return fault_lens(rig, words);
        case 2:
            return fault_camera(rig, words);
        case 3:
            return fault_bus(rig, words);
        default:
            return fault_serial(rig, words);
    }
}

}  // namespace simrig
