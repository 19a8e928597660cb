// SPDX-License-Identifier: Apache-2.0
// The lens controller's driver on a scripted line: silence, invalid data, fragments, lost bytes,
// late answers. The line is a small state machine with a clock, and expects no particular calls.
#include "device/lens_v3lc.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "core/error.h"

namespace {

constexpr uint64_t kMs = 1000;

// The reply to a question, and its delay.
struct Piece {
    uint64_t after_us;
    std::string bytes;
};
using Script = std::function<std::vector<Piece>(const std::string &line, int question)>;

std::string status(int lens, int zoom, int focus = 500, int iris = 600) {
    char text[80];
    std::snprintf(text, sizeof text, "V3LC %d\rZoom:%04d\rFocus:%04d\rIris:%04d\r\n", lens, zoom,
                  focus, iris);
    return text;
}

class Line {
  public:
    explicit Line(Script script) : script_(std::move(script)) {}

    const hal_uart *uart() const { return &uart_; }
    const hal_clock *clock() const { return &clock_; }
    /// Sent without a question.
    void comes(uint64_t at_us, const std::string &bytes) {
        for (const char byte : bytes) {
            const auto later = [&](const std::pair<uint64_t, char> &other) {
                return other.first > at_us;
            };
            coming_.insert(std::find_if(coming_.begin(), coming_.end(), later), {at_us, byte});
        }
    }

    uint64_t now_us = 0;
    std::vector<std::string> lines;  ///< received by the controller
    int fails = ERROR_OK;            ///< result of every system call
    uint64_t noise_until_us = 0;     ///< an endless stream of 'x' until then

  private:
    static Line &of(void *self) { return *static_cast<Line *>(self); }
    static int write(void *self, const void *data, size_t bytes, uint64_t) {
        Line &line = of(self);
        if (line.fails != ERROR_OK) {
            return line.fails;
        }
        for (const char byte : std::string(static_cast<const char *>(data), bytes)) {
            if (byte != '\n') {
                line.half_ += byte;
                continue;
            }
            line.lines.push_back(line.half_);
            const bool question = !line.half_.empty() && line.half_.back() == '?';
            line.questions_ += question ? 1 : 0;
            if (question) {
                for (const Piece &piece : line.script_(line.half_, line.questions_)) {
                    line.comes(line.now_us + piece.after_us, piece.bytes);
                }
            }
            line.half_.clear();
        }
        return ERROR_OK;
    }
    static int read(void *self, void *data, size_t capacity, uint64_t deadline_us, size_t *bytes) {
        Line &line = of(self);
        if (line.fails != ERROR_OK) {
            return line.fails;
        }
        if (line.now_us < line.noise_until_us) {
            line.now_us += kMs;
            *static_cast<char *>(data) = 'x';
            *bytes = 1;
            return ERROR_OK;
        }
        if (line.coming_.empty() || line.coming_.front().first > deadline_us) {
            line.now_us = std::max(line.now_us, deadline_us);
            return ERROR_TIMEOUT;
        }
        line.now_us = std::max(line.now_us, line.coming_.front().first);
        for (*bytes = 0; *bytes < capacity && !line.coming_.empty() &&
                         line.coming_.front().first <= line.now_us;
             ++*bytes) {
            static_cast<char *>(data)[*bytes] = line.coming_.front().second;
            line.coming_.pop_front();
        }
        return ERROR_OK;
    }
    static int discard(void *self) {
        Line &line = of(self);
        while (!line.coming_.empty() && line.coming_.front().first <= line.now_us) {
            line.coming_.pop_front();
        }
        return line.fails;
    }
    static uint64_t clock_now_us(void *self) { return of(self).now_us; }
    static void wait_until_us(void *self, uint64_t time_us) {
        of(self).now_us = std::max(of(self).now_us, time_us);
    }

