// SPDX-License-Identifier: Apache-2.0
// The table-driven command line.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "daemon/base/message.h"
#include "daemon/cli/help.h"
#include "daemon/cli/options.h"
#include "daemon/surface/reconstruct_request.h"
#include "stereo/reconstruct.h"

namespace {

struct values {
    bool flag = false;
    int number = 7;
    int pair[2] = {0, 0};
    double reals[2] = {0, 0};
    const char *text = nullptr;
    int choice = -1;
};

const command_argument table[] = {
    {"flag", COMMAND_FLAG, offsetof(values, flag), nullptr, "A flag.", 0, 0, 0, 0, nullptr, nullptr,
     false, nullptr, nullptr},
    {"number", COMMAND_INTEGER, offsetof(values, number), "N", "A number.", -5, 10, 0, 0, nullptr,
     nullptr, false, nullptr, nullptr},
    {"size", COMMAND_INTEGER, offsetof(values, pair), "WxH", "A size.", 1, 100, 2, 'x', nullptr,
     nullptr, false, nullptr, nullptr},
    {"range", COMMAND_NUMBER, offsetof(values, reals), "A:B", "A range.", -1, INFINITY, 2, ':',
     nullptr, nullptr, false, nullptr, nullptr},
    {"text", COMMAND_TEXT, offsetof(values, text), "FILE", "A file.", 0, 0, 0, 0, nullptr, nullptr,
     false, nullptr, nullptr},
    {"kind", COMMAND_CHOICE, offsetof(values, choice), "KIND", "A kind.", 0, 0, 0, 0, "red green",
     nullptr, false, nullptr, nullptr},
};

option_page page_of(int operands_min, int operands_max) {
    option_page page{};
    page.command = "vergence test";
    page.operands = "ONE TWO";
    page.summary = "nothing";
    page.description = "First paragraph.\nSecond paragraph.";
    page.options = table;
    page.option_count = sizeof table / sizeof table[0];
    page.operands_min = operands_min;
    page.operands_max = operands_max;
    return page;
}

struct outcome {
    int code;
    values result;
    std::vector<std::string> operands;
    std::vector<std::string> words;  // the parsed text points into them
};

outcome parse(std::vector<std::string> words) {
    const option_page page = page_of(0, 2);
    words.insert(words.begin(), "test");
    outcome made{};
    made.words = std::move(words);
    std::vector<char *> argv;
    for (std::string &word : made.words) {
        argv.push_back(word.data());
    }
    const char *operands[2] = {nullptr, nullptr};
    int count = 0;
    made.result = values();
    made.code = options_parse(&page, static_cast<int>(argv.size()), argv.data(), &made.result,
                              operands, &count);
    for (int i = 0; i < count; i++) {
        made.operands.emplace_back(operands[i]);
    }
    return made;
}

int reconstruct_code(std::vector<std::string> words) {
    words.insert(words.begin(), {"reconstruct", "l.png", "r.png"});
    std::vector<char *> argv;
    for (std::string &word : words) {
        argv.push_back(word.data());
    }
    reconstruct_request request;
    return reconstruct_request_parse(static_cast<int>(argv.size()), argv.data(), &request);
}

}  // namespace

TEST_CASE("values are parsed in every spelling") {
    const outcome made =
        parse({"left", "--flag", "--number", "-5", "--size=3x4", "--range", "-0.5:inf", "--text",
               "--odd name", "--kind", "green", "--", "--right"});
    REQUIRE(made.code == OPTIONS_CONTINUE);
    CHECK(made.result.flag);
    CHECK(made.result.number == -5);
    CHECK(made.result.pair[0] == 3);
    CHECK(made.result.pair[1] == 4);
    CHECK(made.result.reals[0] == -0.5);
    CHECK(std::isinf(made.result.reals[1]));
    CHECK(std::string(made.result.text) == "--odd name");
    CHECK(made.result.choice == 1);
    CHECK(made.operands == std::vector<std::string>{"left", "--right"});
    CHECK(parse({"-"}).operands == std::vector<std::string>{"-"});
}

