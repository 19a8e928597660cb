// SPDX-License-Identifier: Apache-2.0
// The command parser: what is accepted, what is rejected, and with which key words.
#include "console/command.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <initializer_list>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "console/command_text.h"
#include "console/command_words.h"
#include "core/error.h"
#include "core/suggest.h"
#include "synthetic/seed.hpp"

namespace {

int run_nothing(const command_call *) {
    return 0;
}

const command_argument move_arguments[] = {
    {"SIDE", COMMAND_CHOICE, 0, nullptr, "which", 0, 0, 0, 0, "left right both", nullptr, false,
     nullptr, nullptr},
    {"ANGLE", COMMAND_NUMBER, 0, nullptr, "where to", -30.5, 30, 0, 0, nullptr, "deg", false,
     nullptr, nullptr},
    {"COUNT", COMMAND_INTEGER, 0, nullptr, "how often", 0, 255, 0, 0, nullptr, nullptr, true,
     nullptr, nullptr},
    {"NOTE", COMMAND_TEXT, 0, nullptr, "a word", 1, 8, 0, 0, nullptr, nullptr, true, nullptr,
     nullptr},
};

const command_argument focus_arguments[] = {
    {"POSITION", COMMAND_INTEGER, 0, nullptr, "where to", -5, 900, 0, 0, "infinity", "counts", true,
     nullptr, "counts x mm f/"},
    {"NOTE", COMMAND_TEXT, 0, nullptr, "a word", 1, 8, 0, 0, nullptr, nullptr, true, nullptr,
     nullptr},
};

struct Stored {
    int side = -1;
    bool still = false;
    int size[2] = {0, 0};
    double far = 0;
    const char *note = nullptr;
    double range[2] = {0, 0};
};

const command_argument expose_arguments[] = {
    {"TIME", COMMAND_INTEGER, 0, nullptr, "how long", 1, 1000, 0, 0, nullptr, "us", true, nullptr,
     nullptr},
    {"side", COMMAND_CHOICE, offsetof(Stored, side), nullptr, "which", 0, 0, 0, 0,
     "left right both", nullptr, false, nullptr, nullptr},
    {"still", COMMAND_FLAG, offsetof(Stored, still), nullptr, "wait", 0, 0, 0, 0, nullptr, nullptr,
     false, nullptr, nullptr},
    {"size", COMMAND_INTEGER, offsetof(Stored, size), "WxH", "of the window", 1, 100, 2, 'x',
     nullptr, nullptr, false, nullptr, nullptr},
    {"far", COMMAND_NUMBER, offsetof(Stored, far), "MM", "limit", 0.5, INFINITY, 0, 0, nullptr,
     "mm", false, nullptr, nullptr},
    {"note", COMMAND_TEXT, offsetof(Stored, note), "TEXT", "any", 0, 0, 0, 0, nullptr, nullptr,
     false, nullptr, nullptr},
    {"range", COMMAND_NUMBER, offsetof(Stored, range), "NEAR:FAR", "between", 1, INFINITY, 2, ':',
     nullptr, "mm", false, nullptr, nullptr},
};

const command table[] = {
    {"status", "says", "", nullptr, 0, 0, run_nothing},
    {"move", "moves", "", move_arguments, 4, 0, run_nothing},
    {"pan", "turns", "", nullptr, 0, 0, run_nothing},
    {"expose", "sets", "", expose_arguments, 7, 0, run_nothing},
    {"focus", "moves", "", focus_arguments, 2, 0, run_nothing},
};

struct Parsed {
    int error;
    std::string message;
    const command *found;
    std::vector<command_value> values;
    std::string storage;
};

Parsed parse(const std::string &line) {
    Parsed parsed;
    parsed.storage.resize(COMMAND_LINE_MAX + 1);
    parsed.values.resize(COMMAND_ARGUMENTS_MAX);
    char message[200] = "";
    parsed.found = nullptr;
    parsed.error = command_parse(line.c_str(), table, std::size(table), &parsed.storage[0],
                                 parsed.values.data(), &parsed.found, message, sizeof message);
    parsed.message = message;
    return parsed;
}

/// Checks that the message contains each of the key words.
void refused(const std::string &line, int error, std::initializer_list<const char *> words) {
    const Parsed parsed = parse(line);
    CAPTURE(line);
    CAPTURE(parsed.message);
    CHECK(parsed.error == error);
    for (const char *word : words) {
        CAPTURE(word);
        CHECK(parsed.message.find(word) != std::string::npos);
    }
}

bool is_close(double a, double b) {
    return a == b || std::abs(a - b) < 1e-9 * std::abs(b);
}

}  // namespace

