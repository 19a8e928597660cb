// SPDX-License-Identifier: Apache-2.0
// Recordings with modified results: whatever they contain, a replay ends with a verdict or with one
// line that gives the reason, and never crashes.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>

#include "core/crc.h"
#include "daemon/backends/replay/play.h"
#include "daemon/session/trace.h"
#include "scratch.hpp"
#include "session_harness.hpp"
#include "synthetic/seed.hpp"

using namespace session_harness;

namespace {

constexpr int kRounds = 240;

std::vector<std::string> lines_of(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) {
        lines.push_back(line);
    }
    return lines;
}

/// Writes the log with CRCs that match its modified lines.
void write_log(const std::string &path, const std::vector<std::string> &lines) {
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    std::uint32_t crc = 0;
    for (std::string line : lines) {
        if (line.compare(0, sizeof TRACE_CHECK - 1, TRACE_CHECK) == 0) {
            char check[sizeof TRACE_CHECK + SESSION_CRC_DIGITS + 1];
            std::snprintf(check, sizeof check, TRACE_CHECK "%08x", unsigned(crc));
            line = check;
        }
        line += '\n';
        crc = crc_update(crc, line.data(), line.size());
        file << line;
    }
}

std::string random_number(Random &random) {
    switch (upto(random, 5)) {
        case 0:
            return "0";
        case 1:
            return std::to_string(-static_cast<int>(upto(random, 60)));
        case 2:
            return std::to_string(upto(random, 70000));
        case 3:
            return "-2147483648";
        case 4:
            return std::to_string(random());
        default:
            return std::to_string(INT32_MAX);
    }
}

/// Modifies a word of a result: some digits of a long one, else the number.
std::string tampered(Random &random, const std::string &answer) {
    std::istringstream stream(answer);
    std::vector<std::string> words;
    for (std::string word; stream >> word;) {
        words.push_back(word);
    }
    if (words.empty()) {
        return random_number(random);
    }
    std::string &word = words[upto(random, words.size() - 1)];
    if (word.size() >= 4 && upto(random, 3) != 0) {
        for (std::uint64_t n = upto(random, 3) + 1; n > 0; n--) {
            word[upto(random, word.size() - 1)] = "0123456789abcdef"[upto(random, 15)];
        }
    } else {
        word = random_number(random);
    }
    std::string joined;
    for (const std::string &one : words) {
        joined += (joined.empty() ? "" : " ") + one;
    }
    return joined;
}

/// The lines with a result, by called function: there are few frames among many clock reads.
std::vector<std::vector<std::size_t>> calls_by_kind(const std::vector<std::string> &lines) {
    std::map<std::string, std::vector<std::size_t>> kinds;
    for (std::size_t at = 0; at < lines.size(); at++) {
        if (lines[at].find(TRACE_EQUALS) != std::string::npos) {
            const std::size_t first = lines[at].find(' ');
            kinds[lines[at].substr(0, lines[at].find(' ', first + 1))].push_back(at);
        }
    }
    std::vector<std::vector<std::size_t>> found;
    for (const auto &kind : kinds) {
        found.push_back(kind.second);
    }
    return found;
}

void tamper(Random &random, std::vector<std::string> *lines) {
    const auto kinds = calls_by_kind(*lines);
    for (std::uint64_t n = upto(random, 2) + 1; n > 0; n--) {
        const std::vector<std::size_t> &calls = kinds[upto(random, kinds.size() - 1)];
        std::string &line = (*lines)[calls[upto(random, calls.size() - 1)]];
        const std::size_t behind = line.find(TRACE_EQUALS) + sizeof TRACE_EQUALS - 1;
        // Or the result of another call of this kind: a frame of another size, another register.
        const std::string &other = (*lines)[calls[upto(random, calls.size() - 1)]];
        const std::string theirs = other.substr(other.find(TRACE_EQUALS) + sizeof TRACE_EQUALS - 1);
        line = line.substr(0, behind) +
               (upto(random, 2) == 0 ? theirs : tampered(random, line.substr(behind)));
    }
}

}  // namespace

