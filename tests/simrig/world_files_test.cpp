// SPDX-License-Identifier: Apache-2.0
// Scene and rig files: the shipped ones can be read; bad ones are refused in one line with the
// place. Also: what must not change a frame does not.
#include <doctest/doctest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/simrig/world_harness.hpp"
#include "tools/simrig/world/document.hpp"

using namespace world_harness;

namespace {

const char *const kScene =
    "room: {origin_mm: [0, 0, 1800], tilt_deg: 0}\n"                                    // 1
    "lights: []\n"                                                                      // 2
    "ambient: [300, 300, 300]\n"                                                        // 3
    "floor_ambient: [300, 300, 300]\n"                                                  // 4
    "bounce_lux: 0\n"                                                                   // 5
    "materials:\n"                                                                      // 6
    "  - m: {kind: paper, colours: [[0.5, 0.5, 0.5]]}\n"                                // 7
    "  - c: {kind: clay, colours: [[0.5, 0.5, 0.5]]}\n"                                 // 8
    "objects:\n"                                                                        // 9
    "  - sheet: {name: s, material: m, position_mm: [0, 0, 0], size_mm: [600, 400]}\n"  // 10
    "  - solid:\n"                                                                      // 11
    "      name: b\n"                                                                   // 12
    "      material: c\n"                                                               // 13
    "      position_mm: [0, 0, -60]\n"                                                  // 14
    "      parts:\n"                                                                    // 15
    "        - ball: {centre_mm: [0, 0, 0], radius_mm: 30}\n";                          // 16

std::string replaced(std::string text, const std::string &what, const std::string &by) {
    const std::size_t at = text.find(what);
    REQUIRE(at != std::string::npos);
    return text.replace(at, what.size(), by);
}

std::string rejection(const std::string &text, bool as_rig) {
    const ShortLivedFile bad(text);
    try {
        as_rig ? static_cast<void>(world::load_rig(bad.path()))
               : static_cast<void>(world::load_scene(bad.path()));
    } catch (const world::BadFile &error) {
        const std::string what = error.what();
        REQUIRE(what.rfind(bad.path(), 0) == 0);
        CHECK(what.find('\n') == std::string::npos);
        return what.substr(bad.path().size());
    }
    return "accepted";
}

std::string contents(const std::string &path) {
    std::ifstream stream(path);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
}

}  // namespace

TEST_CASE("every mistake in a scene is named with its line") {
    struct Case {
        const char *what, *by, *expected;
    };
    const Case cases[] = {
        {"bounce_lux: 0", "bounce_lux: no", ":5: not a number: 'no'"},
        {"bounce_lux: 0", "bounce: 0", ":5: unknown key 'bounce'"},
        {"kind: clay", "kind: cheese", ":8: unknown material 'cheese'"},
        {"radius_mm: 30", "radius_mm: -3", ":16: -3 is not between 0.1 and 1000"},
        {"radius_mm: 30", "radius: 3", ":16: unknown key 'radius'"},
        {"ball", "ghost", ":16: unknown part 'ghost'"},
        {"ball", "\"two\\nlines\"", ":16: unknown part 'two?lines'"},
        {"ball", "[1, 2]", ":16: not a word"},
        {"size_mm: [600, 400]", "size_mm: [600]", ":10: expected 2 numbers"},
        {"material: m", "material: q", ":10: unknown material 'q'"},
        {"material: c", "material: m", ":13: this material cannot"},
        {"[[0.5, 0.5, 0.5]]", "[[0.5, 1.5, 0.5]]", ":7: a colour's channels"},
        {"kind: clay", "kind: clay, brightness: 9", ":8: only paper"},
        {"lights: []", "lights: {", ":"},
        {"tilt_deg: 0", "tilt_deg: .nan", ":1: not a number"},
        {"ambient: [300, 300, 300]\n", "", ":1: 'ambient' is missing"},
        {"      name: b\n", "", ":12: 'name' is missing"},
    };
    CHECK(rejection(kScene, false) == "accepted");
    for (const Case &c : cases) {
        const std::string answer = rejection(replaced(kScene, c.what, c.by), false);
        CHECK_MESSAGE(answer.rfind(c.expected, 0) == 0, answer);
    }
    CHECK(rejection("", false) != "accepted");
    CHECK(rejection("- 1\n", false) != "accepted");
    CHECK_THROWS_AS(world::load_scene("/nowhere/scene.yaml"), world::BadFile);
}