TEST_CASE("a line becomes a command and its values") {
    const Parsed parsed = parse("\tmove  both -3.25 0xfF \"a \\\"b\\\\\"  # and why");
    REQUIRE(parsed.error == 0);
    REQUIRE(parsed.found == &table[1]);
    CHECK(parsed.values[0].choice == 2);
    CHECK(parsed.values[1].number == -3.25);
    CHECK(parsed.values[2].integer == 255);
    CHECK(parsed.values[3].given);
    CHECK(std::string(parsed.values[3].text) == "a \"b\\");
    const Parsed shorter = parse("move left +.5");
    REQUIRE(shorter.error == 0);
    CHECK(shorter.values[1].number == 0.5);
    CHECK_FALSE(shorter.values[2].given);
    CHECK_FALSE(shorter.values[3].given);
}

TEST_CASE("options are given by name, in any order and in both spellings") {
    for (const char *line :
         {"expose 500 side=right still=yes size=3x4 far=inf note=\"a b\"",
          "expose note=\"a b\" far=inf side=left size=3x4 500 still=no still=yes side=right",
          "expose --side right --still --size=3x4 500 --far inf --note \"a b\""}) {
        const Parsed parsed = parse(line);
        CAPTURE(line);
        CAPTURE(parsed.message);
        REQUIRE(parsed.error == 0);
        CHECK(parsed.values[0].integer == 500);
        Stored stored;
        command_store(expose_arguments, 6, parsed.values.data(), &stored);
        CHECK(stored.side == 1);
        CHECK(stored.still);
        CHECK(stored.size[0] == 3);
        CHECK(stored.size[1] == 4);
        CHECK(std::isinf(stored.far));
        CHECK(std::string(stored.note) == "a b");
    }
    const Parsed none = parse("expose");
    REQUIRE(none.error == 0);
    Stored stored;
    command_store(expose_arguments, 6, none.values.data(), &stored);
    CHECK(stored.side == -1);
    CHECK(stored.note == nullptr);
}

TEST_CASE("a number with another unit, with or without a blank, and words in place of a number") {
    const struct {
        const char *line;
        int unit;
        double number;
    } cases[] = {
        {"focus 540", 0, 540},
        {"focus 540 counts", 0, 540},
        {"focus 540counts", 0, 540},
        {"focus 0x10", 0, 16},
        {"focus 5x", 1, 5},
        {"focus 2.5 x", 1, 2.5},
        {"focus 40.5mm", 2, 40.5},
        {"focus 1800 mm", 2, 1800},
        {"focus f/5.6", 3, 5.6},
        {"focus 40 mm note", 2, 40},
        {"focus 1.8m", 2, 1800},
        {"focus 1.8 m", 2, 1800},
        {"focus 4 cm", 2, 40},
        {"focus 37 steps", 0, 37},
        // As replies print a mean of readings.
        {"focus 540.25 counts", 0, 540},
        {"focus 540.75", 0, 541},
        {"focus -4.75", 0, -5},
    };
    for (const auto &row : cases) {
        const Parsed parsed = parse(row.line);
        CAPTURE(row.line);
        CAPTURE(parsed.message);
        REQUIRE(parsed.error == 0);
        CHECK(parsed.values[0].unit == row.unit);
        CHECK(parsed.values[0].number == row.number);
        CHECK(parsed.values[0].choice == -1);
        CHECK((row.unit != 0 || parsed.values[0].integer == int64_t(row.number)));
        CHECK(parsed.values[1].given == (std::strstr(row.line, "note") != nullptr));
    }
    CHECK(parse("focus infinity").values[0].choice == 0);
    for (const char *word :
         {"5y", "x5", "1/2", "5s", "f/", "mm", "40mmm", "--1", "5xx", "f/x", "5f/", "f/8x"}) {
        refused(std::string("focus ") + word, ERROR_SYNTAX,
                {"POSITION", word, "from -5 to 900 counts, or N x, or N mm, or f/N, or infinity"});
    }
    refused("focus 901", ERROR_RANGE, {"too large"});
    refused("focus 901 counts", ERROR_RANGE, {"too large"});
    refused("focus -1mm", ERROR_RANGE, {"\"-1mm\" is too small"});
    refused("focus 0 x", ERROR_RANGE, {"too small"});
    refused("focus a mm", ERROR_SYNTAX, {"\"a\" is not an integer"});
    refused("focus 5 mm x y", ERROR_ARGUMENT, {"unexpected \"y\""});
}