    Script script_;
    int questions_ = 0;
    std::string half_;
    std::deque<std::pair<uint64_t, char>> coming_;
    hal_uart_operations uart_operations_{write, read, discard};
    hal_clock_operations clock_operations_{clock_now_us, wait_until_us, nullptr};
    hal_uart uart_{&uart_operations_, this};
    hal_clock clock_{&clock_operations_, this};
};

struct Bench {
    explicit Bench(Script script, bool single = false) : line(std::move(script)) {
        const lens_driver *row = lens_driver_named(single ? "v1lc" : "v3lc");
        const lens_ports ports = {line.clock(), line.uart(), nullptr};
        lens_controller_init(&controller, row, &row->settings, &ports);
    }
    lens_drive lens(unsigned number) { return {&controller, number}; }
    const lens_v3lc_counts &counts() { return lens_v3lc_state(&controller)->counts; }
    // Within `timeout_us`.
    int read(unsigned number, uint64_t timeout_us) {
        const lens_drive drive = lens(number);
        return lens_read(&drive, line.now_us + timeout_us, readings);
    }
    int go(unsigned number, lens_axis axis, int32_t position) {
        const lens_drive drive = lens(number);
        return lens_go(&drive, axis, position, line.now_us + 100 * kMs);
    }

    Line line;
    lens_controller controller{};
    lens_reading readings[LENS_AXES]{};
};

// Correct answers, 57 ms after the question.
Script good(int zoom = 400) {
    return [zoom](const std::string &line, int) {
        return std::vector<Piece>{{57 * kMs, status(line[0] - '0', zoom)}};
    };
}

}  // namespace

TEST_CASE("commands are the public code's, with the lens in front") {
    Bench bench(good());
    CHECK(bench.go(0, LENS_ZOOM, 300) == ERROR_OK);
    CHECK(bench.go(1, LENS_FOCUS, 850) == ERROR_OK);
    CHECK(bench.go(1, LENS_IRIS, 512) == ERROR_OK);
    CHECK(bench.go(0, LENS_ZOOM, 299) == ERROR_RANGE);
    CHECK(bench.go(0, LENS_ZOOM, 851) == ERROR_RANGE);
    CHECK(bench.go(0, LENS_AXES, 500) == ERROR_NOT_CONNECTED);
    CHECK(bench.line.lines == std::vector<std::string>{"1Z300", "2F850", "2I512"});
    const lens_drive lens = bench.lens(0);
    CHECK(lens_stop(&lens, 1) == ERROR_UNSUPPORTED);
}

TEST_CASE("it is found") {
    Bench bench(good());
    const lens_drive lens = bench.lens(1);
    CHECK(lens_open(&lens, 500 * kMs) == ERROR_OK);
    CHECK(bench.line.lines == std::vector<std::string>{"", "T255", "2?"});
    CHECK(lens_has_axis(&lens, LENS_IRIS));
    CHECK(!lens_has_axis(&lens, LENS_AXES));
}

TEST_CASE("an answer is read, and its time is that of the question") {
    Bench bench(good(432));
    bench.line.now_us = 5000;
    REQUIRE(bench.read(1, 200 * kMs) == ERROR_OK);
    CHECK(bench.readings[LENS_ZOOM].position == 432);
    CHECK(bench.readings[LENS_FOCUS].position == 500);
    CHECK(bench.readings[LENS_IRIS].position == 600);
    CHECK(bench.readings[LENS_ZOOM].time_us == 5000);
    CHECK(bench.line.now_us == 62 * kMs);
}

TEST_CASE("silence ends at the deadline, and is asked again ever more seldom") {
    Bench bench([](const std::string &, int) { return std::vector<Piece>(); });
    CHECK(bench.read(0, 5000 * kMs) == ERROR_TIMEOUT);
    CHECK(bench.line.now_us == 5000 * kMs);
    CHECK(bench.counts().asked == 6);  // asked at 0, 0.2, 0.6, 1.4, 3.0, 4.6 s
    CHECK(bench.counts().silent == 5);
    CHECK(bench.line.lines[1] == "");  // ends what the controller may have received of the first
}

