// SPDX-License-Identifier: Apache-2.0
//
// The world around the pixel path for video_path.cpp: cameras whose clocks drift and stop, and the
// DSP that takes the frames.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <random>
#include <vector>

namespace video_path {

using Picoseconds = std::int64_t;

constexpr Picoseconds kControlHalf = 20000;  // 25 MHz
constexpr Picoseconds kPixelHalf = 10417;    // 48 MHz
constexpr Picoseconds kOutputDelay = 3900;   // of the sensor's data after its clock
constexpr int kPattern = 2;

inline int failures = 0;

inline void fail(const char *what, Picoseconds when) {
    if (++failures <= 200)
        std::printf("FAIL %s at %.3f us\n", what, static_cast<double>(when) * 1e-6);
}

/** One mode of operation: what stays the same during a run. */
struct Mode {
    bool first_line_sync;
    bool tag;
    bool alternating;
    std::array<bool, 2> falling;
    bool faults;       // clocks stop
    bool wrong_sizes;  // now and then a line or frame of another size
    bool long_frames;  // above the time-out: a switch cuts them while their clock runs
    int width, height, line_blanking, frame_blanking;
};

/** The pixel at column x, row y of a frame of a camera; pixel 1 tells camera and frame. */
inline int pixel_of(int camera, int frame, int x, int y) {
    if (x == 1)
        return camera << 9 | (frame & 511);
    std::uint32_t h = static_cast<std::uint32_t>(frame) * 2654435761u ^
                      static_cast<std::uint32_t>(x) * 40503u ^
                      static_cast<std::uint32_t>(y) * 2246822519u ^
                      static_cast<std::uint32_t>(camera + 1) * 3266489917u;
    h ^= h >> 15;
    h *= 2246822519u;
    return static_cast<int>(h >> 20 & 1023);
}

/** A sensor and its clock. */
class Camera {
  public:
    Camera(int number, const Mode &mode, std::mt19937_64 &random)
        : number_(number), mode_(mode), random_(random) {
        next_edge_ = static_cast<Picoseconds>(random_() % 20000) + 1;
        half_ = kPixelHalf;
        plan_fault(1'000'000);
        blank_ = 60;
    }

    Picoseconds next_event() const { return std::min(next_edge_, next_data_); }

    /** Does what is due at `now`. */
    void advance(Picoseconds now) {
        if (now == next_data_) {
            data = waiting_data_;
            line = waiting_line_;
            frame = waiting_frame_;
            next_data_ = kNever;
        }
        if (now != next_edge_)
            return;
        clock = !clock;
        // Data change at the edge at which the bridge does not sample.
        if (clock == mode_.falling[static_cast<std::size_t>(number_)]) {
            produce();
            next_data_ = now + kOutputDelay;
        }
        half_ += static_cast<Picoseconds>(random_() % 5) - 2;  // drift
        half_ = std::clamp<Picoseconds>(half_, kPixelHalf * 99 / 100, kPixelHalf * 101 / 100);
        next_edge_ = now + half_;
        if (mode_.faults && healthy_after_ < 0 && now >= fault_at_) {
            next_edge_ += fault_length_;
            plan_fault(next_edge_);
        }
    }

    /** No further faults from now on; a stopped clock comes back. */
    void heal(Picoseconds now) {
        healthy_after_ = now;
        next_edge_ = std::min(next_edge_, now + 3 * kPixelHalf);
    }

    /** Counts from the next whole frame on. */
    void count_anew() {
        frames_done_ = wrong_lines_ = wrong_frames_ = 0;
        skipping_ = blank_ == 0;
    }

    int frame_number() const { return frame_number_; }
    int frames_sent() const { return frames_done_; }
    int wrong_lines() const { return wrong_lines_; }
    int wrong_frames() const { return wrong_frames_; }
    /** Size of a frame by its number's low nine bits. */
    const std::vector<int> &lines_of(int frame) const {
        return sizes_[static_cast<std::size_t>(frame & 511)];
    }

    bool clock = false;
    int data = 0;
    bool line = false;
    bool frame = false;

  private:
    static constexpr Picoseconds kNever = INT64_MAX;

