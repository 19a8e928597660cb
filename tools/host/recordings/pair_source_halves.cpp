// SPDX-License-Identifier: Apache-2.0
// Both views in one image, left half and right half, as ZED and StereoPi record them. Videos are
// decoded by the program ffmpeg.
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/error.h"
#include "daemon/base/raw_memory.h"
#include "daemon/files/input_file.h"
#include "tools/host/formats/image_formats.hpp"
#include "tools/host/formats/whole_file.hpp"
#include "tools/host/recordings/pair_source.hpp"

namespace {

constexpr uint64_t unknown_step_ns = 100000000;

void split(const owned_image &both, const std::string &name, recorded_pair *pair) {
    const raw_image &from = both.image;
    const int width_px = from.width_px / 2;
    if (from.width_px % 2 != 0 || (from.layout == RAW_BAYER_GRBG && width_px % 2 != 0)) {
        throw import_failure{
            ERROR_SIZE_MISMATCH,
            name + ": has no two halves: it is " + std::to_string(from.width_px) + " pixels wide"};
    }
    for (int side = 0; side < 2; side++) {
        owned_image half;
        half.image = from;
        half.image.width_px = width_px;
        half.image.release = nullptr;
        uint16_t *const pixels = raw_memory_allocate(&half.image);
        if (pixels == nullptr) {
            throw import_failure{ERROR_MEMORY, name + ": out of memory"};
        }
        const size_t row_values = raw_image_row_values(&half.image);
        for (int y = 0; y < from.height_px; y++) {
            std::memcpy(pixels + static_cast<size_t>(y) * row_values,
                        raw_image_row(&from, y) + static_cast<size_t>(side) * row_values,
                        row_values * sizeof *pixels);
        }
        pair->side[side] = std::move(half);
    }
}

bool no_calibration(std::string *where) {
    *where = "it has none";
    return false;
}

class image_halves : public pair_source {
  public:
    image_halves(const std::string &path, image_names images)
        : path_(path), images_(std::move(images)) {}

    bool next(recorded_pair *pair) override {
        if (at_ == images_.paths.size()) {
            return false;
        }
        const std::string &path = images_.paths[at_];
        split(pair_source_read(path, path), path, pair);
        uint64_t time_ns;
        if (!pair_source_time(images_.stems[at_], &time_ns)) {
            time_ns = at_ * unknown_step_ns;
        }
        pair->time_ns[0] = pair->time_ns[1] = time_ns;
        at_++;
        return true;
    }

    bool calibrate(const import_options &, calibration *, std::string *where) override {
        return no_calibration(where);
    }

  private:
    std::string path_;
    image_names images_;
    size_t at_ = 0;
};

/// A program whose output is read.
class process {
  public:
    process(const char *name, std::vector<std::string> words) {
        std::vector<char *> argv;
        for (std::string &word : words) {
            argv.push_back(&word[0]);
        }
        argv.push_back(nullptr);
        int ends[2];
        if (pipe(ends) != 0) {
            throw import_failure{ERROR_MEMORY, std::string(name) + ": " + std::strerror(errno)};
        }
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
        posix_spawn_file_actions_addclose(&actions, ends[0]);
        posix_spawn_file_actions_addclose(&actions, ends[1]);
        posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", 0, 0);
        posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", 1, 0);
        const int error = posix_spawnp(&id_, name, &actions, nullptr, argv.data(), environ);
        posix_spawn_file_actions_destroy(&actions);
        close(ends[1]);
        stream_ = fdopen(ends[0], "rb");
        if (error != 0 || stream_ == nullptr) {
            id_ = -1;
            end();
            throw import_failure{ERROR_UNSUPPORTED,
                                 std::string("videos are decoded by the program ffmpeg, which is "
                                             "missing: apt install ffmpeg")};
        }
    }
    ~process() { end(); }
    process(const process &) = delete;
    process &operator=(const process &) = delete;

    FILE *stream() { return stream_; }

    /// Whether it ended well. It gets SIGPIPE if it still writes.
    bool end() {
        if (stream_ != nullptr) {
            std::fclose(stream_);
            stream_ = nullptr;
        }
        int status = 1;
        if (id_ > 0) {
            while (waitpid(id_, &status, 0) < 0 && errno == EINTR) {
            }
            id_ = -1;
        }
        return status == 0;
    }