TEST_CASE("patience is learnt from answers") {
    Bench bench([](const std::string &, int question) {
        return question == 5 ? std::vector<Piece>{{57 * kMs, status(1, 400)}}
                             : std::vector<Piece>();
    });
    REQUIRE(bench.read(0, 5000 * kMs) == ERROR_OK);  // the fifth question, at 3 s
    // The next question waits as long as late answers to the four may take.
    const uint64_t begin_us = bench.line.now_us;
    CHECK(bench.read(0, 1600 * kMs + 700 * kMs) == ERROR_TIMEOUT);
    CHECK(bench.counts().asked == 6);
    bench.line.now_us = begin_us + 60000 * kMs;
    Bench prompt([](const std::string &, int question) {
        return question == 2 ? std::vector<Piece>()
                             : std::vector<Piece>{{400 * kMs, status(1, 400)}};
    });
    REQUIRE(prompt.read(0, 5000 * kMs) == ERROR_OK);  // asked twice, so the timeout does not adapt
    prompt.line.now_us += 5000 * kMs;
    REQUIRE(prompt.read(0, 5000 * kMs) == ERROR_OK);
    CHECK(lens_v3lc_state(&prompt.controller)->timeout_us == 900 * kMs);  // twice 400 ms and 100
}

TEST_CASE("another lens is asked when the first has answered, and both get their answers") {
    Bench bench(good(600));
    CHECK(bench.read(0, 20 * kMs) == ERROR_TIMEOUT);
    REQUIRE(bench.read(1, 100 * kMs) == ERROR_OK);
    CHECK(bench.readings[LENS_ZOOM].time_us == 57 * kMs);
    REQUIRE(bench.read(0, 0) == ERROR_OK);
    CHECK(bench.readings[LENS_ZOOM].time_us == 0);
    CHECK(bench.line.lines == std::vector<std::string>{"1?", "2?"});
    CHECK(bench.counts().late == 0);
}

TEST_CASE("a lens that does not answer does not keep the other from being asked") {
    Bench bench([](const std::string &line, int) {
        return line[0] == '1' ? std::vector<Piece>()
                              : std::vector<Piece>{{57 * kMs, status(2, 600)}};
    });
    CHECK(bench.read(0, 20 * kMs) == ERROR_TIMEOUT);
    REQUIRE(bench.read(1, 300 * kMs) == ERROR_OK);  // 200 ms after the first question
    const lens_drive right = bench.lens(1);
    CHECK(bench.read(0, 20 * kMs) == ERROR_TIMEOUT);
    const uint64_t begin_us = bench.line.now_us;
    REQUIRE(lens_open(&right, begin_us + 100 * kMs) == ERROR_OK);  // asks at once
    CHECK(bench.line.now_us == begin_us + 57 * kMs);
}

TEST_CASE("both lenses polled without waiting share the line") {
    Bench bench(good(500));
    unsigned count[2] = {0, 0};
    const uint64_t end_us = 2000 * kMs;
    for (unsigned i = 0; bench.line.now_us < end_us; i++) {
        const int error = bench.read(i % 2, 0);
        REQUIRE((error == ERROR_OK || error == ERROR_TIMEOUT));
        count[i % 2] += error == ERROR_OK;
        bench.line.now_us += 5 * kMs;
    }
    // An answer takes 57 ms, and is taken and followed by the next question 10 ms later.
    CHECK(count[0] >= 13);
    CHECK(count[1] >= 13);
    CHECK(bench.counts().late == 0);
    CHECK(bench.counts().silent == 0);
}

TEST_CASE("an answer that arrived between two reads is taken, however long ago") {
    Bench bench(good(500));
    CHECK(bench.read(0, 0) == ERROR_TIMEOUT);
    bench.line.now_us += 3000 * kMs;
    REQUIRE(bench.read(0, 0) == ERROR_OK);
    CHECK(bench.readings[LENS_ZOOM].time_us == 0);
    CHECK(bench.counts().silent == 0);
}

TEST_CASE("numbers with too many digits and records that are too long are rubbish") {
    for (const char *record : {"Zoom:00400", "aaaaaaaaaaaaaaaaaaaa:4009", "Zoom:", "Zoom:4x0"}) {
        Bench bench([&](const std::string &, int) {
            return std::vector<Piece>{
                {57 * kMs, std::string("V3LC 1\r") + record + "\rFocus:0400\rIris:0400\r\n"}};
        });
        CHECK(bench.read(0, 150 * kMs) == ERROR_TIMEOUT);
        CHECK(bench.counts().garbage == 1);
    }
    Bench bench([&](const std::string &, int) {  // a record of the maximum length
        return std::vector<Piece>{
            {57 * kMs, "V3LC 1\raaaaaaaaaaaaaaaaaaaa:400\rFocus:0400\rIris:  400\r\n"}};
    });
    CHECK(bench.read(0, 150 * kMs) == ERROR_OK);
}

