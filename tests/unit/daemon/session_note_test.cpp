// SPDX-License-Identifier: Apache-2.0
// A note is added to a session, or the session stays as it was.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "core/error.h"
#include "daemon/session/session_write.h"
#include "scratch.hpp"

namespace {

std::string read_text(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

TEST_CASE("a disk that is full anywhere within a note or the end leaves the session as it was") {
    const scratch folder;
    const std::string path = folder / "session";
    const auto writer = std::make_unique<session_writer>();
    message why{};
    REQUIRE(session_writer_begin(writer.get(), AT_FDCWD, path.c_str(), "v1", "rig",
                                 "2026-11-29T03:00:00Z", &why) == ERROR_OK);
    REQUIRE(session_writer_end(writer.get(), &why) == ERROR_OK);
    const std::string before = read_text(path + "/session.index");
    REQUIRE(session_add_note(AT_FDCWD, path.c_str(), "# measure fit=360", &why) == ERROR_OK);
    const std::string noted = read_text(path + "/session.index");
    REQUIRE(noted.size() > before.size());
    rlimit unlimited{};
    REQUIRE(getrlimit(RLIMIT_FSIZE, &unlimited) == 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    for (rlim_t size = noted.size(); size < 2 * noted.size() - before.size(); size++) {
        const rlimit limit = {size, unlimited.rlim_max};
        REQUIRE(setrlimit(RLIMIT_FSIZE, &limit) == 0);
        CHECK(session_add_note(AT_FDCWD, path.c_str(), "# measure fit=250", &why) == ERROR_FULL);
        REQUIRE(setrlimit(RLIMIT_FSIZE, &unlimited) == 0);
        CHECK(read_text(path + "/session.index") == noted);
    }
    std::signal(SIGXFSZ, handler);
    CHECK(session_add_note(AT_FDCWD, path.c_str(), "# measure fit=250", &why) == ERROR_OK);
}