TEST_CASE("times, lengths and ranges in any unit of their kind") {
    const struct {
        const char *line;
        double time, far, low, high;
    } cases[] = {
        {"expose 1/2000", 500, 0, 0, 0},
        {"expose 1/2000 s far=1.5m", 500, 1500, 0, 0},
        {"expose 0.5ms far=1.5 m", 500, 1500, 0, 0},
        {"expose 0.001 s --far 150 cm", 1000, 1500, 0, 0},
        {"expose 1/3 ms far=infinity", 333, INFINITY, 0, 0},
        {"expose far=0.5km 500 us", 500, 5e5, 0, 0},
        {"expose 500 us range=1750:1850", 500, 0, 1750, 1850},
        {"expose 500 range=1.75:1.85m", 500, 0, 1750, 1850},
        {"expose 500 range=1.75:1.85 m", 500, 0, 1750, 1850},
        {"expose 500 range=175cm:1.85m", 500, 0, 1750, 1850},
        {"expose 500 range=1.75m:inf", 500, 0, 1750, INFINITY},
    };
    for (const auto &row : cases) {
        const Parsed parsed = parse(row.line);
        CAPTURE(row.line);
        CAPTURE(parsed.message);
        REQUIRE(parsed.error == 0);
        CHECK(parsed.values[0].integer == row.time);
        CHECK(parsed.values[0].number == row.time);
        CHECK((!parsed.values[4].given || is_close(parsed.values[4].number, row.far)));
        if (parsed.values[6].given) {
            CHECK(is_close(parsed.values[6].numbers[0], row.low));
            CHECK(is_close(parsed.values[6].numbers[1], row.high));
        }
    }
    refused("expose 1/100", ERROR_RANGE, {"\"1/100\" is too large", "to 1000 us"});
    refused("expose 2 ms", ERROR_RANGE, {"too large"});
    refused("expose 1/0", ERROR_SYNTAX, {"not an integer"});
    refused("expose 1//2", ERROR_SYNTAX, {"not an integer"});
    refused("expose 5mm", ERROR_SYNTAX, {"\"5mm\" has an unknown unit", "us"});
    refused("expose 0.5", ERROR_SYNTAX, {"not an integer"});
    refused("expose 500 size=1/2x3", ERROR_SYNTAX, {"size"});
    refused("expose far=5s", ERROR_SYNTAX, {"unknown unit", "mm"});
    refused("expose range=1m:2s", ERROR_SYNTAX, {"unknown unit"});
    refused("expose range=1:2:3m", ERROR_SYNTAX, {"is invalid"});
}

TEST_CASE("what a reply prints can be typed") {
    std::mt19937 random(synthetic::test_seed());
    for (const char *unit :
         {"um",  "mm",  "cm",  "m",   "km",   "us",     "ms",    "s", "min", "Hz",
          "kHz", "MHz", "deg", "rad", "mrad", "counts", "steps", "x", "%",   "px"}) {
        for (int i = 0; i < 200; i++) {
            const double value = double(random() % 2000000) / 1000 - 1000;
            char printed[64];
            command_text text = command_text_begin(printed, sizeof printed);
            command_text_add_number(&text, value, 3);
            command_text_add_unit(&text, unit);
            command_number number;
            CAPTURE(printed);
            REQUIRE(command_words_quantity(printed, unit, &number) == COMMAND_QUANTITY_READ);
            CHECK(number.value == doctest::Approx(value));
            CHECK(number.stated);
        }
    }
}

TEST_CASE("wrong options") {
    refused("expose sied=left", ERROR_ARGUMENT,
            {"unknown option \"sied=left\"", "(did you mean \"side\"?)"});
    refused("expose --shutter 5", ERROR_ARGUMENT, {"unknown option \"--shutter\""});
    refused("status a=b", ERROR_ARGUMENT, {"unknown option"});
    refused("expose side=lift", ERROR_ARGUMENT,
            {"unknown side \"lift\"", "(did you mean \"left\"?)", "left, right or both"});
    refused("expose still=maybe", ERROR_ARGUMENT, {"unknown still", "no or yes"});
    refused("expose --side", ERROR_MISSING, {"side requires a value", "left, right or both"});
    for (const char *size : {"3", "3x", "3x4x5", "x4", "3,4", "3x4x", "1.5x4"}) {
        refused(std::string("expose size=") + size, ERROR_SYNTAX, {"size", "WxH"});
    }
    refused("expose size=3x101", ERROR_RANGE, {"too large", "from 1 to 100"});
    refused("expose far=0.1", ERROR_RANGE, {"too small", "at least 0.5 mm", "or inf"});
    refused("expose note=", ERROR_RANGE, {"too short"});
    refused("expose note=\"a", ERROR_SYNTAX, {"quote"});
    // Quoted, it is not an option.
    refused("expose \"side=left\"", ERROR_SYNTAX, {"TIME \"side=left\"", "not an integer"});
}

