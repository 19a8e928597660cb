// SPDX-License-Identifier: Apache-2.0
// The session that a calibration capture writes: resumed, never mixed with another instrument's.
#include "tools/host/capture/capture_session.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <vector>

#include "daemon/session/session_write.h"
#include "scratch.hpp"
#include "synthetic/seed.hpp"
#include "tools/host/capture/capture_directory.hpp"
#include "tools/host/capture/capture_noise.hpp"

namespace {

const calib::board board = {3, 2, 24, "4x4_50", 17};

/// A session of one pair, as it comes from an instrument with this serial number.
void make_incoming(const std::string &path, const char *camera, uint16_t value, int moved_q4 = 0,
                   uint16_t column_px = 0) {
    message last_error{};
    std::filesystem::remove_all(path);
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    const auto writer = std::make_unique<session_writer>();
    REQUIRE(session_writer_begin(writer.get(), AT_FDCWD, path.c_str(), "v1", "rig",
                                 "2026-11-22T03:00:00Z", &last_error) == 0);
    pair_instrument instrument{};
    std::snprintf(instrument.camera[0], sizeof instrument.camera[0], "%s", camera);
    REQUIRE(session_writer_instrument(writer.get(), &instrument, &last_error) == 0);
    REQUIRE(session_writer_command(writer.get(), "capture readings=16", &last_error) == 0);
    const auto made = std::make_unique<pair>();
    std::vector<uint16_t> pixels[2];
    for (size_t side = 0; side < 2; side++) {
        pixels[side].assign(64, static_cast<uint16_t>(value + side));
        pair_frame &frame = made->frame[side];
        frame.image.data = pixels[side].data();
        frame.image.width_px = frame.image.height_px = 8;
        frame.image.stride = 8;
        frame.window = {column_px, 0, 1};
        frame.image.bits = 10;
        frame.image.layout = RAW_BAYER_GRBG;
        frame.begin_us = 1000000 + 20000 * side;
        frame.end_us = frame.begin_us + 20000;
        frame.before.pan_q4 = frame.after.pan_q4 = 24000;
        for (size_t axis = 0; axis < LENS_AXES; axis++) {
            frame.before.lens[axis] = frame.after.lens[axis] = {4800 + value, 4};
        }
    }
    made->frame[1].after.lens[LENS_FOCUS].position_q4 += moved_q4;
    REQUIRE(session_writer_pair(writer.get(), made.get(), &last_error) == 0);
    REQUIRE(session_writer_end(writer.get(), &last_error) == 0);
}

void see(capture_shot *shot, uint32_t position) {
    shot->position = int(position);
    for (calib::board_view &view : shot->view) {
        view.corners = {{0, 1.5, 2.5, 0.02}, {4, 5.25, 2.5, 0.04}};
    }
}

// A session's first pair.
void add_pair(capture_session *session, const std::string &incoming, capture_shot *shot) {
    std::string error;
    make_incoming(incoming, "left 1", 100);
    REQUIRE(session->look(incoming, shot, &error));
    see(shot, 1);
    REQUIRE(session->add(incoming, *shot, &error));
}

// A whole session of one pair.
void make_session(const std::string &path, const std::string &incoming) {
    std::string error;
    capture_shot shot;
    capture_session session(path, board);
    add_pair(&session, incoming, &shot);
    CHECK(session.close(&error));
}

}  // namespace

TEST_CASE("pairs are added to one session, which is resumed by the next run") {
    const scratch folder;
    const std::string path = folder / "zooms", incoming = path + "/incoming";
    std::string error;
    for (uint32_t run = 1; run <= 3; run++) {
        capture_session session(path, board);
        REQUIRE_MESSAGE(session.load(&error), error);
        CHECK(session.shots().size() == 2 * (run - 1));
        for (uint32_t i = 0; i < 2; i++) {
            capture_shot shot;
            make_incoming(incoming, "left 1", static_cast<uint16_t>(100 * run + 10 * i));
            REQUIRE_MESSAGE(session.look(incoming, &shot, &error), error);
            CHECK(shot.moved.empty());
            CHECK(shot.begin_us == 1000000);
            CHECK(shot.end_us == 1040000);
            CHECK(shot.axes[1].zoom_counts == doctest::Approx(300 + (100 * run + 10 * i) / 16.0));
            see(&shot, run);
            REQUIRE_MESSAGE(session.add(incoming, shot, &error), error);
        }
        if (run != 2) {  // the second run ends without a word, as by a kill
            CHECK(session.close(&error));
        }
    }
    capture_session session(path, board);
    REQUIRE(session.load(&error));
    REQUIRE(session.shots().size() == 6);
    for (size_t i = 0; i < 6; i++) {
        const capture_shot &shot = session.shots()[i];
        CHECK(shot.position == int(1 + i / 2));
        CHECK(shot.pan_q4[0] == 24000);
        REQUIRE(shot.view[1].corners.size() == 2);
        CHECK(shot.view[1].corners[1].index == 4);
        CHECK(shot.view[1].corners[1].x_px == doctest::Approx(5.25));
        CHECK(shot.view[1].corners[1].sigma_px == doctest::Approx(0.04).epsilon(1e-4));
    }
    // Another board, square, dictionary or marker would spoil what there is.
    for (const calib::board &another :
         {calib::board{4, 2, 24, "4x4_50", 17}, calib::board{3, 2, 25, "4x4_50", 17},
          calib::board{3, 2, 24, "4x4_100", 17}, calib::board{3, 2, 24, "4x4_50", 18}}) {
        capture_session other(path, another);
        CHECK(!other.load(&error));
        CHECK(error.find("begun with --board 3x2 --square 24 --charuco 4x4_50 --marker 17") !=
              std::string::npos);
    }
}

