// SPDX-License-Identifier: Apache-2.0
// The matcher on any sizes, strides, ranges, spans, presets and pictures: an error exactly where
// one is due, else a valid answer, the same at every processor level, on any number of threads and
// with any strides; no byte outside the pixels is written, and no memory beyond its bounds used.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include "core/error.h"
#include "daemon/base/workers.h"
#include "fuzz_check.hpp"
#include "stereo/image/reason.h"
#include "stereo/match/match.h"
#include "stereo/match/match_kernels.h"

namespace {

constexpr int width_max = 96, height_max = 48, cells_max = 1 << 15, threads_max = 3;
constexpr std::uint8_t guard_byte = 0xa5;
constexpr std::int32_t guard_word = 0x5aa55aa5;

/// The input as numbers; zeros after its end.
class Source {
  public:
    Source(const std::uint8_t *data, std::size_t size) : data_(data), size_(size) {}
    int byte() { return at_ < size_ ? data_[at_++] : 0; }
    int below(int count) { return byte() % count; }
    int word() {
        const int high = byte();
        return high << 8 | byte();
    }
    bool ended() const { return at_ >= size_; }

  private:
    const std::uint8_t *data_;
    std::size_t size_, at_ = 0;
};

std::uint32_t next_random(std::uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

/// Rows with a gap after each but the last, in memory of exactly that size; `offset` elements lie
/// in front.
template <typename T>
class Plane {
  public:
    Plane(int width, int height, int gap, int offset, T guard)
        : width_(width), height_(height), stride_(width + gap), offset_(offset), guard_(guard) {
        const std::size_t size = static_cast<std::size_t>(offset + (height - 1) * stride_ + width);
        cells_.reset(new T[size]);
        std::fill_n(cells_.get(), size, guard);
    }
    T *row(int y) const { return cells_.get() + offset_ + y * stride_; }
    int stride() const { return stride_; }

    /// Only pixels were written to.
    void check_guards() const {
        for (int i = 0; i < offset_; i++) {
            FUZZ_CHECK(cells_[static_cast<std::size_t>(i)] == guard_);
        }
        for (int y = 0; y + 1 < height_; y++) {
            for (int x = width_; x < stride_; x++) {
                FUZZ_CHECK(row(y)[x] == guard_);
            }
        }
    }
    void check_untouched() const {
        check_guards();
        for (int y = 0; y < height_; y++) {
            FUZZ_CHECK(std::all_of(row(y), row(y) + width_, [&](T v) { return v == guard_; }));
        }
    }
    void check_same(const Plane &other) const {
        for (int y = 0; y < height_; y++) {
            FUZZ_CHECK(std::equal(row(y), row(y) + width_, other.row(y)));
        }
    }

  private:
    int width_, height_, stride_, offset_;
    T guard_;
    std::unique_ptr<T[]> cells_;
};

struct Task {
    int width, height, other_height;  // of the left image, and of the right one
    std::array<int, 5> gap;           // of left, right, disparity, reason, confidence
    int offset;
    match_options options;
    int threads;
    bool with_spans, resampled;
    int cancel_after;                       // calls of progress; 0: never
    std::vector<std::uint8_t> left, right;  // a row after the other
    std::vector<rectify_span> left_span, right_span;
};

/// One of some kinds of pictures.
void paint(Source *source, int width, int height, std::vector<std::uint8_t> *picture) {
    const int kind = source->below(5);
    const int grey = source->byte();
    const int period = 1 + source->below(24);
    std::uint32_t random = static_cast<std::uint32_t>(source->word()) << 16 | 1u;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            int value = grey;
            if (kind == 1) {
                value = static_cast<int>(next_random(&random) & 0xff);
            } else if (kind == 2) {
                value = (x / period) % 2 == 0 ? grey : 255 - grey;
            } else if (kind == 3) {
                value = (y / period) % 2 == 0 ? grey : 255 - grey;
            } else if (kind == 4) {
                value = source->ended() ? grey + x * period / 4 : source->byte();
            }
            picture->push_back(static_cast<std::uint8_t>(value));
        }
    }
}