TEST_CASE("a line in the old positional form says what to write") {
    refused("expose left 500", ERROR_ARGUMENT, {"unexpected \"left\"", "write side=left"});
    refused("expose 500 still", ERROR_ARGUMENT, {"unexpected \"still\"", "write still=yes"});
    refused(
        "expose - left", ERROR_ARGUMENT,
        {"unexpected \"-\"", "usage: expose [TIME] [side=left|right|both] [still=yes] [size=WxH]"});
    refused("expose 500 3", ERROR_ARGUMENT, {"unexpected \"3\"", "[far=MM]"});
}

TEST_CASE("an empty line is not a command") {
    for (const char *line : {"", "   ", "\t", "# a comment", "  #x"}) {
        const Parsed parsed = parse(line);
        CHECK(parsed.error == 0);
        CHECK(parsed.found == nullptr);
        CHECK(parsed.message.empty());
    }
}

TEST_CASE("similar words are suggested, distant ones are not") {
    const auto suggested = [](const char *typed) {
        suggest suggest;
        suggest_begin(&suggest, typed, "");
        suggest_consider_all(&suggest, "reconstruct evaluate info calibration cabin");
        return std::string(suggest.text);
    };
    CHECK(suggested("recnstruct") == " (did you mean \"reconstruct\"?)");
    CHECK(suggested("inof") == " (did you mean \"info\"?)");
    CHECK(suggested("cal") == " (did you mean \"calibration\"?)");  // begins it
    for (const char *typed : {"ca", "banana", "x", "", "infinite"}) {
        CAPTURE(typed);
        CHECK(suggested(typed).empty());
    }
    CHECK(suggested(std::string(1000, 'r').c_str()).empty());
}

TEST_CASE("rejections name argument, range and unit") {
    refused("stats", ERROR_ARGUMENT, {"unknown command \"stats\"", "(did you mean \"status\"?)"});
    refused("fly", ERROR_ARGUMENT, {"unknown command \"fly\"", "help"});
    refused("status now", ERROR_ARGUMENT, {"status:", "\"now\"", "usage: status"});
    refused("move left 1 1 a b c d e f g", ERROR_ARGUMENT,
            {"\"b\"", "usage: move SIDE ANGLE [COUNT] [NOTE]"});
    refused("move", ERROR_MISSING, {"move: SIDE", "missing", "left, right or both"});
    refused("move lift 1", ERROR_ARGUMENT,
            {"unknown SIDE \"lift\"", "left, right or both", "(did you mean \"left\"?)"});
    const char *range = "from -30.5 to 30 deg";
    refused("move left", ERROR_MISSING, {"move: ANGLE", "missing", range});
    refused("move left 30.01", ERROR_RANGE, {"ANGLE \"30.01\"", "too large", range});
    refused("move left -31", ERROR_RANGE, {"ANGLE \"-31\"", "too small", range});
    for (const char *word : {"x", "1e3", "0x10", "1.", ".", "--1", "nan", "inf", "1,5"}) {
        refused(std::string("move left ") + word, ERROR_SYNTAX,
                {"move: ANGLE", word, "not a number", range});
    }
    refused("move left 1 2.5", ERROR_SYNTAX, {"COUNT \"2.5\"", "not an integer", "0 to 255"});
    refused("move left 1 0xFFFFFFFFFFFFFFFFFFFFFFFF", ERROR_RANGE, {"too large", "0 to 255"});
    refused("move left 1 2 ninechars", ERROR_RANGE, {"too long", "1 to 8 characters"});
    refused("move left 1 2 \"\"", ERROR_RANGE, {"too short", "1 to 8 characters"});
    command_argument exact = move_arguments[3];
    exact.min = exact.max;
    char bytes[40];
    command_text text = command_text_begin(bytes, sizeof bytes);
    command_expected(&exact, &text);
    CHECK(std::string(bytes) == "text of 8 characters");
}

TEST_CASE("malformed lines") {
    refused("move \"left", ERROR_SYNTAX, {"quote"});
    refused("move \"left\"1", ERROR_SYNTAX, {"quote"});
    refused("status\x1b", ERROR_SYNTAX, {"control character"});
    refused(std::string(COMMAND_LINE_MAX + 1, 'x'), ERROR_SYNTAX, {"512 characters"});
    CHECK(parse(std::string(COMMAND_LINE_MAX, 'x')).error == ERROR_ARGUMENT);
    CHECK(parse("status" + std::string(COMMAND_LINE_MAX - 6, ' ')).error == 0);
}