TEST_CASE("a session of another instrument, or of another kind, is left alone") {
    const scratch folder;
    const std::string path = folder / "zooms", incoming = path + "/incoming";
    std::string error;
    capture_shot shot;
    make_session(path, incoming);
    capture_session session(path, board);
    REQUIRE(session.load(&error));
    make_incoming(incoming, "left 2", 200);
    REQUIRE(session.look(incoming, &shot, &error));
    see(&shot, 2);
    CHECK(!session.add(incoming, shot, &error));
    CHECK(error.find("another instrument") != std::string::npos);
    capture_session again(path, board);
    REQUIRE(again.load(&error));
    CHECK(again.shots().size() == 1);

    make_incoming(folder / "plain", "left 1", 100);
    capture_session plain(folder / "plain", board);
    CHECK(!plain.load(&error));
    CHECK(error.find("not a session of") != std::string::npos);
}

TEST_CASE("a session of another window is left alone") {
    const scratch folder;
    const std::string path = folder / "zooms", incoming = path + "/incoming";
    std::string error;
    capture_shot shot;
    make_session(path, incoming);
    capture_session session(path, board);
    REQUIRE(session.load(&error));
    CHECK(session.check_window({{{0, 0, 8, 8}, {0, 0, 8, 8}}}, &error));
    CHECK(!session.check_window({{{0, 0, 8, 8}, {0, 0, 8, 6}}}, &error));
    CHECK(error.find("right window") != std::string::npos);
    make_incoming(incoming, "left 1", 200, 0, 4);
    CHECK(!session.look(incoming, &shot, &error));
    CHECK(error.find("left window of 8 x 8 px at 0, 0") != std::string::npos);
    CHECK(error.find('\n') == std::string::npos);
}

TEST_CASE("the noise of a corner is measured from still frames, and kept") {
    std::mt19937_64 random(synthetic::test_seed());
    std::normal_distribution<double> normal;
    // Of the corners, of all together, and a step of the board in the middle.
    const auto stills = [&](double noise_px, double shake_px, double step_px) {
        std::vector<capture_still> frames(30);
        for (size_t f = 0; f < frames.size(); f++) {
            for (calib::board_view &view : frames[f]) {
                const double all_px = shake_px * normal(random) + (f >= 15 ? step_px : 0);
                for (int i = 0; i < 54; i++) {
                    view.corners.push_back({i, 40.0 * (i % 9) + all_px + noise_px * normal(random),
                                            40.0 * (i / 9) + noise_px * normal(random), 0.02});
                }
            }
        }
        return frames;
    };
    session_corner_noise noise{};
    REQUIRE(capture_noise_of(stills(0.03, 0, 0), &noise));
    CHECK(noise.frames == 30);
    for (const double px : noise.px) {
        CHECK(px == doctest::Approx(0.03 * std::sqrt(2.0)).epsilon(0.1));
    }
    CHECK(capture_noise_of(stills(0, 0, 0), &noise));
    CHECK(!capture_noise_of(stills(0.03, 0, 0.2), &noise));
    CHECK(!capture_noise_of(stills(0.03, 0.05, 0), &noise));
    CHECK(noise.frames == 0);
    std::vector<capture_still> covered = stills(0.03, 0, 0);
    covered[7][1].corners.resize(5);
    CHECK(!capture_noise_of(covered, &noise));
    CHECK(!capture_noise_of({}, &noise));

    const scratch folder;
    const std::string path = folder / "zooms", incoming = path + "/incoming";
    std::string error;
    capture_shot shot;
    {
        capture_session session(path, board);
        add_pair(&session, incoming, &shot);
        CHECK(session.noise().frames == 0);
        REQUIRE(session.add_noise({{0.0312, 0.0298}, 30}, &error));
        REQUIRE(session.add(incoming, shot, &error));
    }
    capture_session session(path, board);
    REQUIRE(session.load(&error));
    CHECK(session.noise().frames == 30);
    CHECK(session.noise().px[0] == doctest::Approx(0.0312));
    CHECK(session.noise().px[1] == doctest::Approx(0.0298));
}

