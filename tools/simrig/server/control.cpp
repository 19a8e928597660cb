// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/control.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "tools/simrig/render/picture.hpp"
#include "tools/simrig/server/staging.hpp"
#include "tools/simrig/server/view.hpp"
#include "tools/simrig/wire/log.hpp"
#include "tools/simrig/world/document.hpp"

namespace simrig {

namespace {

// Eleven days: times in picoseconds fit 64 bits.
constexpr double kLatestS = 1e6;
// Limit of an object's position and rotation, in mm and degrees.
constexpr double kFarthest = 1e6;
// Times the light of the scene's file.
constexpr double kBrightest = 1e6;
constexpr size_t kMoveWords = 2, kPlaceNumbers = 3;

[[noreturn]] void refuse(const std::string &what) {
    throw std::runtime_error(what);
}

/// The file may be readable by simrig only: clients must not see its content.
template <typename Load>
auto loaded(Load load) -> decltype(load()) {
    try {
        return load();
    } catch (const world::BadFile &error) {
        std::fprintf(stderr, "simrig: %s\n", error.what());
        refuse(error.place() + ": not a scene; simrig reports why on its standard error");
    }
}

size_t side_at(const Words &words, size_t at) {
    return one_of(word_at(words, at, "left or right"), {"left", "right"}, "side");
}

size_t axis_at(const Words &words, size_t at) {
    return one_of(word_at(words, at, "the motor"), {"zoom", "focus", "iris"}, "lens motor");
}

/// Commands that may also run later.
const Words kActions = {"fault", "scene", "move", "light", "cap", "ring"};

}  // namespace

Words words_of(const std::string &line) {
    std::istringstream stream(line);
    Words words;
    for (std::string word; stream >> word;) {
        words.push_back(one_line(word));
    }
    return words;
}

size_t one_of(const std::string &word, const Words &choices, const std::string &what) {
    std::string list;
    for (size_t i = 0; i < choices.size(); i++) {
        if (word == choices[i]) {
            return i;
        }
        list += (list.empty() ? "" : ", ") + choices[i];
    }
    refuse("unknown " + what + " '" + word + "' (expected " + list + ")");
}

const std::string &word_at(const Words &words, size_t at, const std::string &what) {
    if (at >= words.size()) {
        refuse(what + " is missing; see help");
    }
    return words[at];
}

void no_more_than(const Words &words, size_t count) {
    if (words.size() > count) {
        refuse("unexpected argument '" + words[count] + "'; see help");
    }
}

double number_at(const Words &words, size_t at, const std::string &what, double low, double high) {
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
        line << what << " must be a number from " << low << " to " << high << ", not '" << text
             << "'";
        refuse(line.str());
    }
    return value;
}

ControlServer::ControlServer(Rig &rig, Stage &stage, const std::string &scene, std::string files)
    : rig_(rig), stage_(stage), staging_(scene), files_(std::move(files)) {}

std::string ControlServer::help() {
    return "status                              time, pan angles and pulses, lens positions\n"
           "scene NAME|FILE                     another scene from the next frame on\n"
           "move OBJECT X Y Z [RX RY RZ]        moves an object of the scene: mm and degrees, as\n"
           "                                    position_mm and turn_deg in the scene's file\n"
           "truth left|right NAME [BEGIN_US]    writes the truth of the last frame, or of that "
           "whose "
           "begin is\n"
           "                                    nearest, to --files: NAME.pfm (depth in mm),\n"
           "                                    NAME_normal.pfm, NAME_object.pgm, NAME.yaml (the "
           "camera, and\n"
           "                                    the objects' names)\n"
           "view NAME                           writes what both cameras see now, and a drawing:\n"
           "                                    NAME_left.png, NAME_right.png, NAME_rig.svg\n"
           "light SHARE [SECONDS]               the scene's light, as a share of its file's; at "
           "once, or\n"
           "                                    linearly over so many seconds\n"
           "cap left|right on|off               the lens cap\n"
           "ring left|right zoom|focus|iris COUNT\n"
           "                                    turned there by hand, at once\n"
           "sharp left|right COLUMN ROW COLUMNS ROWS\n"
           "                                    of this part of the array: its depths, the focus\n"
           "                                    positions for them, where the ring is, the blur "
           "now\n"
           "fault servo left|right jam|free\n"
           "fault lens left|right zoom|focus|iris jam|free\n"
           "fault camera left|right unplug|silent|stuck|torn BIT|ok\n"
           "                                    stuck: SDA held low; torn: this data bit reads 0\n"
           "fault bus sda|scl|ok                this line of the DSP's bus is held low\n"
           "fault serial silent|late MS|split MS|garbage PART|lost PART|ok\n"
           "                                    of the lens controller's line; PART: share of "
           "bytes, "
           "0 to 1\n"
           "at SECONDS COMMAND                  the same at that time of the rig: fault, scene, "
           "move,\n"
           "                                    light, cap or ring\n"
           "snapshot NAME                       saves this moment (virtual time only)\n"
           "restore NAME                        returns to it\n";
}

