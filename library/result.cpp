// SPDX-License-Identifier: Apache-2.0
/// Reconstructions of libvergence: the job of `vergence reconstruct`, kept after it has run.
#include "library/result.hpp"

#include <fcntl.h>

#include <cstdio>
#include <cstdlib>
#include <memory>

#include "core/invariant.h"
#include "daemon/surface/result/result_json.h"
#include "tools/host/program/host_program.hpp"

namespace {

void expect(void *self, const double *work_ns, int stages) {
    static_cast<vergence_result *>(self)->watch->expect(work_ns, stages);
}

void show_progress(void *self, int stage, const char *what, int done, int total) {
    static_cast<vergence_result *>(self)->watch->show(stage, what, done, total);
}

bool should_stop(void *self) {
    return static_cast<vergence_result *>(self)->watch->should_stop();
}

int channels_of(const vergence_image &image) {
    return image.layout == VERGENCE_RGB || image.layout == VERGENCE_BGR ? 3 : 1;
}

raw_layout layout_of(const vergence_image &image) {
    if (image.layout == VERGENCE_BAYER_GRBG) {
        return RAW_BAYER_GRBG;
    }
    return channels_of(image) == 3 ? RAW_RGB : RAW_GREY;
}

/// One row as the core's images have it.
void convert_row(const vergence_image &image, int y, std::vector<uint16_t> *row) {
    const auto *bytes = static_cast<const uint8_t *>(image.data) + y * image.row_bytes;
    const auto *words = reinterpret_cast<const uint16_t *>(bytes);
    for (size_t i = 0; i < row->size(); i++) {
        (*row)[i] = image.value_bytes == 1 ? bytes[i] : words[i];
    }
    for (size_t i = 0; image.layout == VERGENCE_BGR && i < row->size(); i += 3) {
        std::swap((*row)[i], (*row)[i + 2]);
    }
}

/// What the program cannot know of an image in memory; "": nothing is wrong.
std::string fault_of(const vergence_image &image) {
    const int bits = image.bits != 0 ? image.bits : 8 * image.value_bytes;
    if (image.data == nullptr) {
        return "no pixels";
    }
    if (image.value_bytes != 1 && image.value_bytes != 2) {
        return "values must have 8 or 16 bits";
    }
    if (bits < 8 || bits > 8 * image.value_bytes) {
        return "bits must be 8 to 16";
    }
    if (image.layout < VERGENCE_GREY || image.layout > VERGENCE_BAYER_GRBG) {
        return "unknown layout";
    }
    const bool aligned =
        reinterpret_cast<uintptr_t>(image.data) % 2 == 0 && image.row_bytes % 2 == 0;
    return image.value_bytes == 2 && !aligned ? "16 bit values must be aligned" : "";
}

int read_image(void *self, int side, const image_request *, image_file *file, message *message) {
    const vergence_image &image = *static_cast<vergence_result *>(self)->image[side];
    const std::string fault = fault_of(image);
    if (!fault.empty()) {
        return message_set(message, ERROR_ARGUMENT, "%s: %s", file->path, fault.c_str());
    }
    const int channels = channels_of(image);
    const int error = image_file_begin(file, image.width_px, image.height_px, channels,
                                       image.bits != 0 ? image.bits : 8 * image.value_bytes,
                                       layout_of(image), message);
    if (error != ERROR_OK) {
        return error;
    }
    std::vector<uint16_t> row(static_cast<size_t>(image.width_px) * static_cast<size_t>(channels));
    for (int y = 0; y < image.height_px; y++) {
        convert_row(image, y, &row);
        const int refused = image_file_row(file, row.data(), message);
        if (refused != ERROR_OK) {
            return refused;
        }
    }
    return ERROR_OK;
}

/// The request, from the words of the options. 0, or a code with `text` set.
int read_request(vergence_result *made, const char *left, const char *right,
                 const vergence_calibration *calibration, const char *const *options,
                 std::string *text) {
    library_words &words = made->words;
    words.add(options);
    if (calibration != nullptr) {
        words.add("--calibration");
        words.add(calibration->path);
    }
    words.add("--");
    words.add(left);
    if (right != nullptr) {
        words.add(right);
    }
    message line{};
    const int error =
        reconstruct_request_read(words.count(), words.values(), &made->request, &line);
    if (error != ERROR_OK) {
        *text = line.text;
    } else if (made->request.out_path != nullptr) {
        *text = "--out is not an option of this call: write the result";
        return ERROR_ARGUMENT;
    } else if (made->request.all) {
        *text = "--all is not an option of this call: see vergence_pairs_list";
        return ERROR_ARGUMENT;
    } else if (result_format_check(made->request.files, made->program.writers, &line) != ERROR_OK) {
        *text = line.text;
        return ERROR_ARGUMENT;
    }
    return error;
}

void choose_source(vergence_result *made, const vergence_calibration *calibration) {
    made->caller = {"--scale",
                    "--scale or --region",
                    "--near and --far",
                    "--near and --far, or --disparity",
                    "--accept-mismatch",
                    reconstruct_inputs_read,
                    &made->source,
                    should_stop,
                    expect,
                    show_progress,
                    made};
    made->source.program = &made->program;
    made->source.self = made;
    if (made->image[0] != nullptr) {
        made->source.read_image = read_image;
    }
    if (calibration != nullptr) {
        made->source.calibration = &calibration->value;
        made->source.calibration_format = calibration->format.c_str();
    }
    if (made->request.session_path != nullptr) {
        made->session = std::make_unique<reconstruct_session>();
        reconstruct_session &session = *made->session;
        session.parent = AT_FDCWD;
        session.path = made->request.session_path;
        session.number = static_cast<uint32_t>(made->request.pair);
        session.load_calibration = made->program.load_calibration;
        session.loaded = calibration != nullptr ? &made->source : nullptr;
        session.missing = ": name a calibration";
        made->caller.read = reconstruct_session_read;
        made->caller.source = &session;
    }
    made->job.program = &made->program;
    made->job.request = &made->request;
    made->job.caller = &made->caller;
}

std::string json_of_result(const reconstruct_context &context) {
    char *text = nullptr;
    size_t bytes = 0;
    FILE *stream = open_memstream(&text, &bytes);
    if (stream == nullptr) {
        throw std::bad_alloc();
    }
    result_json_print(&context, stream);
    std::fclose(stream);
    const std::unique_ptr<char, void (*)(void *)> owner(text, std::free);
    return std::string(text, bytes);
}

int reconstruct(const char *left, const char *right, const vergence_image *const image[2],
                const vergence_calibration *calibration, const char *const *options,
                const vergence_observer *observer, vergence_result **result,
                vergence_error *error) {
    auto made = std::make_unique<vergence_result>();
    std::string text;
    made->program = host_program();
    made->image[0] = image[0];
    made->image[1] = image[1];
    const int refused = read_request(made.get(), left, right, calibration, options, &text);
    if (refused != ERROR_OK) {
        return library_fail(error, refused, text);
    }
    choose_source(made.get(), calibration);
    library_watch watch(observer);
    made->watch = &watch;
    made->ran = true;
    const int code = reconstruct_job_run(&made->job);
    made->watch = nullptr;
    made->image[0] = made->image[1] = nullptr;
    made->source.calibration = nullptr;
    if (code != ERROR_OK) {
        return library_fail(error, code, made->job.message.text);
    }
    made->json = json_of_result(made->job.context);
    *result = made.release();
    return ERROR_OK;
}

}  // namespace