/// The left image seen from the right, shifted by one disparity above and another below.
void move(Source *source, const Task &task, std::vector<std::uint8_t> *picture) {
    const int upper = source->below(2 * width_max) - width_max;
    const int lower = source->below(2 * width_max) - width_max;
    const int noise = source->below(8);
    std::uint32_t random = static_cast<std::uint32_t>(source->word()) << 16 | 1u;
    for (int y = 0; y < task.other_height; y++) {
        const int from = std::min(y, task.height - 1) * task.width;
        for (int x = 0; x < task.width; x++) {
            const int moved = x + (y < task.height / 2 ? upper : lower);
            const int clamped = std::clamp(moved, 0, task.width - 1);
            const int value = task.left[static_cast<std::size_t>(from + clamped)] +
                              (noise > 0 ? static_cast<int>(next_random(&random)) % noise : 0);
            picture->push_back(static_cast<std::uint8_t>(value));
        }
    }
}

rectify_span span_of(Source *source, int width) {
    const int a = source->below(width + 1);
    const int b = source->below(width + 1);
    return {static_cast<std::int16_t>(std::min(a, b)), static_cast<std::int16_t>(std::max(a, b))};
}

match_options options_of(Source *source) {
    match_options options{};
    options.preset = static_cast<match_preset>(source->below(MATCH_PRESET_COUNT + 1));
    // A little more than what is legal, on both sides.
    options.disparity_min = source->word() % 2200 - 1100;
    options.disparity_count = source->word() % 1100 - 1;
    const int speckle = source->byte();
    options.speckle_px = speckle == 255 ? -1 : speckle;
    return options;
}

Task task_of(Source *source) {
    Task task{};
    task.options = options_of(source);
    task.width = 1 + source->below(width_max);
    task.height = 1 + source->below(height_max);
    const int lanes = std::max(16, task.options.disparity_count);
    while (task.height > MATCH_MIN_HEIGHT_PX && task.width * task.height * lanes > cells_max) {
        task.height--;
    }
    while (task.width > MATCH_MIN_WIDTH_PX && task.width * task.height * lanes > cells_max) {
        task.width--;
    }
    const int flags = source->byte();
    task.options.keep_all = (flags & 1) != 0;
    task.resampled = (flags & 2) != 0;
    task.with_spans = (flags & 4) != 0;
    task.other_height = task.height + ((flags & 0x38) == 0x38 ? 1 : 0);
    task.cancel_after = (flags & 0xc0) == 0xc0 ? 1 + source->below(6) : 0;
    for (int &gap : task.gap) {
        gap = source->below(40);
    }
    task.offset = source->below(8);
    task.threads = 1 + source->below(threads_max);
    paint(source, task.width, task.height, &task.left);
    if (source->below(3) == 0) {
        paint(source, task.width, task.other_height, &task.right);
    } else {
        move(source, task, &task.right);
    }
    for (int y = 0; y < task.height; y++) {
        task.left_span.push_back(span_of(source, task.width));
        task.right_span.push_back(span_of(source, task.width));
    }
    return task;
}

int expected_error(const Task &task) {
    const match_options &options = task.options;
    if (task.other_height != task.height) {
        return ERROR_SIZE_MISMATCH;
    }
    if (task.width < MATCH_MIN_WIDTH_PX || task.height < MATCH_MIN_HEIGHT_PX) {
        return ERROR_TOO_SMALL;
    }
    if (options.disparity_count < 1 || options.disparity_count > MATCH_MAX_DISPARITIES ||
        options.disparity_min < -MATCH_DISPARITY_LIMIT ||
        options.disparity_min + options.disparity_count > MATCH_DISPARITY_LIMIT) {
        return ERROR_DISPARITY_RANGE;
    }
    const bool legal = options.speckle_px >= 0 && options.preset < MATCH_PRESET_COUNT;
    return legal ? ERROR_OK : ERROR_ARGUMENT;
}

