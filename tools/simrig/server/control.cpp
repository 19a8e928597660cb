// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/control.hpp"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "tools/simrig/world/document.hpp"
#include "tools/simrig/world/picture.hpp"

namespace simrig {

namespace {

[[noreturn]] void refuse(const std::string &what) {
    throw std::runtime_error(what);
}

size_t one_of(const std::string &word, const std::vector<std::string> &choices,
              const std::string &what) {
    for (size_t i = 0; i < choices.size(); i++) {
        if (word == choices[i]) {
            return i;
        }
    }
    std::string list;
    for (const std::string &choice : choices) {
        list += (list.empty() ? "" : ", ") + choice;
    }
    refuse(what + " is one of " + list + ", not '" + word + "'");
}

const std::string &word_at(const std::vector<std::string> &words, size_t at,
                           const std::string &what) {
    if (at >= words.size()) {
        refuse(what + " is missing; see help");
    }
    return words[at];
}

double number_at(const std::vector<std::string> &words, size_t at, const std::string &what,
                 double low, double high) {
    const std::string &text = word_at(words, at, what);
    size_t used = 0;
    double value = 0;
    try {
        value = std::stod(text, &used);
    } catch (const std::logic_error &) {
        used = 0;
    }
    if (used == 0 || used != text.size() || !(value >= low && value <= high)) {
        std::ostringstream line;
        line << what << " is a number from " << low << " to " << high << ", not '" << text << "'";
        refuse(line.str());
    }
    return value;
}

size_t side_at(const std::vector<std::string> &words, size_t at) {
    return one_of(word_at(words, at, "left or right"), {"left", "right"}, "a side");
}

std::string camera_text(const world::Camera &camera) {
    const world::Optics &optics = camera.optics;
    const world::Mat3 &turn = camera.world_camera.rotation;
    const world::Vec3 &pupil_mm = camera.world_camera.translation_mm;
    char text[1600];
    std::snprintf(
        text, sizeof text,
        "focal_length_px: %.9g\nfocal_length_mm: %.9g\ncentre_px: [%.9g, %.9g]\n"
        "radial: [%.9g, %.9g, %.9g]\ndecentring: [%.9g, %.9g]\npupil_mm: [%.9g, %.9g, %.9g]\n"
        "rotation_world_camera: [%.12g, %.12g, %.12g, %.12g, %.12g, %.12g, %.12g, %.12g, %.12g]\n"
        "focus_distance_mm: %.9g\nf_number: %.9g\npupil_diameter_mm: %.9g\n",
        optics.focal_px, optics.focal_length_mm, optics.centre_px.x, optics.centre_px.y,
        optics.radial[0], optics.radial[1], optics.radial[2], optics.decentring.x,
        optics.decentring.y, pupil_mm.x, pupil_mm.y, pupil_mm.z, turn.row0.x, turn.row0.y,
        turn.row0.z, turn.row1.x, turn.row1.y, turn.row1.z, turn.row2.x, turn.row2.y, turn.row2.z,
        optics.focus_distance_mm, optics.f_number, optics.pupil_diameter_mm);
    return text;
}

}  // namespace

std::string ControlDesk::help() {
    return "status                                where everything stands\n"
           "scene FILE                            another scene from the next frame on\n"
           "truth left|right PREFIX               of the last frame: PREFIX.pfm (depth in mm),\n"
           "                                      PREFIX.yaml (the camera as it was)\n"
           "view PREFIX                           what both cameras would see now, as PNG\n"
           "fault servo left|right jam|free\n"
           "fault lens left|right zoom|focus|iris jam|free\n"
           "fault camera left|right unplug|silent|stuck|torn BIT|ok\n"
           "fault bus sda|scl|ok                  somebody holds this line of the DSP's bus\n"
           "fault serial silent|late MS|split MS|garbage PART|lost PART|ok\n"
           "at SECONDS fault ...                  the same at a time of the rig\n";
}

std::string ControlDesk::run(const std::string &command) {
    std::istringstream stream(command);
    Words words;
    for (std::string word; stream >> word;) {
        words.push_back(word);
    }
    const std::string &name = word_at(words, 0, "a command");
    if (name == "help") {
        return help();
    }
    if (name == "status") {
        return status();
    }
    if (name == "scene") {
        try {
            stage_.load_scene(word_at(words, 1, "the scene's file"));
        } catch (const world::BadFile &error) {
            refuse(error.what());
        }
        return "";
    }
    if (name == "truth") {
        return truth(words);
    }
    if (name == "view") {
        return view(words);
    }
    if (name == "fault") {
        fault(words)();
        return "";
    }
    if (name == "at") {
        return at(words);
    }
    refuse("there is no command '" + name + "'; see help");
}

std::string ControlDesk::status() {
    std::ostringstream text;
    char line[200];
    std::snprintf(line, sizeof line, "time_s: %.6f\n", rig_.now_us() * 1e-6);
    text << line;
    const char *const names[] = {"left", "right"};
    for (int side = 0; side < BRIDGE_CAMERAS; side++) {
        const CameraState state = rig_.state(side);
        const double now_us = rig_.now_us();
        LensController &lenses = rig_.lenses();
        const bool moves = lenses.motor(size_t(side), kZoom).moving(now_us) ||
                           lenses.motor(size_t(side), kFocus).moving(now_us) ||
                           lenses.motor(size_t(side), kIris).moving(now_us);
        std::snprintf(line, sizeof line,
                      "%s: {pan_deg: %.4f, pan_moves: %s, zoom: %.2f, focus: %.2f, iris: %.2f, "
                      "lens_moves: %s}\n",
                      names[side], state.pan_deg,
                      rig_.servo(side).moving(now_us) ? "true" : "false", state.zoom, state.focus,
                      state.iris, moves ? "true" : "false");
        text << line;
    }
    return text.str();
}

std::string ControlDesk::truth(const Words &words) {
    const size_t side = side_at(words, 1);
    const std::string &prefix = word_at(words, 2, "the prefix of the files");
    world::Truth truth;
    if (!stage_.truth(int(side), truth)) {
        refuse("no frame of this camera has been taken yet");
    }
    world::write_depth_pfm(prefix + ".pfm", truth);
    std::ofstream file(prefix + ".yaml");
    file << camera_text(truth.camera(truth.rows / 2));
    file.close();
    if (!file) {
        refuse("cannot write " + prefix + ".yaml");
    }
    return prefix + ".pfm\n" + prefix + ".yaml\n";
}

std::string ControlDesk::view(const Words &words) {
    const std::string &prefix = word_at(words, 1, "the prefix of the files");
    const char *const names[] = {"left", "right"};
    std::string written;
    for (int side = 0; side < BRIDGE_CAMERAS; side++) {
        const CameraState state = rig_.state(side);
        world::FrameRequest request;
        request.mechanics = [&state](double) { return Stage::mechanics(state); };
        const world::Frame frame =
            world::render(stage_.scene(), stage_.rig(), world::Side(side), request);
        const std::string path = prefix + "_" + names[side] + ".png";
        const world::Sensor &sensor = stage_.rig().of(world::Side(side)).sensor;
        world::write_png(path, world::developed(frame, sensor, 1));
        written += path + "\n";
    }
    return written;
}

std::string ControlDesk::at(const Words &words) {
    const double time_s = number_at(words, 1, "the time in seconds", 0, 1e7);
    if (word_at(words, 2, "a fault") != "fault") {
        refuse("only a fault can be given a time");
    }
    const Words rest(words.begin() + 2, words.end());
    if (time_s * 1e6 < rig_.now_us()) {
        refuse("that time has passed");
    }
    rig_.wires().at(uint64_t(std::llround(time_s * 1e12)), fault(rest));
    return "";
}

ControlDesk::Deed ControlDesk::fault(const Words &words) {
    const std::string &part = word_at(words, 1, "what fails");
    switch (one_of(part, {"servo", "lens", "camera", "bus", "serial"}, "what fails")) {
        case 0:
            return fault_servo(words);
        case 1:
            return fault_lens(words);
        case 2:
            return fault_camera(words);
        case 3:
            return fault_bus(words);
        default:
            return fault_serial(words);
    }
}

ControlDesk::Deed ControlDesk::fault_servo(const Words &words) {
    const size_t side = side_at(words, 2);
    const bool jam =
        one_of(word_at(words, 3, "jam or free"), {"free", "jam"}, "a servo's fault") == 1;
    return [this, side, jam] { rig_.servo(int(side)).jam(rig_.now_us(), jam); };
}

ControlDesk::Deed ControlDesk::fault_lens(const Words &words) {
    const size_t side = side_at(words, 2);
    const size_t axis =
        one_of(word_at(words, 3, "the motor"), {"zoom", "focus", "iris"}, "a lens motor");
    const bool jam =
        one_of(word_at(words, 4, "jam or free"), {"free", "jam"}, "a motor's fault") == 1;
    return [this, side, axis, jam] {
        rig_.lenses().motor(side, LensAxis(axis)).jam(rig_.now_us(), jam);
    };
}

ControlDesk::Deed ControlDesk::fault_camera(const Words &words) {
    const size_t side = side_at(words, 2);
    const std::string &kind = word_at(words, 3, "a camera's fault");
    SensorFaults faults;
    switch (one_of(kind, {"ok", "unplug", "silent", "stuck", "torn"}, "a camera's fault")) {
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
    return [this, side, faults] { rig_.sensor(int(side)).set_faults(faults); };
}

ControlDesk::Deed ControlDesk::fault_bus(const Words &words) {
    const size_t line =
        one_of(word_at(words, 2, "the line"), {"ok", "sda", "scl"}, "a bus's fault");
    BusFaults faults;
    faults.sda_stuck = line == 1;
    faults.scl_stuck = line == 2;
    return [this, faults] { rig_.host().set_faults(faults); };
}

ControlDesk::Deed ControlDesk::fault_serial(const Words &words) {
    const std::string &kind = word_at(words, 2, "the line's fault");
    SerialFaults faults;
    switch (
        one_of(kind, {"ok", "silent", "late", "split", "garbage", "lost"}, "the line's fault")) {
        case 1:
            faults.silent = true;
            break;
        case 2:
            faults.late_ms = number_at(words, 3, "how late in ms", 0, 60000);
            break;
        case 3:
            faults.split_ms = number_at(words, 3, "the pause in ms", 0, 60000);
            break;
        case 4:
            faults.garbage_chance = number_at(words, 3, "the part of bytes", 0, 1);
            break;
        case 5:
            faults.lost_chance = number_at(words, 3, "the part of bytes", 0, 1);
            break;
        default:
            break;
    }
    return [this, faults] { rig_.serial().faults = faults; };
}

}  // namespace simrig