TEST_CASE("a recording of an earlier version is refused by its version") {
    const char *const source = std::getenv("SESSION");
    REQUIRE(source != nullptr);
    const scratch folder;
    const std::string copy = folder / "session";
    std::filesystem::copy(source, copy);
    const std::string begin = "begin version=4 build=b1 profile=rig date=now";
    char crc[16];
    std::snprintf(crc, sizeof crc, " %08x\n", unsigned(crc_update(0, begin.data(), begin.size())));
    folder.write("session/session.index", begin + crc);
    const play_observer observer{};
    play_outcome outcome{};
    message why{};
    CHECK(play_session(AT_FDCWD, copy.c_str(), &observer, &outcome, &why) == ERROR_VERSION);
    CHECK(std::string(why.text).find("version 4") != std::string::npos);
    CHECK(std::string(why.text).find("build b1") != std::string::npos);
}

TEST_CASE("notes in a recording change nothing in its replay") {
    const char *const source = std::getenv("SESSION");
    REQUIRE(source != nullptr);
    const scratch folder;
    const std::string copy = folder / "session";
    std::filesystem::copy(source, copy);
    std::string index;
    const auto add = [&](const std::string &event) {
        index += event;
        char crc[16];
        std::snprintf(crc, sizeof crc, " %08x\n",
                      unsigned(crc_update(0, index.data(), index.size())));
        index += crc;
    };
    int notes = 0;
    for (const std::string &line : lines_of(std::string(source) + "/session.index")) {
        if (line.compare(0, 5, "pair ") == 0) {  // between the capture and what it gave
            add("command text=#%20measure%20step%20pair");
            notes++;
        }
        add(line.substr(0, line.rfind(' ')));
        if (line.compare(0, 8, "command ") == 0) {
            add("command text=#%20measure%20step%20move");
            notes++;
        }
    }
    REQUIRE(notes > 2);
    folder.write("session/session.index", index);
    const play_observer observer{};
    play_outcome outcome{};
    message why{};
    CHECK(play_session(AT_FDCWD, copy.c_str(), &observer, &outcome, &why) == 0);
    CAPTURE(std::string(outcome.mismatch.text));
    CHECK(outcome.same);
    CHECK(outcome.pairs == 1);
    CHECK(outcome.commands == unsigned(notes - 1));
}

TEST_CASE("modified recordings are replayed to an end") {
    const char *const source = std::getenv("SESSION");
    REQUIRE(source != nullptr);
    const char *const wanted = std::getenv("VERGENCE_TAMPER_ROUNDS");
    const int rounds = wanted != nullptr ? std::atoi(wanted) : kRounds;
    const std::uint64_t seed = synthetic::test_seed();
    CAPTURE(seed);
    Random random(seed);
    int diverged = 0, same = 0;
    for (int round = 0; round < rounds; round++) {
        const scratch folder;
        const std::string copy = folder / "session";
        std::filesystem::copy(source, copy);
        std::vector<std::string> lines = lines_of(std::string(source) + "/calls.log");
        tamper(random, &lines);
        write_log(copy + "/calls.log", lines);
        CAPTURE(round);
        const play_observer observer{};
        play_outcome outcome{};
        message why{};
        const int error = play_session(AT_FDCWD, copy.c_str(), &observer, &outcome, &why);
        CHECK((error == 0 || why.text[0] != '\0'));
        CHECK(std::string(why.text).find('\n') == std::string::npos);
        CHECK(std::string(outcome.mismatch.text).find('\n') == std::string::npos);
        diverged += error != 0 || !outcome.same;
        same += error == 0 && outcome.same;
    }
    CHECK(diverged > rounds / 4);
    std::cout << diverged << " plays departed, " << same << " did not\n";
}