TEST_CASE("a message is one line and fits, whatever was typed") {
    char message[32];
    std::vector<char> storage(COMMAND_LINE_MAX + 1);
    command_value values[COMMAND_ARGUMENTS_MAX];
    const command *found = nullptr;
    const std::string line = "\xc3\xa4" + std::string(300, 'y');
    CHECK(command_parse(line.c_str(), table, std::size(table), storage.data(), values, &found,
                        message, sizeof message) == ERROR_ARGUMENT);
    CHECK(std::strlen(message) == sizeof message - 1);
}

TEST_CASE("a text is printed as printf does") {
    char data[200];
    command_text text = command_text_begin(data, sizeof data);
    command_text_print(&text, "%s is at %.*f %s, %.3f%% of %d, %u and %08x", "left pan", 3, -1.0629,
                       "deg", 0.0626, -7, 7U, 0xBEEFU);
    command_text_print(&text, "; %.0f to %.1f", 17.75, 99.97);
    CHECK(std::string(data) ==
          "left pan is at -1.063 deg, 0.063% of -7, 7 and 0000beef; 18 to 100.0");
    message message;
    CHECK(command_text_message(&message, ERROR_RANGE, "%s", "a\nb") == ERROR_RANGE);
    CHECK(std::string(message.text) == "a?b");
}

TEST_CASE("numbers are those that were typed") {
    std::mt19937 random(synthetic::test_seed());
    for (int i = 0; i < 20000; i++) {
        const int decimals = static_cast<int>(random() % 7);
        const long whole = static_cast<long>(random() % 100000);
        std::string text = (random() % 2 ? "-" : "") + std::to_string(whole);
        if (decimals > 0) {
            text += ".";
            for (int d = 0; d < decimals; d++) {
                text += static_cast<char>('0' + random() % 10);
            }
        }
        double value = 0;
        REQUIRE(command_words_number(text.c_str(), &value));
        CHECK(value == std::stod(text));
        const long long integer =
            static_cast<long long>((uint64_t(random()) << 32 | random()) >> 1);
        int64_t read = 0;
        REQUIRE(command_words_integer(std::to_string(-integer).c_str(), &read));
        CHECK(read == -integer);
        char printed[64];
        command_text added = command_text_begin(printed, sizeof printed);
        command_text_add_integer(&added, -integer);
        CHECK(std::string(printed) == std::to_string(-integer));
    }
    int64_t nearest = 0;
    CHECK(command_words_integer("-99999999999999999999", &nearest));
    CHECK(nearest == -INT64_MAX);
    char printed[64];
    command_text added = command_text_begin(printed, sizeof printed);
    command_text_add_integer(&added, INT64_MIN);
    command_text_add(&added, " ");
    command_text_add_number(&added, -0.25, 6);
    command_text_add(&added, " ");
    command_text_add_number(&added, 1e300, 6);
    CHECK(std::string(printed) == "-9223372036854775808 -0.25 ?");
}

TEST_CASE("the instrument's table is whole") {
    size_t count = 0;
    const command *rig = command_rig_table(&count);
    REQUIRE(count > 10);
    for (size_t i = 0; i < count; i++) {
        CAPTURE(rig[i].name);
        CHECK(command_find(rig, count, rig[i].name) == &rig[i]);
        CHECK(std::strlen(rig[i].name) <= COMMAND_CHOICE_MAX);
        CHECK((rig[i].run != nullptr));
        CHECK(std::strlen(rig[i].summary) < 70);
        CHECK(rig[i].summary[std::strlen(rig[i].summary) - 1] != '.');
        CHECK(std::strlen(rig[i].help) > 0);
        bool optional = false;
        char usage[COMMAND_USAGE_BYTES];
        command_usage(&rig[i], usage, sizeof usage);
        CHECK(std::strlen(usage) + 1 < sizeof usage);
        for (unsigned a = 0; a < rig[i].argument_count; a++) {
            const command_argument &argument = rig[i].arguments[a];
            if (!command_argument_is_option(&argument)) {
                CHECK((argument.optional || !optional));
                optional = argument.optional;
            }
            CHECK(std::strlen(argument.help) > 0);
            CHECK(((argument.kind == COMMAND_CHOICE) == (argument.choices != nullptr) ||
                   argument.units != nullptr));
            CHECK((argument.kind == COMMAND_CHOICE || argument.kind == COMMAND_FLAG ||
                   argument.min < argument.max));
        }
    }
}