  private:
    pid_t id_ = -1;
    FILE *stream_ = nullptr;
};

class video_halves : public pair_source {
  public:
    explicit video_halves(const std::string &path)
        : path_(path),
          // A name that begins with "-" or has a ":" is not an option and not an address.
          decoder_("ffmpeg", {"ffmpeg", "-v", "error", "-i", "file:" + path, "-map", "0:v:0", "-f",
                              "image2pipe", "-c:v", "ppm", "-"}),
          step_ns_(step_ns(path)) {}

    bool next(recorded_pair *pair) override;
    bool calibrate(const import_options &, calibration *, std::string *where) override {
        return no_calibration(where);
    }

  private:
    static uint64_t step_ns(const std::string &path);
    bool read_head(raw_image *image);

    std::string path_;
    process decoder_;
    uint64_t step_ns_;
    size_t at_ = 0;
};

/// Time between two frames.
uint64_t video_halves::step_ns(const std::string &path) {
    process probe("ffprobe", {"ffprobe", "-v", "error", "-select_streams", "v:0", "-show_entries",
                              "stream=avg_frame_rate", "-of", "csv=p=0", "file:" + path});
    double frames = 0, seconds = 0;
    const bool known =
        std::fscanf(probe.stream(), "%lf/%lf", &frames, &seconds) == 2 && frames > 0 && seconds > 0;
    return known ? static_cast<uint64_t>(1e9 * seconds / frames) : unknown_step_ns;
}

/// Reads the head of the next image, which ffmpeg writes as a PPM; false at the end.
bool video_halves::read_head(raw_image *image) {
    constexpr int side_max_px = 32768, byte_max = 255, word_max = 65535;
    int largest;
    const int got = std::fscanf(decoder_.stream(), "P6 %d %d %d", &image->width_px,
                                &image->height_px, &largest);
    if (got == EOF) {
        if (at_ == 0 || !decoder_.end()) {
            throw import_failure{ERROR_SYNTAX, path_ + ": ffmpeg cannot decode it"};
        }
        return false;
    }
    const int side_px = got == 3 ? std::max(image->width_px, image->height_px) : 0;
    if (side_px < 1 || side_px > side_max_px || std::min(image->width_px, image->height_px) < 1 ||
        (largest != byte_max && largest != word_max)) {
        throw import_failure{ERROR_SYNTAX, path_ + ": ffmpeg wrote no image"};
    }
    image->bits = largest == byte_max ? 8 : 16;
    image->layout = RAW_RGB;
    std::fgetc(decoder_.stream());  // one blank
    return true;
}

bool video_halves::next(recorded_pair *pair) {
    owned_image both;
    if (!read_head(&both.image)) {
        return false;
    }
    uint16_t *const pixels = raw_memory_allocate(&both.image);
    if (pixels == nullptr) {
        throw import_failure{ERROR_MEMORY, path_ + ": out of memory"};
    }
    const size_t values =
        raw_image_row_values(&both.image) * static_cast<size_t>(both.image.height_px);
    const size_t value_bytes = both.image.bits == 8 ? 1 : 2;
    std::string raw(values * value_bytes, '\0');
    if (std::fread(&raw[0], 1, raw.size(), decoder_.stream()) != raw.size()) {
        throw import_failure{ERROR_SYNTAX, path_ + ": ffmpeg ended within an image"};
    }
    for (size_t i = 0; i < values; i++) {
        const auto *const at = reinterpret_cast<const unsigned char *>(&raw[i * value_bytes]);
        pixels[i] = static_cast<uint16_t>(value_bytes == 1 ? at[0] : at[0] << 8 | at[1]);
    }
    split(both, path_, pair);
    pair->time_ns[0] = pair->time_ns[1] = at_++ * step_ns_;
    return true;
}

/// Whether it begins as an image does.
bool is_image(const std::string &path) {
    const std::string head = whole_file_head(path, IMAGE_FILE_HEAD_BYTES);
    const image_format_list formats = image_formats();
    for (int i = 0; i < formats.count; i++) {
        const image_format &format = formats.first[i];
        if (format.probe != nullptr &&
            format.probe(reinterpret_cast<const unsigned char *>(head.data()), head.size())) {
            return true;
        }
    }
    return false;
}

}  // namespace

std::unique_ptr<pair_source> pair_source_halves(const pair_source_request &request) {
    if (input_file_is_directory(request.path.c_str())) {
        return std::make_unique<image_halves>(request.path, pair_source_list(request.path));
    }
    if (is_image(request.path)) {
        return std::make_unique<image_halves>(request.path,
                                              image_names{{request.path}, {request.path}});
    }
    return std::make_unique<video_halves>(request.path);
}