/// The real threads of the client; made once, for libFuzzer runs in one process.
const parallel *threads_of(int threads) {
    static std::array<workers *, threads_max + 1> all{};
    workers *&wanted = all[static_cast<std::size_t>(threads)];
    if (wanted == nullptr) {
        wanted = workers_create(threads);
        FUZZ_CHECK(wanted != nullptr);
    }
    return workers_parallel(wanted);
}

/// One run: images and outputs laid out with or without the task's gaps.
struct Run {
    Plane<std::uint8_t> left, right;
    Plane<std::int32_t> disparity_q8;
    Plane<std::uint8_t> reason, confidence;
    int error = 1, calls = 0, rows_done = 0;

    Run(const Task &task, bool gaps)
        : left(task.width, task.height, gaps ? task.gap[0] : 0, gaps ? task.offset : 0, guard_byte),
          right(task.width, task.other_height, gaps ? task.gap[1] : 0, 0, guard_byte),
          disparity_q8(task.width, task.height, gaps ? task.gap[2] : 0, 0, guard_word),
          reason(task.width, task.height, gaps ? task.gap[3] : 0, gaps ? task.offset : 0,
                 guard_byte),
          confidence(task.width, task.height, gaps ? task.gap[4] : 0, 0, guard_byte) {
        const auto width = static_cast<std::size_t>(task.width);
        for (int y = 0; y < task.height; y++) {
            std::copy_n(&task.left[static_cast<std::size_t>(y) * width], width, left.row(y));
        }
        for (int y = 0; y < task.other_height; y++) {
            std::copy_n(&task.right[static_cast<std::size_t>(y) * width], width, right.row(y));
        }
    }
    void check_guards() const {
        left.check_guards();
        right.check_guards();
        disparity_q8.check_guards();
        reason.check_guards();
        confidence.check_guards();
    }
    void check_untouched() const {
        disparity_q8.check_untouched();
        reason.check_untouched();
        confidence.check_untouched();
    }
    void check_same(const Run &other) const {
        FUZZ_CHECK(error == other.error && calls == other.calls);
        disparity_q8.check_same(other.disparity_q8);
        reason.check_same(other.reason);
        confidence.check_same(other.confidence);
    }
};

struct Progress {
    int calls, cancel_after, rows_done, rows;
};

bool count_calls(void *self, int rows_done, int rows) {
    Progress *progress = static_cast<Progress *>(self);
    FUZZ_CHECK(rows == progress->rows && rows_done > progress->rows_done && rows_done <= rows);
    progress->rows_done = rows_done;
    progress->calls++;
    return progress->cancel_after == 0 || progress->calls < progress->cancel_after;
}

void run(const Task &task, const match_kernels *kernels, int threads, Run *run) {
    match_options options = task.options;
    options.kernels = kernels;
    const match_input input = {
        {run->left.row(0), task.width, task.height, run->left.stride()},
        {run->right.row(0), task.width, task.other_height, run->right.stride()},
        task.with_spans ? task.left_span.data() : nullptr,
        task.with_spans ? task.right_span.data() : nullptr,
        task.resampled};
    match_output output = {
        {run->disparity_q8.row(0), task.width, task.height, run->disparity_q8.stride()},
        {run->reason.row(0), task.width, task.height, run->reason.stride()},
        {run->confidence.row(0), task.width, task.height, run->confidence.stride()}};
    const std::size_t bytes = match_need_bytes(task.width, &options, threads);
    void *memory = nullptr;
    FUZZ_CHECK(posix_memalign(&memory, ARENA_ALIGNMENT, std::max<std::size_t>(bytes, 1)) == 0);
    std::memset(memory, guard_byte, bytes);
    arena arena;
    arena_init(&arena, memory, bytes);
    Progress progress = {0, task.cancel_after, 0, task.height};
    run->error =
        match_run(&input, &options, threads_of(threads), count_calls, &progress, &arena, &output);
    run->calls = progress.calls;
    run->rows_done = progress.rows_done;
    FUZZ_CHECK(arena.used_bytes == 0 && arena.peak_bytes <= bytes);
    std::free(memory);
    run->check_guards();
}

