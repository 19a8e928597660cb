// SPDX-License-Identifier: Apache-2.0
// Two bridges with identical inputs: one evaluates every edge of a camera's clock, the other counts
// those between lines. Every register, sample and edge is the same.
#include <doctest/doctest.h>

#include <cstring>
#include <vector>

#include "bench/random.hpp"
#include "bench/twins.hpp"

namespace {

using hdl::kUs;

/// Endless rows of different pixels, with pauses between them.
class Rows : public hdl::Listener {
  public:
    Rows(hdl::Bridge &bridge, int camera) : bridge_(bridge), camera_(camera) { bridge.add(*this); }

    void on_pixel_clock(uint64_t, int camera, int level) override {
        if (camera != camera_ || period_ps == 0) {
            return;
        }
        const bool in_frame = row_ < rows;
        words_.assign(in_frame ? columns : 0, 0);
        for (uint16_t &word : words_) {
            word = uint16_t((pixel_++ * 37 & 0x3FF) | BRIDGE_WORD_LINE | BRIDGE_WORD_FRAME);
        }
        const bool last = row_ + 1 == rows;
        words_.resize(words_.size() + blank / 2, in_frame ? BRIDGE_WORD_FRAME : 0);
        words_.resize(words_.size() + blank - blank / 2, in_frame && !last ? BRIDGE_WORD_FRAME : 0);
        row_ = (row_ + 1) % (rows + 2);
        bridge_model_feed(bridge_.model(), camera_, words_.data(), words_.size(), level);
    }

    unsigned columns = 20, rows = 4, blank = 100;
    uint32_t period_ps = 0;

  private:
    hdl::Bridge &bridge_;
    int camera_;
    unsigned row_ = 0, pixel_ = 0;
    std::vector<uint16_t> words_;
};

/// A hash of everything visible from outside.
class Witness : public hdl::Listener {
  public:
    explicit Witness(hdl::Bridge &bridge) {
        bridge.add(*this);
        bridge_model_on_ppi(bridge.model(), samples, this);
    }
    uint32_t wanted() const override {
        return BRIDGE_EVENT_IRQ | BRIDGE_EVENT_SERVO | BRIDGE_EVENT_PPI | BRIDGE_EVENT_SENSOR |
               BRIDGE_EVENT_BUS;
    }
    void on_event(uint64_t time_ps, uint32_t events, const bridge_outputs &now) override {
        take(time_ps);
        take(events);
        take(now);
    }
    uint64_t seen = 0, count = 0;

  private:
    static void samples(void *self, uint64_t time_ps, const uint16_t *data, size_t size,
                        const bridge_outputs *now) {
        auto &witness = *static_cast<Witness *>(self);
        witness.take(time_ps);
        witness.take(*now);
        for (size_t i = 0; i < size; i++) {
            witness.take(uint64_t{data[i]});
        }
        witness.count += size;
    }
    void take(uint64_t number) { seen = (seen ^ number) * 0x100000001B3u + 1; }
    void take(const bridge_outputs &now) {
        uint16_t words[sizeof now / 2] = {};
        std::memcpy(words, &now, sizeof words);
        for (const uint16_t word : words) {
            take(uint64_t{word});
        }
    }
};

class Twins : public hdl::TwoBridges {
  public:
    explicit Twins(uint64_t seed) : TwoBridges(seed), random_(seed) {
        write(0x0B, 0x00FF);
        write(0x48, 0x00F3);
        write(0x08, 0x0103);
    }

    void live() {
        const unsigned what = random_.below(16);
        const auto number = [this](unsigned end) { return uint16_t(random_.below(end)); };
        if (what < 2) {  // a servo's place
            write(uint8_t(0x10 + 8 * what), uint16_t(900 * 16 + random_.below(1200 * 16)));
        } else if (what == 2) {  // edges, tag, shape of the syncs
            write(0x23, number(64));
        } else if (what < 5) {  // the source; 2 is the pattern
            write(0x20, number(what == 3 ? 2 : 3));
        } else if (what == 5) {
            write(0x08, uint16_t(3 | number(2) << 8));
        } else if (what == 6) {
            write(0x0A, 0x00FF);
        } else if (what == 7) {
            write(0x04, number(65535));
        }
        if (random_.below(2) == 0) {
            show_alive();
        }
        const int camera = int(random_.below(2));
        const unsigned columns = 4 + random_.below(60), rows = 1 + random_.below(5),
                       blank = 8 + random_.below(random_.below(2) == 0 ? 40 : 600);
        const uint32_t period_ps = random_.below(4) == 0 ? 0 : 12000 + random_.below(70000);
        const bool both = random_.below(4) == 0;
        const uint64_t duration_ps = random_.below(300) * kUs + random_.below(1000000);
        for (int which = 0; which < 2; which++) {
            hdl::Bridge &bridge = twins[which].bridge;
            for (int i = 0; i < 2; i++) {
                Rows &source = seen_[which].rows[i];
                const bool runs = i == camera || both;
                source.columns = columns;
                source.rows = rows;
                source.blank = blank;
                source.period_ps = runs ? period_ps : 0;
                bridge_model_feed(bridge.model(), i, nullptr, 0, int(what & 1));
                bridge.set_clock(i, source.period_ps);
            }
            bridge.run(duration_ps);
        }
    }

    // In idle time a camera without frames runs its clock occasionally.
    void show_alive() {
        const uint32_t period_ps = 12000 + random_.below(70000);
        const uint64_t bursts = 1 + random_.below(6), pause_ps = (1 + random_.below(140)) * kUs;
        for (uint64_t i = 0; i < 2 * bursts; i++) {
            for (hdl::Twin &twin : twins) {
                twin.bridge.set_clock(int(i & 1), period_ps);
                twin.bridge.run_idle((14 + i) * period_ps + period_ps / 4);
                twin.bridge.set_clock(int(i & 1), 0);
                twin.bridge.run_idle(pause_ps);
            }
            check();
        }
    }

    void check() {
        bridge_outputs outputs[2];
        for (int i = 0; i < 2; i++) {
            std::memset(&outputs[i], 0, sizeof outputs[i]);
            bridge_model_get_outputs(twins[i].bridge.model(), &outputs[i]);
        }
        REQUIRE(same());
        REQUIRE(seen_[0].witness.seen == seen_[1].witness.seen);
        REQUIRE(std::memcmp(&outputs[0], &outputs[1], sizeof outputs[0]) == 0);
    }
    uint64_t samples() const { return seen_[0].witness.count; }

  private:
    struct Seen {
        explicit Seen(hdl::Bridge &bridge)
            : rows{Rows(bridge, 0), Rows(bridge, 1)}, witness(bridge) {}

        Rows rows[2];
        Witness witness;
    };
    hdl::Random random_;
    Seen seen_[2] = {Seen(twins[0].bridge), Seen(twins[1].bridge)};
};

}  // namespace

TEST_CASE("edges between lines that only count are counted, with no other outcome") {
    const uint64_t seed = synthetic::test_seed();
    Twins twins(seed);
    const uint64_t lives = hdl::draws(150);
    for (uint64_t i = 0; i < lives; i++) {
        CAPTURE(i);
        twins.live();
        twins.check();
    }
    CHECK(twins.samples() > 10000);
}