std::string ControlServer::run(const std::string &command) {
    const Words words = words_of(command);
    const std::string &name = word_at(words, 0, "a command");
    if (name == "help" || name == "status") {
        no_more_than(words, 1);
        return name == "help" ? help() : status();
    }
    if (name == "truth") {
        return truth(words);
    }
    if (name == "sharp") {
        return sharp(words);
    }
    if (name == "view") {
        return view(words);
    }
    if (name == "at") {
        return at(words);
    }
    if (std::find(kActions.begin(), kActions.end(), name) != kActions.end()) {
        const Action what = action(words);
        what.run();
        return what.answer;
    }
    refuse("unknown command '" + name + "'; see help");
}

ControlServer::Action ControlServer::action(const Words &words) {
    switch (one_of(word_at(words, 0, "a command"), kActions, "command")) {
        case 0:
            return {fault_of(rig_, words), ""};
        case 1:
            return change_scene(words);
        case 2:
            return move(words);
        case 3:
            return light(words);
        case 4:
            return cap(words);
        default:
            return ring(words);
    }
}

ControlServer::Action ControlServer::light(const Words &words) {
    const double share = number_at(words, 1, "the share of the light", 0, kBrightest);
    const double ramp_us =
        words.size() > 2 ? 1e6 * number_at(words, 2, "the time in seconds", 0, kLatestS) : 0;
    no_more_than(words, 3);
    return {[this, share, ramp_us] {
                const double now_us = rig_.now_us();
                stage_.set_light(share, now_us, now_us + ramp_us);
            },
            ""};
}

ControlServer::Action ControlServer::cap(const Words &words) {
    const auto side = int(side_at(words, 1));
    const bool on = one_of(word_at(words, 2, "on or off"), {"off", "on"}, "state of the cap") == 1;
    no_more_than(words, 3);
    return {[this, side, on] { stage_.set_cap(side, on); }, ""};
}

ControlServer::Action ControlServer::ring(const Words &words) {
    const size_t side = side_at(words, 1);
    const auto axis = LensAxis(axis_at(words, 2));
    const LensMotorSettings &motor = rig_.lenses().motor(side, axis).settings();
    const double counts =
        number_at(words, 3, "the ring's position", motor.stop_low, motor.stop_high);
    no_more_than(words, 4);
    return {
        [this, side, axis, counts] { rig_.lenses().motor(side, axis).put(rig_.now_us(), counts); },
        ""};
}

std::string ControlServer::sharp(const Words &words) {
    const auto side = int(side_at(words, 1));
    const auto part = [&words](size_t at, const char *what, int limit) {
        return int(number_at(words, at, what, 0, limit));
    };
    world::Window window;
    window.column = part(2, "the column", world::kArrayColumns);
    window.row = part(3, "the row", world::kArrayRows);
    window.columns = part(4, "the number of columns", world::kArrayColumns);
    window.rows = part(5, "the number of rows", world::kArrayRows);
    no_more_than(words, 6);
    if (window.fault() != nullptr) {
        refuse(window.fault());
    }
    const world::Mechanics now = Stage::mechanics(rig_.state(side));
    const world::RigCamera &camera = stage_.rig().of(world::Side(side));
    const world::Optics optics = world::camera_at(camera, now).optics;
    std::ostringstream text;
    text.precision(7);
    text << "focus: " << now.focus << "\nf_number: " << optics.f_number
         << "\nspot_px: " << optics.spot_rms_px << "\n";
    // The nearest and farthest, and in between where a half of the part is nearer.
    std::vector<float> depth_mm = stage_.depth_mm(side, window, now);
    depth_mm.erase(std::remove(depth_mm.begin(), depth_mm.end(), 0.0F), depth_mm.end());
    std::sort(depth_mm.begin(), depth_mm.end());
    const char *const names[] = {"nearest", "median", "farthest"};
    for (size_t i = 0; i < 3 && !depth_mm.empty(); i++) {
        const double mm = depth_mm[i * (depth_mm.size() - 1) / 2];
        const double diameter_px = optics.pupil_diameter_mm * optics.focal_px *
                                   std::abs(1 / optics.focus_distance_mm - 1 / mm);
        text << names[i] << ": {depth_mm: " << mm
             << ", focus: " << world::focus_position_for(camera.lens, now.zoom, mm)
             << ", blur_px: " << diameter_px << "}\n";
    }
    return text.str();
}

