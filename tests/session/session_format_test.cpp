// SPDX-License-Identifier: Apache-2.0
// The session's directory: events are read back as written, and nothing else is accepted.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "daemon/session/session_pairs.h"
#include "scratch.hpp"
#include "session_harness.hpp"
#include "synthetic/seed.hpp"

using namespace session_harness;

namespace {

std::string read_text(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void begin(session_writer &writer, const std::string &path) {
    message last_error{};
    REQUIRE(session_writer_begin(&writer, AT_FDCWD, path.c_str(), "v1-dirty", "two-cameras",
                                 "2026-11-22T03:00:00Z", &last_error) == 0);
}

/// Reads all events; returns the result of the last call.
int read_all(const std::string &path, int *count, message *last_error) {
    session_reader reader;
    auto event = std::make_unique<session_event>();
    int code = session_reader_open(&reader, AT_FDCWD, path.c_str(), event.get(), last_error);
    *count = 0;
    if (code != 0) {
        return code;
    }
    while ((code = session_reader_next(&reader, event.get(), last_error)) == 1) {
        ++*count;
    }
    session_reader_close(&reader);
    return code;
}

}  // namespace

TEST_CASE("all kinds of events are read back as written") {
    const scratch folder;
    const std::string path = folder / "session";
    Random random(synthetic::test_seed());
    auto writer = new_writer();
    begin(*writer, path);
    message last_error{};
    const std::string calibration = "vergence-calibration 1\nnothing more is looked at here\n";
    const std::string command = "pan 2.5 side=left % \"two  words\" \x01\xff=";
    const std::uint16_t values[] = {0x5b1d, 0, 0xffff};
    const pair_instrument instrument = {
        {"Webcam C at usb-0000:00:14.0-1", ""}, {24000, 0}, {9442, 0}, 5236, 4, 4187};
    CHECK(session_writer_instrument(writer.get(), &instrument, &last_error) == 0);
    CHECK(session_writer_calibration(writer.get(), calibration.data(), calibration.size(),
                                     &last_error) == 0);
    CHECK(session_writer_zoom_calibration(writer.get(), calibration.data(), calibration.size(),
                                          &last_error) == 0);
    CHECK(session_writer_command(writer.get(), command.c_str(), &last_error) == 0);
    CHECK(session_writer_setting(writer.get(), "rig.key", "7", &last_error) == 0);
    CHECK(session_writer_registers(writer.get(), "FPGA bridge", 17, 0x20, values, 3, &last_error) ==
          0);
    std::vector<owned_pair> pairs(20);
    for (auto &made : pairs) {
        random_pair(random, made);
        REQUIRE(session_writer_pair(writer.get(), &made.value, &last_error) == 0);
    }
    CHECK(session_writer_end(writer.get(), &last_error) == 0);

    session_reader reader;
    auto event = std::make_unique<session_event>();
    REQUIRE(session_reader_open(&reader, AT_FDCWD, path.c_str(), event.get(), &last_error) == 0);
    CHECK(std::string(event->build) == "v1-dirty");
    CHECK(std::string(event->profile) == "two-cameras");
    CHECK(std::string(event->date) == "2026-11-22T03:00:00Z");
    REQUIRE(session_reader_next(&reader, event.get(), &last_error) == 1);
    CHECK(event->kind == SESSION_INSTRUMENT);
    CHECK(std::string(event->instrument.camera[RIG_LEFT]) == instrument.camera[RIG_LEFT]);
    CHECK(std::string(event->instrument.camera[RIG_RIGHT]).empty());
    CHECK(event->instrument.servo_q4_per_rad[RIG_LEFT] == 9442);
    CHECK(event->instrument.lens_zoom_ppm == 4187);
    REQUIRE(session_reader_next(&reader, event.get(), &last_error) == 1);
    CHECK(event->kind == SESSION_CALIBRATION);
    char text[200];
    REQUIRE(session_reader_calibration(&reader, event->crc32, text, sizeof text, &last_error) ==
            static_cast<int>(calibration.size()));
    CHECK(std::string(text, calibration.size()) == calibration);
    CHECK(session_reader_calibration(&reader, event->crc32, text, 5, &last_error) == ERROR_CRC);
    REQUIRE(session_reader_next(&reader, event.get(), &last_error) == 1);
    CHECK(event->kind == SESSION_ZOOM_CALIBRATION);
    CHECK(session_reader_zoom_calibration(&reader, event->crc32, text, sizeof text, &last_error) ==
          static_cast<int>(calibration.size()));
    CHECK(session_reader_zoom_calibration(&reader, event->crc32 + 1, text, sizeof text,
                                          &last_error) == ERROR_MISSING);
    REQUIRE(session_reader_next(&reader, event.get(), &last_error) == 1);
    CHECK(event->kind == SESSION_COMMAND);
    CHECK(event->text == command);
    REQUIRE(session_reader_next(&reader, event.get(), &last_error) == 1);
    CHECK(event->kind == SESSION_SETTING);
    CHECK(std::string(event->text) == "rig.key = 7");
    REQUIRE(session_reader_next(&reader, event.get(), &last_error) == 1);
    CHECK(event->kind == SESSION_REGISTERS);
    CHECK(std::string(event->part) == "FPGA bridge");
    CHECK(event->at_us == 17);
    CHECK(event->first == 0x20);
    REQUIRE(event->count == 3);
    CHECK(std::memcmp(event->values, values, sizeof values) == 0);
    std::uint32_t number = 0;
    for (const auto &made : pairs) {
        REQUIRE(session_reader_next(&reader, event.get(), &last_error) == 1);
        CHECK(event->kind == SESSION_PAIR);
        CHECK(event->pair.number == ++number);
        CHECK(same_pair(reader, *event, made.value));
    }
    REQUIRE(session_reader_next(&reader, event.get(), &last_error) == 1);
    CHECK(event->kind == SESSION_END);
    CHECK(session_reader_next(&reader, event.get(), &last_error) == 0);
    CHECK(!reader.cut);
    session_reader_close(&reader);
}

TEST_CASE("a session that ended, or was cut off, goes on where it was") {
    const scratch folder;
    const std::string path = folder / "session";
    Random random(synthetic::test_seed());
    auto writer = new_writer();
    begin(*writer, path);
    message last_error{};
    const char *const ends[] = {"proper", "cut", "incomplete line"};
    std::uint32_t position = 0;
    for (const char *const end : ends) {
        INFO(end);
        const std::string text = SESSION_BOARD_POSITION + std::to_string(++position);
        CHECK(session_writer_command(writer.get(), text.c_str(), &last_error) == 0);
        const char *const focused = position == 2 ? SESSION_FOCUSED_ON_BOARD : "# another";
        CHECK(session_writer_command(writer.get(), focused, &last_error) == 0);
        owned_pair made;
        random_pair(random, made);
        for (auto &frame : made.value.frame) {
            frame.before.pan_q4 = static_cast<std::uint16_t>(24000 + position / 3);
        }
        REQUIRE(session_writer_pair(writer.get(), &made.value, &last_error) == 0);
        CHECK(writer->pairs == position);
        if (end == ends[0]) {
            CHECK(session_writer_end(writer.get(), &last_error) == 0);
        } else {
            session_writer_leave(writer.get());
        }
        if (end == ends[2]) {
            std::ofstream(path + "/session.index", std::ios::app) << "pair number=7 skew";
        }
        REQUIRE(session_writer_resume(writer.get(), AT_FDCWD, path.c_str(), &last_error) == 0);
    }
    CHECK(session_writer_end(writer.get(), &last_error) == 0);

    std::vector<std::vector<std::uint32_t>> seen;
    const auto each = [](void *list, const session_pair_files *files) {
        static_cast<decltype(seen) *>(list)->push_back({files->pair->number, files->board_position,
                                                        files->pan_visit, files->focused_on_board,
                                                        files->missing[0] || files->missing[1]});
    };
    CHECK(session_pairs_read(path.c_str(), false, each, &seen, &last_error) == 3);
    CHECK(seen == decltype(seen){{1, 1, 1, 0, 0}, {2, 2, 1, 1, 0}, {3, 3, 2, 0, 0}});
    for (const auto &entry : std::filesystem::directory_iterator(path)) {
        if (entry.path().extension() == ".pnm") {
            std::filesystem::remove(entry);
        }
    }
    seen.clear();
    CHECK(session_pairs_read(path.c_str(), false, each, &seen, &last_error) == ERROR_MISSING);
    CHECK(session_pairs_read(path.c_str(), true, each, &seen, &last_error) == 3);
    CHECK(seen == decltype(seen){{1, 1, 1, 0, 1}, {2, 2, 1, 1, 1}, {3, 3, 2, 0, 1}});

    // A note is an event of its own behind the pairs; the session is closed again.
    CHECK(session_add_note(AT_FDCWD, path.c_str(), "# measure fit=360", &last_error) == 0);
    CHECK(session_add_note(AT_FDCWD, path.c_str(), "# measure step aim: 2 deg", &last_error) == 0);
    const std::string noted = read_text(path + "/session.index");
    CHECK(noted.find("command text=#%20measure%20step%20aim:%202%20deg ") != std::string::npos);
    CHECK(session_pairs_read(path.c_str(), true, each, &seen, &last_error) == 3);
    int events = 0;
    CHECK(read_all(path, &events, &last_error) == 0);
    CHECK(events == 3 + 3 + 3 + 2 + 1);  // positions, pairs, notes, end
    const std::string long_note = "#" + std::string(SESSION_TEXT_MAX, 'x');
    CHECK(session_add_note(AT_FDCWD, path.c_str(), long_note.c_str(), &last_error) == ERROR_RANGE);
    CHECK(read_text(path + "/session.index") == noted);
    folder.write("session/calls.log", "");
    CHECK(session_add_note(AT_FDCWD, path.c_str(), "# no", &last_error) == ERROR_ARGUMENT);
    CHECK(session_add_note(AT_FDCWD, (folder / "none").c_str(), "# no", &last_error) ==
          ERROR_MISSING);
    std::filesystem::remove(path + "/calls.log");

    // A damaged session is left alone.
    std::string index = read_text(path + "/session.index");
    index[index.size() / 2] ^= 1;
    std::ofstream(path + "/session.index", std::ios::binary) << index;
    CHECK(session_writer_resume(writer.get(), AT_FDCWD, path.c_str(), &last_error) == ERROR_CRC);
    CHECK(read_text(path + "/session.index") == index);
    CHECK(session_writer_resume(writer.get(), AT_FDCWD, (folder / "none").c_str(), &last_error) ==
          ERROR_MISSING);
}

TEST_CASE("equal frames are one file, and a session is never begun twice") {
    const scratch folder;
    const std::string path = folder / "session";
    Random random(synthetic::test_seed());
    auto writer = new_writer();
    begin(*writer, path);
    message last_error{};
    owned_pair made;
    random_pair(random, made);
    REQUIRE(session_writer_pair(writer.get(), &made.value, &last_error) == 0);
    REQUIRE(session_writer_pair(writer.get(), &made.value, &last_error) == 0);
    std::size_t files = 0;
    for (const auto &entry : std::filesystem::directory_iterator(path)) {
        files += entry.path().filename().string().rfind("frame-", 0) == 0;
    }
    CHECK(files == 2);
    CHECK(session_writer_end(writer.get(), &last_error) == 0);
    const std::string before = read_text(path + "/session.index");
    auto again = new_writer();
    CHECK(session_writer_begin(again.get(), AT_FDCWD, path.c_str(), "", "", "", &last_error) ==
          ERROR_ARGUMENT);
    CHECK(std::string(last_error.text).find("already contains") != std::string::npos);
    CHECK(read_text(path + "/session.index") == before);
    CHECK(session_writer_begin(again.get(), AT_FDCWD, (folder / "none/there").c_str(), "", "", "",
                               &last_error) == ERROR_MISSING);
}

TEST_CASE("a truncated index gives the events before the cut; a modified one is rejected") {
    const scratch folder;
    const std::string path = folder / "session";
    Random random(synthetic::test_seed());
    auto writer = new_writer();
    begin(*writer, path);
    message last_error{};
    for (int i = 0; i < 3; i++) {
        owned_pair made;
        random_pair(random, made);
        REQUIRE(session_writer_pair(writer.get(), &made.value, &last_error) == 0);
    }
    CHECK(session_writer_end(writer.get(), &last_error) == 0);
    const std::string whole = read_text(path + "/session.index");
    for (std::size_t length = 0; length <= whole.size(); length++) {
        folder.write("session/session.index", whole.substr(0, length));
        const auto lines = std::count(whole.begin(), whole.begin() + long(length), '\n');
        int count;
        const int code = read_all(path, &count, &last_error);
        CHECK(code == (lines == 0 ? ERROR_ARGUMENT : 0));
        CHECK(count == std::max(0L, lines - 1));
    }
    // One changed byte is detected, or, in the last line (and the line end before it, which joins
    // two lines), taken for an incomplete line.
    const std::size_t last = whole.rfind('\n', whole.size() - 2) + 1;
    for (std::size_t at = 0; at < whole.size(); at++) {
        std::string changed = whole;
        changed[at] = static_cast<char>(changed[at] ^ (1 << upto(random, 6)));
        folder.write("session/session.index", changed);
        int count;
        const int code = read_all(path, &count, &last_error);
        INFO("byte ", at, ", ", std::string(last_error.text));
        CHECK((at + 1 < last ? code == ERROR_CRC || code == ERROR_SYNTAX : code == 0));
        CHECK(count <= 3);
    }
}

TEST_CASE("a damaged or missing frame is reported by name") {
    const scratch folder;
    const std::string path = folder / "session";
    Random random(synthetic::test_seed());
    auto writer = new_writer();
    begin(*writer, path);
    message last_error{};
    owned_pair made;
    random_pair(random, made);
    REQUIRE(session_writer_pair(writer.get(), &made.value, &last_error) == 0);
    CHECK(session_writer_end(writer.get(), &last_error) == 0);
    session_reader reader;
    auto event = std::make_unique<session_event>();
    REQUIRE(session_reader_open(&reader, AT_FDCWD, path.c_str(), nullptr, &last_error) == 0);
    REQUIRE(session_reader_next(&reader, event.get(), &last_error) == 1);
    char name[SESSION_NAME_MAX + 1];
    session_frame_name(event->frame_crc[0], name);
    const std::string whole = read_text(path + "/" + name);
    const pair_frame &frame = event->pair.frame[0];
    const auto load = [&] {
        raw_image image = frame.image;
        const int code = session_reader_load(&reader, &image, event->frame_crc[0], &last_error);
        CHECK((image.data != nullptr) == (code == 0));
        raw_image_release(&image);
        CHECK(session_reader_check(&reader, &frame.image, event->frame_crc[0], &last_error) ==
              code);
        return code;
    };
    CHECK(load() == 0);
    std::string changed = whole;
    changed[whole.size() / 2] = static_cast<char>(changed[whole.size() / 2] ^ 1);
    for (const std::string &text :
         {changed, whole + "x", whole.substr(0, whole.size() - 1), std::string()}) {
        folder.write(std::string("session/") + name, text);
        CHECK(load() == ERROR_CRC);
        CHECK(std::string(last_error.text).find(name) != std::string::npos);
    }
    std::filesystem::remove(path + "/" + name);
    CHECK(load() == ERROR_MISSING);
    session_reader_close(&reader);
}

TEST_CASE("lines are canonical: a line that would be printed differently is rejected") {
    auto event = std::make_unique<session_event>();
    const auto parses = [&](const std::string &line) {
        return session_event_parse(line.data(), line.size(), event.get()) == 0;
    };
    CHECK(parses("begin version=1 build=a profile= date=b"));
    CHECK(parses("begin version=2 build=a profile= date=b"));
    CHECK(parses("begin version=3 build=a profile= date=b"));
    CHECK(parses("command text=a%20b%25"));
    CHECK(parses("calibration file=0000abcd"));
    CHECK(parses("zoom_calibration file=0000abcd"));
    CHECK(parses("registers at_us=0 part=a first=05 values=0000,ffff"));
    CHECK(parses("end"));
    for (const char *line :
         {"", "en", "end ", "command text=a b", "command text=%41", "command text=%2",
          "command text", "command text=%00", "calibration file=abcd", "calibration file=0000ABCD",
          "calibration file=100000000", "begin version=0 build=a profile= date=b",
          "begin version=7 build=a profile= date=b",
          "registers at_us=00 part=a first=05 values=0000",
          "registers at_us=0 part=a first=05 values=0000,",
          "registers at_us=18446744073709551616 part=a first=05 values=0000", "pair number=1"}) {
        INFO(std::string(line));
        CHECK(!parses(line));
    }
}

TEST_CASE("positions are means with their errors, and were integers up to version 4") {
    auto event = std::make_unique<session_event>();
    const auto parses = [&](const std::string &axes) {
        std::string line = "pair number=1 skew_us=0 checked=no change_permille=0";
        for (const std::string at : {" left_", " right_"}) {
            line += at + "frame=00000001" + at + "size=2x1" + at + "bits=8" + at + "layout=grey" +
                    at + "sequence=1" + at + "begin_us=1" + at + "end_us=2" + at + "exposure_us=0" +
                    at + "gain_q3=0" + at + "before=" + axes + at + "after=0,none,none,none";
        }
        return session_event_parse(line.data(), line.size(), event.get()) == 0;
    };
    const lens_mean *lens = event->pair.frame[RIG_RIGHT].before.lens;
    CHECK(parses("24000,300,none,850"));
    CHECK(lens[LENS_ZOOM].position_q4 == 4800);
    CHECK(lens[LENS_ZOOM].sigma_q4 == 0);
    CHECK(lens[LENS_FOCUS].position_q4 == INT32_MIN);
    CHECK(parses("24000,4805:8,-3:65535,320000:1"));
    CHECK(lens[LENS_ZOOM].position_q4 == 4805);
    CHECK(lens[LENS_ZOOM].sigma_q4 == 8);
    CHECK(lens[LENS_FOCUS].position_q4 == -3);
    CHECK(lens[LENS_IRIS].position_q4 == 320000);
    for (const std::string wrong :
         {"0,1:0,1:1,1:1", "0,1:65536,1:1,1:1", "0,1:,1:1,1:1", "0,1:-1,1:1,1:1", "0,01:1,1:1,1:1",
          "0,none:1,1:1,1:1", "0,1.5,1:1,1:1", "0,134217728,1,1", "0,1:1:1,1,1"}) {
        CAPTURE(wrong);
        CHECK(!parses(wrong));
    }
}

TEST_CASE("a pair of version 1 has no image statistics, one of version 2 may have them") {
    auto event = std::make_unique<session_event>();
    const auto frame = [](const std::string &side, const std::string &more) {
        const std::string at = " " + side + "_";
        return at + "frame=00000001" + at + "size=2x1" + at + "bits=8" + at + "layout=grey" + at +
               "sequence=1" + at + "begin_us=1" + at + "end_us=2" + at + "exposure_us=0" + at +
               "gain_q3=0" + at + "before=0,none,none,none" + at + "after=0,none,none,none" +
               (more.empty() ? "" : at + more);
    };
    const auto parses = [&](const std::string &left, const std::string &right) {
        const std::string line = "pair number=1 skew_us=0 checked=no change_permille=0" +
                                 frame("left", left) + frame("right", right);
        return session_event_parse(line.data(), line.size(), event.get()) == 0;
    };
    CHECK(parses("", ""));
    CHECK(!event->pair.frame[RIG_LEFT].has_picture);
    CHECK(parses("picture=412,3,0,1000", ""));
    CHECK(event->pair.frame[RIG_LEFT].picture.brightness_permille == 412);
    CHECK(event->pair.frame[RIG_LEFT].picture.sharpness_permille == 1000);
    CHECK(!event->pair.frame[RIG_RIGHT].has_picture);
    CHECK(parses("window=0,0,1 left_picture=1,2,3,4", "picture=1,2,3,4"));
    CHECK(event->pair.frame[RIG_LEFT].parts == 0);
    CHECK(parses("picture=1,2,3,4 left_merged=5000:8:1,20000:8:1", "merged=0:0:64"));
    CHECK(event->pair.frame[RIG_LEFT].parts == 2);
    CHECK(event->pair.frame[RIG_LEFT].part[1].exposure_us == 20000);
    CHECK(event->pair.frame[RIG_RIGHT].part[0].frames == 64);
    for (const std::string wrong :
         {"picture=1,2,3", "picture=1,2,3,4,5", "picture=1,2,3,1001", "picture=1,2,3,04",
          "picture=1,2,3,4 left_window=0,0,1", "merged=", "merged=1:8", "merged=1:8:0",
          "merged=1:8:1,", "merged=1:8:01", "merged=1:1:1,2:1:1,3:1:1,4:1:1,5:1:1,6:1:1,7:1:1"}) {
        CAPTURE(wrong);
        CHECK(!parses(wrong, ""));
    }
}
