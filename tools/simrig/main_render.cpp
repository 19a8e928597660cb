// SPDX-License-Identifier: Apache-2.0
// simrig-render: writes what one camera of a rig sees of a scene.
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <string>

#include "tools/simrig/render/picture.hpp"
#include "tools/simrig/streams.hpp"
#include "tools/simrig/world/document.hpp"

namespace {

using world::Side;

constexpr const char *kUsage =
    "usage: simrig-render SCENE RIG --out PREFIX [OPTION VALUE]...\n"
    "\n"
    "Writes what one camera of a rig sees of a scene: PREFIX.png (developed), PREFIX.pgm (the "
    "10-bit\n"
    "mosaic), PREFIX.pfm (true depth, mm), PREFIX_object.pgm (the object at each pixel) and\n"
    "PREFIX.yaml (the camera). Defaults follow the semicolons.\n"
    "\n"
    "  --camera left|right   which camera; left\n"
    "  --zoom POSITION       of the motor, 300 to 850; 300 (1x)\n"
    "  --focus POSITION      of the motor, 300 to 850; follows --distance\n"
    "  --distance MM         focus distance, at least 300; 1800\n"
    "  --iris POSITION       of the motor, 300 to 850; 850 (open)\n"
    "  --pan DEGREES         of the pan axis, -180 to 180; from the rig file\n"
    "  --window COLUMN,ROW,COLUMNS,ROWS\n"
    "                        the part of the sensor to read; all of it\n"
    "  --skip N, --bin N     1 to 16 pixels in both directions; 1\n"
    "  --exposure US         1 to 10000000; 20000\n"
    "  --gain FACTOR         of all colours, 0.01 to 128; 1\n"
    "  --brightness FACTOR   of PREFIX.png only, 0.01 to 100; 1\n"
    "  --seed N              of the noise; 1\n"
    "  --threads N           1 to 64; 1\n"
    "  --time                print the CPU time\n"
    "  --help, --version     print this text, or the version\n"
    "\n"
    "Exit code: 0 written, 1 failure, 2 wrong usage.\n";

struct Options {
    std::string scene, rig, out;
    Side side = Side::kLeft;
    double zoom = 300;
    double focus = -1;
    double distance_mm = 1800;
    double iris = 850;
    double pan_rad = 0;
    bool has_pan = false;
    bool timed = false;
    double gain = 1;
    double brightness = 1;
    world::FrameRequest request;
};

[[noreturn]] void refuse(const std::string &what) {
    throw std::invalid_argument(what);
}

double number(const std::string &option, const char *text, double low, double high) {
    char *end = nullptr;
    const double value = std::strtod(text, &end);
    if (end == text || *end != '\0' || !(value >= low && value <= high)) {
        char range[96];
        std::snprintf(range, sizeof range, " must be a number from %g to %g, not ", low, high);
        refuse(option + range + "'" + text + "'");
    }
    return value;
}

void set_window(world::Window &w, const char *text) {
    int used = 0;
    if (std::sscanf(text, "%d,%d,%d,%d%n", &w.column, &w.row, &w.columns, &w.rows, &used) != 4 ||
        text[used] != '\0') {
        refuse("--window must be COLUMN,ROW,COLUMNS,ROWS, not '" + std::string(text) + "'");
    }
}

/// Sets an option that is one number and nothing else.
bool set_number(Options &o, const std::string &name, const char *value) {
    struct Number {
        const char *name;
        double *target;
        double min, max;
    };
    const Number numbers[] = {
        {"--zoom", &o.zoom, 300, 850},
        {"--focus", &o.focus, 300, 850},
        {"--distance", &o.distance_mm, 300, 1e7},
        {"--iris", &o.iris, 300, 850},
        {"--exposure", &o.request.exposure_us, 1, 1e7},
        {"--gain", &o.gain, 0.01, 128},
        {"--brightness", &o.brightness, 0.01, 100},
    };
    for (const Number &one : numbers) {
        if (name == one.name) {
            *one.target = number(name, value, one.min, one.max);
            return true;
        }
    }
    return false;
}

void set_camera(Options &o, const char *value) {
    if (std::strcmp(value, "left") != 0 && std::strcmp(value, "right") != 0) {
        refuse("--camera must be left or right");
    }
    o.side = std::strcmp(value, "left") == 0 ? Side::kLeft : Side::kRight;
}

void set_option(Options &o, const std::string &name, const char *value) {
    world::FrameRequest &r = o.request;
    if (set_number(o, name, value)) {
        return;
    }
    if (name == "--out") {
        o.out = value;
    } else if (name == "--camera") {
        set_camera(o, value);
    } else if (name == "--pan") {
        o.pan_rad = world::radians(number(name, value, -180, 180));
        o.has_pan = true;
    } else if (name == "--window") {
        set_window(r.window, value);
    } else if (name == "--skip") {
        r.window.skip_x = r.window.skip_y = static_cast<int>(number(name, value, 1, 16));
    } else if (name == "--bin") {
        r.window.bin_x = r.window.bin_y = static_cast<int>(number(name, value, 1, 16));
    } else if (name == "--seed") {
        r.seed = static_cast<std::uint64_t>(number(name, value, 0, 9e15));
    } else if (name == "--threads") {
        r.threads = static_cast<int>(number(name, value, 1, 64));
    } else {
        refuse("unknown option '" + name + "'");
    }
}

Options parsed(int count, char **arguments) {
    Options options;
    for (int i = 1; i < count; i++) {
        const std::string name = arguments[i];
        if (name == "--time") {
            options.timed = true;
        } else if (name.rfind("--", 0) == 0) {
            if (i + 1 >= count) {
                refuse(name + ": value missing");
            }
            set_option(options, name, arguments[++i]);
        } else if (options.scene.empty()) {
            options.scene = name;
        } else if (options.rig.empty()) {
            options.rig = name;
        } else {
            refuse("unexpected argument '" + name + "'");
        }
    }
    if (options.rig.empty() || options.out.empty()) {
        refuse("SCENE, RIG and --out are required");
    }
    return options;
}

void run(Options &o) {
    const world::Rig rig = world::load_rig(o.rig);
    const world::Scene scene = world::load_scene(o.scene);
    const world::RigCamera &camera = rig.of(o.side);
    world::Mechanics mechanics;
    mechanics.pan_rad = o.has_pan ? o.pan_rad : camera.pan_rad;
    mechanics.zoom = o.zoom;
    mechanics.focus =
        o.focus >= 0 ? o.focus : world::focus_position_for(camera.lens, o.zoom, o.distance_mm);
    mechanics.iris = o.iris;
    o.request.mechanics = [mechanics](double) { return mechanics; };
    for (double &gain : o.request.gains.analog) {
        gain = o.gain;
    }
    const std::clock_t begin = std::clock();
    const world::Frame frame = world::render(scene, rig, o.side, o.request);
    const double cpu_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    if (o.timed) {
        std::printf("%d x %d pixels in %.3f CPU seconds\n", frame.columns, frame.rows, cpu_s);
    }
    world::write_png(o.out + ".png", world::developed(frame, camera.sensor, o.brightness));
    world::write_raw_pgm(o.out + ".pgm", frame);
    const world::Truth truth = world::truth(scene, rig, o.side, o.request);
    world::write_depth_pfm(o.out + ".pfm", truth);
    world::write_object_pgm(o.out + "_object.pgm", truth);
    world::write_camera_yaml(o.out + ".yaml", truth);
}

/// The exit code: 1 when the output could not be written.
int print(const char *text) {
    if (std::fputs(text, stdout) < 0 || std::fflush(stdout) != 0) {
        std::fprintf(stderr, "simrig-render: cannot write standard output: %s\n",
                     std::strerror(errno));
        return 1;
    }
    return 0;
}

}  // namespace

int main(int count, char **arguments) {
    if (!occupy_standard_streams()) {
        return 1;
    }
    for (int i = 1; i < count; i++) {
        if (std::strcmp(arguments[i], "--help") == 0) {
            return print(kUsage);
        }
        if (std::strcmp(arguments[i], "--version") == 0) {
            return print("simrig-render " SIMRIG_RELEASE "\n");
        }
    }
    try {
        Options options = parsed(count, arguments);
        run(options);
        return print("");
    } catch (const std::invalid_argument &error) {
        std::fprintf(stderr, "simrig-render: %s; see simrig-render --help\n", error.what());
        return 2;
    } catch (const std::exception &error) {
        std::fprintf(stderr, "simrig-render: %s\n", error.what());
        return 1;
    }
}