// The answer holds the file's sum, so that a replay notices a changed file.
ControlServer::Action ControlServer::change_scene(const Words &words) {
    const std::string path = place_of("scenes", word_at(words, 1, "the scene"));
    no_more_than(words, 2);
    auto scene = loaded([&] { return staging_.change(path); });
    char sum[32];
    std::snprintf(sum, sizeof sum, "crc32 %08x\n", unsigned(sum_of(description_at(path))));
    return {[this, scene] { stage_.set_scene(scene); }, sum};
}

ControlServer::Action ControlServer::move(const Words &words) {
    const std::string &object = word_at(words, 1, "the object");
    std::vector<double> place;
    while (place.size() < kPlaceNumbers || kMoveWords + place.size() < words.size()) {
        place.push_back(number_at(words, kMoveWords + place.size(), "a position in mm or degrees",
                                  -kFarthest, kFarthest));
    }
    if (place.size() != kPlaceNumbers && place.size() != 2 * kPlaceNumbers) {
        refuse("a move needs three positions in mm, and optionally three rotations in degrees");
    }
    auto scene = loaded([&] { return staging_.move(object, place); });
    return {[this, scene] { stage_.set_scene(scene); }, ""};
}

std::string ControlServer::status() {
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
                      "%s: {pan_deg: %.4f, pan_driven: %s, pan_moves: %s, zoom: %.2f, "
                      "focus: %.2f, iris: %.2f, lens_moves: %s}\n",
                      names[side], state.pan_deg,
                      rig_.servo(side).driven(now_us) ? "true" : "false",
                      rig_.servo(side).moving(now_us) ? "true" : "false", state.zoom, state.focus,
                      state.iris, moves ? "true" : "false");
        text << line;
    }
    return text.str();
}

const Stage::Pictured &ControlServer::pictured(int camera) const {
    const Stage::Pictured *pictured = stage_.pictured(camera);
    if (pictured == nullptr) {
        refuse("no frame of this camera was taken yet");
    }
    return *pictured;
}

world::Truth ControlServer::truth_of(int camera, int first_row, int rows) const {
    const int all = pictured(camera).rows;
    if (first_row + rows > all) {
        refuse("the camera's last frame has " + std::to_string(all) + " rows");
    }
    return stage_.truth(camera, first_row, rows);
}

std::string ControlServer::truth(const Words &words) {
    const size_t side = side_at(words, 1);
    const std::string &name = word_at(words, 2, "a name for the files");
    no_more_than(words, 4);
    const std::string path = place_for(files_, name);
    if (words.size() == 4) {
        stage_.recall(int(side), number_at(words, 3, "the begin of a frame", 0, 1e13));
    }
    const world::Truth truth = truth_of(int(side), 0, pictured(int(side)).rows);
    world::write_depth_pfm(path + ".pfm", truth);
    world::write_normal_pfm(path + "_normal.pfm", truth);
    world::write_object_pgm(path + "_object.pgm", truth);
    world::write_camera_yaml(path + ".yaml", truth);
    return name + ".pfm\n" + name + "_normal.pfm\n" + name + "_object.pgm\n" + name + ".yaml\n";
}

std::string ControlServer::view(const Words &words) {
    const std::string &name = word_at(words, 1, "a name for the files");
    no_more_than(words, 2);
    View view;
    for (int side = 0; side < BRIDGE_CAMERAS; side++) {
        view.mechanics[size_t(side)] = Stage::mechanics(rig_.state(side));
    }
    write_view(stage_.scene(), stage_.rig(), view, place_for(files_, name) + "_");
    return name + "_left.png\n" + name + "_right.png\n" + name + "_rig.svg\n";
}

std::string ControlServer::at(const Words &words) {
    const double time_s = number_at(words, 1, "the time in seconds", 0, kLatestS);
    if (time_s * 1e6 < rig_.now_us()) {
        refuse("that time has passed");
    }
    const Action later = action(Words(words.begin() + 2, words.end()));
    rig_.wires().at(uint64_t(std::llround(time_s * 1e12)), later.run);
    return later.answer;
}

}  // namespace simrig