TEST_CASE("short deadlines do no harm: the question stays open") {
    Bench bench([](const std::string &, int) {
        return std::vector<Piece>{{170 * kMs, status(1, 640)}};
    });
    int tries = 0;
    while (bench.read(0, 20 * kMs) == ERROR_TIMEOUT) {
        REQUIRE(++tries < 20);
    }
    CHECK(tries == 8);
    CHECK(bench.counts().asked == 1);
    CHECK(bench.readings[LENS_ZOOM].position == 640);
    CHECK(bench.readings[LENS_ZOOM].time_us == 0);
}

TEST_CASE("what came before the question is not its answer") {
    Bench bench(good(400));
    bench.line.comes(10, status(1, 800));
    bench.line.comes(20, "V3LC 1\rZoom:0");  // first half of another answer
    bench.line.now_us = 1000;
    REQUIRE(bench.read(0, 500 * kMs) == ERROR_OK);
    CHECK(bench.readings[LENS_ZOOM].position == 400);
}

TEST_CASE("pieces are put together, at every place where they may fall apart") {
    const std::string whole = status(1, 345);
    for (size_t cut = 1; cut < whole.size(); cut++) {
        Bench bench([&](const std::string &, int) {
            return std::vector<Piece>{{20 * kMs, whole.substr(0, cut)},
                                      {150 * kMs, whole.substr(cut)}};
        });
        REQUIRE(bench.read(0, 500 * kMs) == ERROR_OK);
        CHECK(bench.readings[LENS_ZOOM].position == 345);
        CHECK(bench.counts().asked == 1);
    }
}

TEST_CASE("any byte that is lost or another makes it no answer, or does no harm") {
    const std::string whole = status(1, 345, 512, 698);
    for (size_t at = 0; at + 1 < whole.size(); at++) {
        for (int change = -1; change < 256; change++) {
            std::string corrupted = whole;
            if (change < 0) {
                corrupted.erase(at, 1);
            } else {
                corrupted[at] = char(change);
            }
            Bench bench([&](const std::string &, int question) {
                return std::vector<Piece>{{57 * kMs, question == 1 ? corrupted : whole}};
            });
            REQUIRE(bench.read(0, 1000 * kMs) == ERROR_OK);
            INFO("byte " << at << " to " << change);
            const bool digit = whole[at] >= '0' && whole[at] <= '9';
            const bool reported = change < 0 || change < '0' || change > '9' || !digit;
            const bool same = bench.readings[0].position == 345 &&
                              bench.readings[1].position == 512 &&
                              bench.readings[2].position == 698;
            // A blank instead of a leading 0 is the same number; so is a lost 0.
            CHECK((same || !reported));
        }
    }
}

TEST_CASE("values that no position has are asked for again") {
    for (const int wrong : {0, 259, 891, 1023, 9999}) {
        Bench bench([&](const std::string &, int question) {
            return std::vector<Piece>{{57 * kMs, status(1, 400, question < 3 ? wrong : 500)}};
        });
        REQUIRE(bench.read(0, 1000 * kMs) == ERROR_OK);
        CHECK(bench.readings[LENS_FOCUS].position == 500);
        CHECK(bench.counts().garbage == 2);
        CHECK(bench.counts().asked == 3);
        // Not faster than the line carries answers.
        CHECK(bench.line.now_us == 257 * kMs);
    }
    Bench bench([](const std::string &, int) {
        return std::vector<Piece>{{57 * kMs, status(1, 400, 500, 17)}};
    });
    CHECK(bench.read(0, 1000 * kMs) == ERROR_TIMEOUT);
    CHECK(bench.counts().garbage == 10);
}

TEST_CASE("the other lens's answer is not this one's") {
    Bench bench([](const std::string &, int) {
        return std::vector<Piece>{{30 * kMs, status(1, 400)}, {90 * kMs, status(2, 700)}};
    });
    REQUIRE(bench.read(1, 500 * kMs) == ERROR_OK);
    CHECK(bench.readings[LENS_ZOOM].position == 700);
    CHECK(bench.counts().late == 1);
}

