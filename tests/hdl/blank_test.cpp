// SPDX-License-Identifier: Apache-2.0
// Two bridges that live the same life, of which one evaluates every edge of a camera's clock and
// the other counts those between lines: every register, sample and edge is the same.
#include <doctest/doctest.h>

#include <cstring>
#include <memory>
#include <vector>

#include "bench/i2c_master.hpp"
#include "bench/random.hpp"
#include "bench/register_map.hpp"

namespace {

using hdl::kUs;

/// Rows of pixels that differ, with pauses between them, without end.
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

/// All that can be seen from outside, in a number.
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

class Twins {
  public:
    explicit Twins(uint64_t seed) : random_(seed) {
        for (Twin &twin : twins_) {
            twin.bridge = std::make_unique<hdl::Bridge>(seed);
            twin.master = std::make_unique<hdl::I2cMaster>(*twin.bridge, hdl::standard_timing(400));
            twin.registers = std::make_unique<hdl::Registers>(*twin.master);
            for (int camera = 0; camera < 2; camera++) {
                twin.rows[camera] = std::make_unique<Rows>(*twin.bridge, camera);
            }
            twin.witness = std::make_unique<Witness>(*twin.bridge);
        }
        bridge_model_set_stepping(twins_[1].bridge->model(), 1);
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
        for (Twin &twin : twins_) {
            for (int i = 0; i < 2; i++) {
                Rows &source = *twin.rows[i];
                const bool runs = i == camera || both;
                source.columns = columns;
                source.rows = rows;
                source.blank = blank;
                source.period_ps = runs ? period_ps : 0;
                bridge_model_feed(twin.bridge->model(), i, nullptr, 0, int(what & 1));
                twin.bridge->set_clock(i, source.period_ps);
            }
            twin.bridge->run(duration_ps);
        }
    }

    // In idle time a camera without frames runs its clock for a moment now and then.
    void show_alive() {
        const uint32_t period_ps = 12000 + random_.below(70000);
        const uint64_t bursts = 1 + random_.below(6), pause_ps = (1 + random_.below(140)) * kUs;
        for (uint64_t i = 0; i < 2 * bursts; i++) {
            for (Twin &twin : twins_) {
                twin.bridge->set_clock(int(i & 1), period_ps);
                twin.bridge->run_idle((14 + i) * period_ps + period_ps / 4);
                twin.bridge->set_clock(int(i & 1), 0);
                twin.bridge->run_idle(pause_ps);
            }
            check();
        }
    }

    void check() {
        bridge_outputs outputs[2];
        for (int i = 0; i < 2; i++) {
            std::memset(&outputs[i], 0, sizeof outputs[i]);
            bridge_model_get_outputs(twins_[i].bridge->model(), &outputs[i]);
        }
        REQUIRE(bridge_model_digest(twins_[0].bridge->model()) ==
                bridge_model_digest(twins_[1].bridge->model()));
        REQUIRE(twins_[0].bridge->now() == twins_[1].bridge->now());
        REQUIRE(twins_[0].witness->seen == twins_[1].witness->seen);
        REQUIRE(std::memcmp(&outputs[0], &outputs[1], sizeof outputs[0]) == 0);
    }
    uint64_t samples() const { return twins_[0].witness->count; }

  private:
    void write(uint8_t index, uint16_t value) {
        for (Twin &twin : twins_) {
            REQUIRE(twin.registers->write(index, value));
        }
    }

    struct Twin {
        std::unique_ptr<hdl::Bridge> bridge;
        std::unique_ptr<hdl::I2cMaster> master;
        std::unique_ptr<hdl::Registers> registers;
        std::unique_ptr<Rows> rows[2];
        std::unique_ptr<Witness> witness;
    };
    hdl::Random random_;
    Twin twins_[2];
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