    void plan_fault(Picoseconds from) {
        fault_at_ = from + static_cast<Picoseconds>(random_() % 60'000'000);
        switch (random_() % 4) {
            case 0:
                fault_length_ = static_cast<Picoseconds>(random_() % 400'000);
                break;
            case 1:
                fault_length_ = 5'900'000 + static_cast<Picoseconds>(random_() % 4'000'000);
                break;  // just lost
            case 2:
                fault_length_ = static_cast<Picoseconds>(random_() % 12'000'000);
                break;
            default:
                fault_length_ = static_cast<Picoseconds>(random_() % 200'000'000);
                break;
        }
    }

    void begin_frame() {
        int height = mode_.height;
        if (mode_.wrong_sizes && random_() % 8 == 0)
            height = 1 + static_cast<int>(random_() % 20);
        auto &lines = sizes_[static_cast<std::size_t>(frame_number_ & 511)];
        lines.assign(static_cast<std::size_t>(height), mode_.width);
        if (mode_.wrong_sizes && random_() % 4 == 0) {
            lines[random_() % lines.size()] = 4 + static_cast<int>(random_() % 60);
        }
        y_ = 0;
        x_ = -(2 + static_cast<int>(random_() % 6));
        blank_ = 0;
    }

    /** The pins' next values. */
    void produce() {
        if (blank_ > 0) {
            --blank_;
            waiting_frame_ = waiting_line_ = false;
            waiting_data_ = static_cast<int>(random_() & 1023);
            if (blank_ == 0)
                begin_frame();
            return;
        }
        const auto &lines = sizes_[static_cast<std::size_t>(frame_number_ & 511)];
        waiting_frame_ = true;
        waiting_line_ = x_ >= 0;
        waiting_data_ =
            x_ >= 0 ? pixel_of(number_, frame_number_, x_, y_) : static_cast<int>(random_() & 1023);
        ++x_;
        if (x_ < lines[static_cast<std::size_t>(y_)])
            return;
        if (lines[static_cast<std::size_t>(y_)] != mode_.width)
            wrong_lines_ += !skipping_;
        x_ = -mode_.line_blanking;
        ++y_;
        if (y_ < static_cast<int>(lines.size()))
            return;
        if (static_cast<int>(lines.size()) != mode_.height)
            wrong_frames_ += !skipping_;
        blank_ = mode_.frame_blanking;
        ++frame_number_;
        frames_done_ += !skipping_;
        skipping_ = false;
    }

    int number_;
    const Mode &mode_;
    std::mt19937_64 &random_;
    Picoseconds next_edge_ = 0, next_data_ = kNever, half_ = kPixelHalf;
    Picoseconds fault_at_ = 0, fault_length_ = 0, healthy_after_ = -1;
    bool skipping_ = false;  // the frame under way began before count_anew
    int waiting_data_ = 0;
    bool waiting_line_ = false, waiting_frame_ = false;
    int x_ = 0, y_ = 0, blank_ = 0, frame_number_ = 0, frames_done_ = 0, wrong_lines_ = 0,
        wrong_frames_ = 0;
    std::array<std::vector<int>, 512> sizes_;
};

/** What the DSP sees at the rising edges of the PPI clock. */
class Receiver {
  public:
    Receiver(const Mode &mode, const std::array<Camera *, 2> &cameras)
        : mode_(mode), cameras_(cameras) {}

    void sample(bool line, bool sync, int data, int source, Picoseconds now) {
        if (mode_.first_line_sync ? sync && !sync_ : sync != sync_) {
            if (inside_)
                finish(false, now);
            if (sync) {
                inside_ = true;
                source_ = source;
                lines_.clear();
            }
        }
        sync_ = sync;
        if (!mode_.first_line_sync && line && !sync)
            fail("line outside a frame", now);
        if (line && !inside_)
            fail("line outside a frame", now);
        if (line && !line_)
            lines_.emplace_back();
        if (line)
            lines_.back().push_back(data);
        line_ = line;
    }

    /** A forced switch may end a frame without a further clock. */
    void source_changes(unsigned cut, Picoseconds now) {
        if (inside_)
            finish(cut >> source_ & 1, now);
        sync_ = line_ = false;
    }

    int whole = 0, torn = 0;
    std::array<int, 3> from{};

  private:
    /** flagged: the bridge says that just this frame was cut. Each torn frame must be. */
    void finish(bool flagged, Picoseconds now) {
        inside_ = false;
        const bool is_whole =
            !lines_.empty() && (source_ == kPattern ? whole_pattern(now) : whole_camera(now));
        is_whole ? ++whole : ++torn;
        if (!is_whole && !flagged)
            fail("torn frame without its flag", now);
        if (lines_.empty())
            return;
        ++from[static_cast<std::size_t>(source_)];
    }

    bool tag_right(Picoseconds now) {
        if (!mode_.tag)
            return true;
        const int tag = lines_[0][0];
        if (tag >> 8 != source_)
            fail("wrong source in the tag", now);
        if (number_ >= 0 && (tag & 255) != ((number_ + 1) & 255))
            fail("wrong number in the tag", now);
        number_ = tag & 255;
        return true;
    }

    bool whole_camera(Picoseconds now) {
        tag_right(now);
        if (lines_[0].size() < 2)
            return false;
        const int id = lines_[0][1];
        if (id >> 9 != source_)
            fail("frame of the other camera", now);
        const int frame = id & 511;
        const auto &sizes = cameras_[static_cast<std::size_t>(source_)]->lines_of(frame);
        if (lines_.size() != sizes.size())
            return false;
        for (std::size_t y = 0; y < sizes.size(); ++y) {
            if (static_cast<int>(lines_[y].size()) != sizes[y])
                return false;
            for (std::size_t x = 0; x < lines_[y].size(); ++x) {
                if (mode_.tag && x == 0 && y == 0)
                    continue;
                if (lines_[y][x] != recover(frame, static_cast<int>(x), static_cast<int>(y)))
                    return false;
            }
        }
        return true;
    }

    /** Frames are numbered above nine bits only inside the camera: try the last few. */
    int recover(int frame, int x, int y) {
        const int sent = cameras_[static_cast<std::size_t>(source_)]->frame_number();
        const int number = sent - ((sent - frame) & 511);
        return pixel_of(source_, number, x, y);
    }

    bool whole_pattern(Picoseconds now) {
        tag_right(now);
        if (static_cast<int>(lines_.size()) != mode_.height)
            return false;
        int value = mode_.tag ? (lines_[0][1] + 1023) & 1023 : lines_[0][0];
        for (std::size_t y = 0; y < lines_.size(); ++y) {
            if (static_cast<int>(lines_[y].size()) != mode_.width)
                return false;
            for (std::size_t x = 0; x < lines_[y].size(); ++x, ++value) {
                if (mode_.tag && x == 0 && y == 0)
                    continue;
                if (lines_[y][x] != (value & 1023))
                    return false;
            }
            ++value;
        }
        return true;
    }

    const Mode &mode_;
    const std::array<Camera *, 2> &cameras_;
    std::vector<std::vector<int>> lines_;
    bool inside_ = false, sync_ = false, line_ = false;
    int source_ = 0, number_ = -1;
};

}  // namespace video_path