vergence_result::~vergence_result() {
    if (ran) {
        reconstruct_job_end(&job);
    }
}

int vergence_reconstruct(const vergence_image *left, const vergence_image *right,
                         const vergence_calibration *calibration, const char *const *options,
                         const vergence_observer *observer, vergence_result **result,
                         vergence_error *error) {
    return library_guard(error, [&] {
        const vergence_image *const image[2] = {left, right};
        return reconstruct(left->name != nullptr ? left->name : "left",
                           right->name != nullptr ? right->name : "right", image, calibration,
                           options, observer, result, error);
    });
}

int vergence_reconstruct_files(const char *left, const char *right,
                               const vergence_calibration *calibration, const char *const *options,
                               const vergence_observer *observer, vergence_result **result,
                               vergence_error *error) {
    return library_guard(error, [&] {
        const vergence_image *const none[2] = {nullptr, nullptr};
        return reconstruct(left, right, none, calibration, options, observer, result, error);
    });
}

void vergence_result_free(vergence_result *result) {
    delete result;
}

int vergence_result_write(vergence_result *result, const char *directory,
                          const char *const *options, const vergence_observer *observer,
                          vergence_error *error) {
    return library_guard(error, [&] {
        // The words live as long as the request that points into them.
        result->write_words = library_words("reconstruct");
        library_words &words = result->write_words;
        words.add(options);
        for (const char *word : {"--out", directory, "--rectified", "--", "left", "right"}) {
            words.add(word);
        }
        message line{};
        reconstruct_request wanted;
        const int refused = reconstruct_request_read(words.count(), words.values(), &wanted, &line);
        if (refused != ERROR_OK) {
            return library_fail(error, refused, line.text);
        }
        reconstruct_request &request = result->request;
        request.out_path = wanted.out_path;
        request.files = wanted.files;
        request.triangles = wanted.triangles;
        request.error_mm = wanted.error_mm;
        request.compress = wanted.compress;
        request.mesh_unit = wanted.mesh_unit;
        if (result_format_check(request.files, result->program.writers, &line) != ERROR_OK) {
            return library_fail(error, ERROR_ARGUMENT, line.text);
        }
        library_watch watch(observer);
        result->watch = &watch;
        const int code = reconstruct_job_write(&result->job);
        result->watch = nullptr;
        return code == ERROR_OK ? code : library_fail(error, code, result->job.message.text);
    });
}

const char *vergence_result_json(const vergence_result *result) {
    return result->json.c_str();
}

int vergence_result_is_metric(const vergence_result *result) {
    return result->job.context.metric ? 1 : 0;
}

double vergence_result_common_sigma_mm(const vergence_result *result) {
    return result->job.context.depth_sigma_common_mm;
}

const char *vergence_result_note(const vergence_result *result, size_t number) {
    const reconstruct_context &context = result->job.context;
    return number < static_cast<size_t>(context.warning_count) ? context.warnings[number].text
                                                               : nullptr;
}

int vergence_result_calibration(const vergence_result *result, vergence_calibration **calibration,
                                vergence_error *error) {
    return library_guard(error, [&] {
        const reconstruct_context &context = result->job.context;
        *calibration =
            library_calibration(*context.calibration, context.calibration_format, "calibration");
        return static_cast<int>(ERROR_OK);
    });
}