TEST_CASE("a lens that does not exist is never read") {
    for (const char *text : {"V3LC 3\r", "V3LC 0\r", "V3LC\r", "V3LC 12\r", "V3LC 1 \r"}) {
        Bench bench([&](const std::string &, int) {
            return std::vector<Piece>{
                {57 * kMs, std::string(text) + "Zoom:0400\rFocus:0400\rIris:0400\r\n"}};
        });
        CHECK(bench.read(0, 1000 * kMs) == ERROR_TIMEOUT);
        CHECK(bench.counts().garbage == 10);
    }
}

TEST_CASE("late answers do not stay one behind") {
    // The position is the number of the question being answered.
    Bench bench([](const std::string &, int question) {
        return std::vector<Piece>{{330 * kMs, status(1, 300 + question)}};
    });
    REQUIRE(bench.read(0, 2000 * kMs) == ERROR_OK);
    CHECK(bench.readings[LENS_ZOOM].position == 301);
    CHECK(bench.readings[LENS_ZOOM].time_us == 0);  // time of the first question
    CHECK(bench.counts().asked == 2);
    for (int question = 3; question < 10; question++) {
        const uint64_t begin_us = bench.line.now_us;
        REQUIRE(bench.read(0, 2000 * kMs) == ERROR_OK);
        CHECK(bench.readings[LENS_ZOOM].position == 300 + question);
        CHECK(bench.readings[LENS_ZOOM].time_us >= begin_us);
    }
    CHECK(bench.counts().late == 1);
    CHECK(bench.counts().asked == 9);
}

TEST_CASE("NUL bytes and endless streams end at the deadline, and it works again after them") {
    Bench bench(good(500));
    bench.line.comes(1, std::string(300, '\0'));
    REQUIRE(bench.read(0, 500 * kMs) == ERROR_OK);
    bench.line.noise_until_us = bench.line.now_us + 3000 * kMs;
    const uint64_t begin_us = bench.line.now_us;
    CHECK(bench.read(0, 1000 * kMs) == ERROR_TIMEOUT);
    CHECK(bench.line.now_us <= begin_us + 1001 * kMs);
    // An answer might get through: it is asked again now and then.
    const uint32_t asked = bench.counts().asked;
    CHECK(bench.read(0, 1900 * kMs) == ERROR_TIMEOUT);
    CHECK(bench.counts().asked == asked + 1);
    bench.line.now_us = bench.line.noise_until_us;
    REQUIRE(bench.read(0, 1000 * kMs) == ERROR_OK);
    CHECK(bench.readings[LENS_ZOOM].position == 500);
}

TEST_CASE("what the system says is passed on at once") {
    Bench bench(good());
    for (const int error : {ERROR_IO, ERROR_DEVICE}) {
        bench.line.fails = error;
        const uint64_t begin_us = bench.line.now_us;
        CHECK(bench.read(0, 1000 * kMs) == error);
        CHECK(bench.go(0, LENS_ZOOM, 400) == error);
        CHECK(bench.line.now_us == begin_us);
    }
    bench.line.fails = ERROR_OK;
    CHECK(bench.read(0, 1000 * kMs) == ERROR_OK);
}

TEST_CASE("a V1LC has no digits, no LF that could be relied on, and no iris") {
    Bench bench(
        [](const std::string &line, int) {
            CHECK(line == "?");
            return std::vector<Piece>{{40 * kMs, "V1LC\rz:120\rf:44\ri:random\r"}};
        },
        true);
    const lens_drive lens = bench.lens(0);
    REQUIRE(lens_open(&lens, 1000 * kMs) == ERROR_OK);
    CHECK(!lens_has_axis(&lens, LENS_IRIS));
    REQUIRE(bench.read(0, 500 * kMs) == ERROR_OK);
    CHECK(bench.readings[LENS_ZOOM].position == 120);
    CHECK(bench.readings[LENS_FOCUS].position == 44);
    CHECK(bench.readings[LENS_IRIS].position == 0);
    CHECK(bench.go(0, LENS_ZOOM, 99) == ERROR_OK);
    CHECK(bench.line.lines.back() == "Z099");
    CHECK(bench.go(0, LENS_ZOOM, 181) == ERROR_RANGE);
    CHECK(bench.go(0, LENS_IRIS, 100) == ERROR_NOT_CONNECTED);
}