TEST_CASE("a ring that moves while a pair is taken is named, noise is not") {
    const scratch folder;
    std::string error;
    for (const int moved_q4 : {-30, 30, 60}) {
        const std::string path = folder / std::to_string(moved_q4);
        capture_session session(path, board);
        capture_shot shot;
        make_incoming(path + "/incoming", "left 1", 100, moved_q4);
        REQUIRE(session.look(path + "/incoming", &shot, &error));
        CHECK(shot.moved == (moved_q4 == 60 ? "right focus" : ""));
    }
}

TEST_CASE("a full disk is one sentence, and what was there before remains") {
    const scratch folder;
    const std::string path = folder / "zooms", incoming = path + "/incoming";
    std::string error;
    capture_shot shot;
    {
        capture_session session(path, board);
        add_pair(&session, incoming, &shot);
    }
    {
        capture_session session(path, board);
        REQUIRE(session.load(&error));
        make_incoming(incoming, "left 1", 200);
        REQUIRE(session.look(incoming, &shot, &error));
        see(&shot, 2);
        rlimit before{};
        getrlimit(RLIMIT_FSIZE, &before);
        const auto handled = std::signal(SIGXFSZ, SIG_IGN);
        const rlimit full = {100, before.rlim_max};
        setrlimit(RLIMIT_FSIZE, &full);
        CHECK(!session.add(incoming, shot, &error));
        setrlimit(RLIMIT_FSIZE, &before);
        std::signal(SIGXFSZ, handled);
        CHECK(!error.empty());
        CHECK(error.find('\n') == std::string::npos);
    }
    capture_session session(path, board);
    REQUIRE_MESSAGE(session.load(&error), error);
    REQUIRE(session.shots().size() == 1);
    CHECK(session.shots()[0].view[0].corners.size() == 2);
    make_incoming(incoming, "left 1", 200);
    REQUIRE(session.look(incoming, &shot, &error));
    see(&shot, 2);
    REQUIRE_MESSAGE(session.add(incoming, shot, &error), error);
    CHECK(session.close(&error));
}

TEST_CASE("a capture uses only a directory of its own, and removes only what it put there") {
    namespace fs = std::filesystem;
    const scratch folder;
    std::string error;
    const fs::path zooms = folder / "zooms", outside = folder / "outside";
    {
        capture_directory here(zooms.string());
        CHECK(here.check(&error));
        CHECK(!fs::exists(zooms));
        REQUIRE_MESSAGE(here.make(&error), error);
        REQUIRE_MESSAGE(here.draw("<svg/>", &error), error);
        for (int i = 0; i < 2; i++) {
            REQUIRE_MESSAGE(here.renew(&error), error);
            CHECK(fs::is_empty(here.incoming()));
            std::ofstream(here.incoming() + "/frame.pnm") << "1";
        }
        // What others put there in the meantime.
        fs::create_directory(zooms / "incoming");
        std::ofstream(zooms / "incoming/mine.txt") << "1";
        fs::create_directory(outside);
        std::ofstream(outside / "mine.txt") << "1";
        fs::create_directory_symlink(outside, here.incoming() + "/link");
    }
    CHECK(fs::exists(zooms / "incoming/mine.txt"));
    CHECK(fs::exists(outside / "mine.txt"));
    // Left before its first pair, it can be used again; with things of others, it is refused.
    capture_directory again(zooms.string());
    CHECK(!again.check(&error));
    CHECK(error.find("zooms contains incoming") != std::string::npos);
    fs::remove_all(zooms / "incoming");
    CHECK_MESSAGE(again.check(&error), error);
    // A guide.svg of the user is not ours.
    fs::create_directory(folder / "plain");
    std::ofstream(folder / "plain/guide.svg") << "mine";
    CHECK(!capture_directory(folder / "plain").check(&error));
    CHECK(error.find("guide.svg") != std::string::npos);
}
