// SPDX-License-Identifier: Apache-2.0
// The corner cache: round trip, mrgingham's and mrcal's formats, and errors with their line.
#include <doctest/doctest.h>

#include <cmath>
#include <sstream>

#include "calib/base/corner_cache.hpp"

namespace {

calib::board small_board() {
    calib::board board;
    board.columns = 3;
    board.rows = 2;
    board.square_mm = 10;
    return board;
}

std::vector<calib::cached_view> some_views() {
    calib::cached_view whole{"images/left01.png", {}}, part{"left02.png", {}},
        none{"left03.png", {}};
    for (int i = 0; i < 6; i++) {
        whole.view.corners.push_back({i, 10.123456 * i, 3.5 + i, 0.01 + 0.003 * i});
        if (i % 2 == 1) {
            part.view.corners.push_back({i, 5.0 + i, 1000.25, 0.2});
        }
    }
    part.view.clipped = 0.83;
    part.view.white_first = part.view.layout_open = true;
    none.view.rejection = "no board found";
    return {whole, part, none};
}

std::string read_error(const std::string &text) {
    std::istringstream in(text);
    std::vector<calib::cached_view> views = {{"untouched", {}}};
    std::string error;
    CHECK_FALSE(calib::corner_cache_read(in, small_board(), &views, &error));
    CHECK(views.size() == 1);
    return error;
}

}  // namespace

TEST_CASE("implausible standard deviations are rejected") {
    for (const char *sigma : {"1e-300", "9e-7", "1001", "0", "-1", "nan"}) {
        CHECK(read_error("## a corner of level 0 has a standard deviation of " +
                         std::string(sigma) + " px\n")
                  .find("line 1: the standard deviation") == 0);
    }
    for (const char *weight : {"1e300", "1e-300"}) {
        CHECK(read_error("# filename x y weight\na.png 1 2 " + std::string(weight) + "\n")
                  .find("line 2: the weight") == 0);
    }
}

TEST_CASE("a cache is read back as it was written") {
    const std::vector<calib::cached_view> views = some_views();
    std::ostringstream out;
    std::string error;
    REQUIRE(calib::corner_cache_write(out, small_board(), views, &error));
    CHECK(out.str().find("\n# filename x y level\n") != std::string::npos);
    std::istringstream in(out.str());
    std::vector<calib::cached_view> back;
    REQUIRE(calib::corner_cache_read(in, small_board(), &back, &error));
    REQUIRE(back.size() == views.size());
    for (size_t i = 0; i < views.size(); i++) {
        CHECK(back[i].filename == views[i].filename);
        CHECK(back[i].view.clipped == doctest::Approx(views[i].view.clipped).epsilon(1e-6));
        CHECK(back[i].view.white_first == views[i].view.white_first);
        CHECK(back[i].view.layout_open == views[i].view.layout_open);
        CHECK(back[i].view.rejection.empty() == views[i].view.rejection.empty());
        REQUIRE(back[i].view.corners.size() == views[i].view.corners.size());
        for (size_t k = 0; k < views[i].view.corners.size(); k++) {
            const calib::corner &a = back[i].view.corners[k], &b = views[i].view.corners[k];
            CHECK(a.index == b.index);
            CHECK(a.x_px == doctest::Approx(b.x_px).epsilon(1e-6));
            CHECK(a.y_px == doctest::Approx(b.y_px).epsilon(1e-6));
            CHECK(a.sigma_px == doctest::Approx(b.sigma_px).epsilon(1e-5));
        }
    }
}

TEST_CASE("other programs' formats are read") {
    std::vector<calib::cached_view> views;
    std::string error;
    std::istringstream mrgingham(
        "# filename x y level\n"
        "a.png 1 2 0\na.png 3 4 1\na.png 5 6 -\na.png - - -\na.png 7 8 -1\na.png 9 10 2\n"
        "b.png - - -\n");
    REQUIRE(calib::corner_cache_read(mrgingham, small_board(), &views, &error));
    REQUIRE(views.size() == 2);
    REQUIRE(views[0].view.corners.size() == 3);
    CHECK(views[0].view.corners[1].sigma_px ==
          doctest::Approx(2 * views[0].view.corners[0].sigma_px));
    CHECK(views[0].view.corners[2].index == 5);
    CHECK(views[1].view.corners.empty());
    CHECK(views[1].view.rejection != "");
    std::istringstream weights(
        "# filename x y weight\n"
        "a 1 2 1\na 3 4 0.25\na 5 6 0\na 1 2 1\na 1 2 1\na 1 2 1\n");
    REQUIRE(calib::corner_cache_read(weights, small_board(), &views, &error));
    REQUIRE(views[0].view.corners.size() == 5);
    CHECK(views[0].view.corners[1].sigma_px ==
          doctest::Approx(4 * views[0].view.corners[0].sigma_px));
    std::istringstream plain("a 1 2\na 3 4\na 5 6\na 1 2\na 1 2\na 1 2\n");
    REQUIRE(calib::corner_cache_read(plain, small_board(), &views, &error));
    CHECK(views[0].view.corners.size() == 6);
}

TEST_CASE("an invalid corner cache is rejected with its line") {
    CHECK(read_error("a 1 2 3 4\n") == "line 1: expected 'filename x y level'");
    CHECK(read_error("a 1\n") == "line 1: expected 'filename x y level'");
    CHECK(read_error("# x y\na 1 2\n") ==
          "line 1: unknown columns (expected 'filename x y level')");
    CHECK(read_error("a one 2 0\n") == "line 1: expected numbers or '-' after the name");
    CHECK(read_error("a 1 nan 0\n") == "line 1: expected numbers or '-' after the name");
    CHECK(read_error("a 1 2 0\na 1 2 0\n").find("'a' has 2 corners, the board has 6") !=
          std::string::npos);
    CHECK(read_error("a 1 2\na 1 2\na 1 2\na 1 2\na 1 2\na 1 2\na 1 2\n") ==
          "line 7: 'a' has more corners than the board");
    std::ostringstream out;
    std::string error;
    for (const char *name : {"", "two words", "#hash", "tab\there"}) {
        CHECK_FALSE(calib::corner_cache_write(out, small_board(), {{name, {}}}, &error));
        CHECK(error.find("corner cache") != std::string::npos);
    }
    CHECK(out.str().empty());
}