TEST_CASE("errors are reported and leave the value unchanged") {
    const std::vector<std::vector<std::string>> wrong = {
        {"--nothing"},           {"-f"},
        {"--flag=maybe"},        {"--number"},
        {"--number", "11"},      {"--number", "-6"},
        {"--number", ""},        {"--number", " 1"},
        {"--number", "1.5"},     {"number=5", "a", "b"},
        {"--number", "1 1"},     {"--size", "3"},
        {"--size", "3x"},        {"--size", "3x4x5"},
        {"--size", "3,4"},       {"--range", "1:nan"},
        {"--range", "1:0x8p1"},  {"--range", "infinity"},
        {"--range", "-2:1"},     {"--text="},
        {"--kind", "blue"},      {"--kind", "gre"},
        {"--kind", "red green"}, {"--kind", ""},
        {"one", "two", "three"}, {"--number", "99999999999999999999"},
    };
    for (const std::vector<std::string> &words : wrong) {
        CAPTURE(words[0]);
        CAPTURE(words.back());
        const outcome made = parse(words);
        CHECK(made.code == CLIENT_USAGE);
        CHECK(made.result.number == 7);
    }
}

TEST_CASE("help names every option within 80 columns") {
    char *text = nullptr;
    size_t length = 0;
    FILE *stream = open_memstream(&text, &length);
    const option_page page = page_of(1, 2);
    options_help_print(&page, stream);
    REQUIRE(std::fclose(stream) == 0);
    const std::string help(text, length);
    std::free(text);
    for (const command_argument &entry : table) {
        CHECK(help.find(std::string("--") + entry.name) != std::string::npos);
    }
    CHECK(help.find("First paragraph.\n\nSecond paragraph.") != std::string::npos);
    size_t begin = 0;
    for (size_t end; (end = help.find('\n', begin)) != std::string::npos; begin = end + 1) {
        CHECK(end - begin <= 80);
    }
}

TEST_CASE("reconstruct rejects contradictory options") {
    const std::vector<std::string> good = {"--calibration", "c", "--out", "o"};
    CHECK(reconstruct_code(good) == OPTIONS_CONTINUE);
    const std::vector<std::vector<std::string>> additions = {
        {"--near", "5", "--far", "5"},
        {"--near", "9", "--far", "5"},
        {"--near", "5", "--far", "9", "--disparity", "0:16"},
        {"--disparity", "5:0"},
        {"--disparity", "5:-3"},
        {"--region", "1,1,0,5"},
        {"--region", "1,1,5,0"},
        {"--focal", "100"},
        {"--mask", "m.png"},
        {"--rectified", "--baseline", "5"},
        {"--ground-truth-scale", "4"},
    };
    for (const std::vector<std::string> &addition : additions) {
        CAPTURE(addition[0]);
        std::vector<std::string> words = good;
        words.insert(words.end(), addition.begin(), addition.end());
        CHECK(reconstruct_code(words) == CLIENT_USAGE);
    }
    CHECK(reconstruct_code({"--out", "o"}) == CLIENT_USAGE);
    CHECK(reconstruct_code({"--calibration", "c"}) == CLIENT_USAGE);
    CHECK(reconstruct_code({"--rectified", "--unit", "m", "--out", "o"}) == CLIENT_USAGE);
    CHECK(reconstruct_code({"--rectified", "--out", "o"}) == OPTIONS_CONTINUE);
}

TEST_CASE("help states the actual defaults") {
    const reconstruct_options defaults = reconstruct_default_options();
    reconstruct_request request;
    char name[] = "reconstruct", left[] = "l", right[] = "r", out[] = "--out", directory[] = "o";
    char rectified[] = "--rectified";
    char *argv[] = {name, left, right, out, directory, rectified};
    REQUIRE(reconstruct_request_parse(6, argv, &request) == OPTIONS_CONTINUE);
    CHECK(request.scale == defaults.rectify.scale);
    CHECK(request.speckle_px == -1);
    CHECK(defaults.speckle_px == 60);
    CHECK(defaults.refine);
    CHECK_FALSE(defaults.keep_all);
}

TEST_CASE("a message is one line") {
    message text;
    CHECK(message_set(&text, -3, "%s is %d", "a\nb\tc\x7f", 5) == -3);
    CHECK(std::string(text.text) == "a?b?c? is 5");
    message_set(&text, 0, "%s", std::string(5000, 'x').c_str());
    CHECK(std::string(text.text).size() == MESSAGE_BYTES - 1);
}