TEST_CASE("every mistake in a rig is named with its line") {
    const std::string rig = contents(file("rigs/default.yaml"));
    CHECK(rejection(rig, true) == "accepted");
    using Mistake = std::pair<const char *, const char *>;
    for (const Mistake &mistake : std::initializer_list<Mistake>{
             {"bow_mm: -0.45", "bow_mm: banana"},
             {"serial: 1", "serial: 1.5"},
             {"frequency_hz: 100", "frequency_hz: 0"},
             {"axis_direction: [0.004, 1, -0.003]", "axis_direction: [0, 0, 0]"},
             {"mains:", "main:"}}) {
        const std::string answer = rejection(replaced(rig, mistake.first, mistake.second), true);
        CHECK_MESSAGE(answer != "accepted", mistake.first);
        CHECK(answer[0] == ':');
        CHECK(std::atoi(answer.c_str() + 1) > 0);
    }
}

TEST_CASE("the program refuses a bad file with one line and a code that is not 0") {
    const ShortLivedFile bad(replaced(kScene, "ball", "ghost"));
    const ShortLivedFile said("");
    const auto run = [&](const std::string &arguments) {
        const std::string command =
            std::string(SIMRIG_RENDER) + " " + arguments + " 2> " + said.path();
        return WEXITSTATUS(std::system(command.c_str()));
    };
    CHECK(run(bad.path() + " " + file("rigs/default.yaml") + " --out /nowhere/x") == 1);
    const std::string text = contents(said.path());
    CHECK(text.find(bad.path() + ":16: unknown part 'ghost'\n") != std::string::npos);
    CHECK(std::count(text.begin(), text.end(), '\n') == 1);
    const ShortLivedFile good(kScene);
    const std::string both = good.path() + " " + file("rigs/default.yaml");
    CHECK(run(both + " --out /nowhere/x --window 0,0,64,64") == 1);
    CHECK(run(both + " --out x --zoom 900") == 2);
    CHECK(run(both + " --out x --window 1,0,64,64") == 2);
    CHECK(run(both + " --out x --wide 4") == 2);
}

TEST_CASE("the same bytes for any number of threads; other bytes for another seed or frame") {
    const world::Scene scene = scene_of(kScene);
    const world::Rig rig = world::load_rig(file("rigs/default.yaml"));
    world::FrameRequest request = steady(straight(rig, 600, 1750, 800));
    request.window = {800, 600, 320, 200, 1, 1, 1, 1};
    const world::Frame one = world::render(scene, rig, world::Side::kRight, request);
    request.threads = 3;
    CHECK(world::render(scene, rig, world::Side::kRight, request).pixels == one.pixels);
    const world::Scene again = scene_of(kScene);
    CHECK(world::render(again, rig, world::Side::kRight, request).pixels == one.pixels);
    request.seed = 2;
    CHECK(world::render(scene, rig, world::Side::kRight, request).pixels != one.pixels);
    request.seed = 1;
    request.frame = 2;
    CHECK(world::render(scene, rig, world::Side::kRight, request).pixels != one.pixels);
}

TEST_CASE("the light of a camera at rest is kept, which changes no byte") {
    const world::Scene scene = scene_of(kScene);
    const world::Rig rig = world::load_rig(file("rigs/default.yaml"));
    const world::Mechanics rest = straight(rig, 600, 1750, 800);
    world::Mechanics moved = rest;
    moved.focus += 0.5;
    world::StillLight kept;
    int traced = 0;
    const auto check = [&](const world::FrameRequest &request) {
        const std::vector<float> before = kept.lux;
        const world::Frame alone = world::render(scene, rig, world::Side::kLeft, request);
        const world::Frame frame = world::render(scene, rig, world::Side::kLeft, request, &kept);
        CHECK(frame.pixels == alone.pixels);
        traced += kept.lux != before;
    };
    world::FrameRequest request = steady(rest);
    request.window = {800, 600, 64, 48, 2, 2, 2, 1};
    for (request.frame = 1; request.frame <= 3; request.frame++) {
        request.start_time_us += 1234;  // another phase of the mains
        request.gains.analog[0] = double(request.frame);
        check(request);
    }
    CHECK(traced == 1);
    request.exposure_us *= 2;
    check(request);
    request.mechanics = [&](double) { return moved; };
    check(request);
    request.window.column += 2;
    check(request);
    request.light = [](double) { return 0.5; };
    check(request);
    CHECK(traced == 5);
    // It moves within the frame: nothing of this is kept.
    const double then_us = request.start_time_us + request.exposure_us / 2;
    request.mechanics = [&](double time_us) { return time_us < then_us ? rest : moved; };
    check(request);
    CHECK(traced == 5);
}