/// Whether no pixel around one, in rows of its own, is at a border: what the medians take in there
/// lies outside the right image.
bool is_inner(const Task &task, const Run &run, int x, int y) {
    const int reach = task.options.preset == MATCH_PRESET_FAST ? 3 : 1;
    for (int row = y - reach; row <= y + reach; row++) {
        for (int column = x - 1; column <= x + 1; column++) {
            if (row >= 0 && row < task.height && column >= 0 && column < task.width &&
                run.reason.row(row)[column] == REASON_BORDER) {
                return false;
            }
        }
    }
    return true;
}

/// Whether both cameras see a pixel: it lies in its row's span, and so does its right pixel at one
/// of the searched disparities.
bool is_seen(const Task &task, int x, int y) {
    const auto row = static_cast<std::size_t>(y);
    const rectify_span whole = {0, static_cast<std::int16_t>(task.width)};
    const rectify_span left = task.with_spans ? task.left_span[row] : whole;
    const rectify_span right = task.with_spans ? task.right_span[row] : whole;
    const int end = x - task.options.disparity_min + 1;
    const int begin = end - task.options.disparity_count;
    return x >= left.begin && x < left.end &&
           std::max<int>(begin, right.begin) < std::min<int>(end, right.end);
}

/// The property of every answer.
void check_sane(const Task &task, const Run &run) {
    const match_options &options = task.options;
    // The others search a window of the range, which may lie outside the right image.
    const bool searches_all =
        options.preset == MATCH_PRESET_BEST || options.preset == MATCH_PRESET_PAPER;
    FUZZ_CHECK(run.rows_done == task.height);
    for (int y = 0; y < task.height; y++) {
        for (int x = 0; x < task.width; x++) {
            const int reason = run.reason.row(y)[x];
            const double disparity = run.disparity_q8.row(y)[x] / 256.0;
            FUZZ_CHECK(reason < REASON_COUNT);
            FUZZ_CHECK(!options.keep_all || reason == REASON_VALID || reason == REASON_BORDER);
            FUZZ_CHECK(disparity > options.disparity_min - 1 &&
                       disparity < options.disparity_min + options.disparity_count);
            // Where all that its medians look at have a place in the right image.
            FUZZ_CHECK(reason != REASON_VALID || !is_inner(task, run, x, y) ||
                       (x - disparity > -2 && x - disparity < task.width + 1));
            // Every other row of the preset fast is that of its neighbour.
            if (!task.with_spans || options.preset != MATCH_PRESET_FAST) {
                const bool seen = is_seen(task, x, y);
                FUZZ_CHECK(seen || reason == REASON_BORDER);
                FUZZ_CHECK(!seen || !searches_all || reason != REASON_BORDER);
            }
        }
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    Source source(data, size);
    const Task task = task_of(&source);
    const int error = expected_error(task);
    Run first(task, false);
    run(task, match_kernels_named("plain"), 1, &first);
    if (error != ERROR_OK) {
        FUZZ_CHECK(first.error == error && first.calls == 0);
        first.check_untouched();
        return 0;
    }
    if (task.cancel_after == 0) {
        FUZZ_CHECK(first.error == ERROR_OK);
        check_sane(task, first);
    } else {
        FUZZ_CHECK(first.error == ERROR_CANCELLED || first.error == ERROR_OK);
    }
    for (const char *name : {"plain", "sse41", "avx2", "neon"}) {
        const match_kernels *kernels = match_kernels_named(name);
        if (kernels != nullptr) {
            // How many rows are done between two calls may depend on the threads.
            Run other(task, true);
            run(task, kernels, task.cancel_after > 0 ? 1 : task.threads, &other);
            FUZZ_CHECK(other.error == first.error);
            other.disparity_q8.check_same(first.disparity_q8);
            other.reason.check_same(first.reason);
            other.confidence.check_same(first.confidence);
        }
    }
    return 0;
}