TEST_CASE("a window shows what the whole frame shows there") {
    const world::Scene scene = scene_of(kScene);
    const world::Rig rig = perfect_rig();
    world::FrameRequest request = steady(straight(rig, 600, 1750, 600));
    request.exposure_us = 60000;
    request.window = {800, 600, 320, 200, 1, 1, 1, 1};
    const world::Frame whole = world::render(scene, rig, world::Side::kLeft, request);
    request.window = {854, 634, 102, 78, 1, 1, 1, 1};
    const world::Frame part = world::render(scene, rig, world::Side::kLeft, request);
    int different = 0;
    for (int y = 0; y < part.rows; y++) {
        for (int x = 0; x < part.columns; x++) {
            const int a = part.pixels[static_cast<std::size_t>(y * part.columns + x)];
            const int b = whole.pixels[static_cast<std::size_t>((y + 34) * whole.columns + x + 54)];
            different += std::abs(a - b) > 1;
        }
    }
    // Blocks lie differently, and with them which pixels begin with two rays.
    CHECK(different < part.rows * part.columns / 100);
}

TEST_CASE("truth is at the window's pixels") {
    const world::Scene scene = scene_of(kScene);
    const world::Rig rig = perfect_rig();
    world::FrameRequest request = steady(straight(rig, 500, 1750, 600));
    request.window = {600, 400, 512, 512, 1, 1, 1, 1};
    const world::Truth whole = world::truth(scene, rig, world::Side::kLeft, request);
    request.window.skip_x = request.window.skip_y = 4;
    const world::Truth thin = world::truth(scene, rig, world::Side::kLeft, request);
    for (int y = 0; y < thin.rows; y += 3) {
        for (int x = 0; x < thin.columns; x += 3) {
            const int array_x = 8 * (x / 2) + x % 2;
            const int array_y = 8 * (y / 2) + y % 2;
            const double a =
                static_cast<double>(thin.depth_mm[static_cast<std::size_t>(y * thin.columns + x)]);
            const double b = static_cast<double>(
                whole.depth_mm[static_cast<std::size_t>(array_y * whole.columns + array_x)]);
            CHECK(a == doctest::Approx(b).epsilon(1e-6));
        }
    }
}

TEST_CASE("invalid windows are refused") {
    const world::Scene scene = scene_of(kScene);
    const world::Rig rig = perfect_rig();
    world::FrameRequest request = steady(straight(rig, 500, 1750, 600));
    for (const world::Window &w :
         {world::Window{-2, 0, 64, 64, 1, 1, 1, 1}, world::Window{2000, 0, 64, 64, 1, 1, 1, 1},
          world::Window{0, 0, 63, 64, 1, 1, 1, 1}, world::Window{0, 0, 64, 64, 1, 1, 2, 1},
          world::Window{0, 0, 4, 4, 16, 16, 1, 1}}) {
        request.window = w;
        CHECK_THROWS_AS(world::render(scene, rig, world::Side::kLeft, request),
                        std::invalid_argument);
    }
}

TEST_CASE("all shipped scenes can be rendered") {
    const world::Rig rig = world::load_rig(file("rigs/default.yaml"));
    for (const char *name :
         {"cylinder", "mug", "figurine", "level", "still_life", "plane", "chessboard", "charuco"}) {
        const world::Scene scene = world::load_scene(file(std::string("scenes/") + name + ".yaml"));
        for (const world::Side side : {world::Side::kLeft, world::Side::kRight}) {
            world::Mechanics m = straight(rig, 480, 1800, 600);
            m.pan_rad = rig.of(side).pan_rad;
            world::FrameRequest request = steady(m);
            request.window = {824, 568, 400, 400, 4, 4, 1, 1};
            request.exposure_us = 60000;
            const world::Frame frame = world::render(scene, rig, side, request);
            double sum = 0;
            for (const std::uint16_t pixel : frame.pixels) {
                sum += pixel;
            }
            const double mean = sum / static_cast<double>(frame.pixels.size());
            CHECK(mean > 60);
            CHECK(mean < 900);
            const world::Truth truth = world::truth(scene, rig, side, request);
            CHECK(truth.id[truth.id.size() / 2] > 0);
        }
    }
}
