// SPDX-License-Identifier: Apache-2.0
/// The pairs of many sessions and the table of their results, for a program that distributes the
/// work: the rows and files of `vergence reconstruct --all`.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "daemon/files/atomic_dir.h"
#include "daemon/files/file_io.h"
#include "daemon/surface/reconstruct_all.h"
#include "daemon/surface/result/result_format.h"
#include "library/internal.hpp"
#include "tools/host/program/host_program.hpp"

struct vergence_pairs {
    vergence_pairs() = default;
    vergence_pairs(const vergence_pairs &) = delete;
    vergence_pairs &operator=(const vergence_pairs &) = delete;
    ~vergence_pairs() { pairs_table_free(&table); }

    library_words words{"reconstruct"};
    reconstruct_request request{};  // points into the words
    pairs_table table{};
};

namespace {

int list(const char *const *paths, const char *directory, const vergence_calibration *calibration,
         const char *const *options, vergence_pairs **pairs, vergence_error *error) {
    auto made = std::make_unique<vergence_pairs>();
    int count = 0;
    while (paths[count] != nullptr) {
        count++;
    }
    if (count == 0) {
        return library_fail(error, ERROR_ARGUMENT, "no sessions are given");
    }
    made->words.add(options);
    for (const char *word : {"--all", "--out", directory, "--", paths[0]}) {
        made->words.add(word);
    }
    message line{};
    int code =
        reconstruct_request_read(made->words.count(), made->words.values(), &made->request, &line);
    if (code == ERROR_OK &&
        result_format_check(made->request.files, host_program().writers, &line) != ERROR_OK) {
        code = ERROR_ARGUMENT;
    }
    const std::string more = calibration == nullptr ? "" : " with " + calibration->text;
    if (code == ERROR_OK) {
        code =
            reconstruct_all_begin(&made->request, paths, count, more.c_str(), &made->table, &line);
    }
    if (code != ERROR_OK) {
        return library_fail(error, code, line.text);
    }
    *pairs = made.release();
    return ERROR_OK;
}

int write_file(const atomic_dir &directory, const vergence_file &file, message *line) {
    char path[ATOMIC_DIR_PATH_BYTES];
    atomic_dir_file_path(&directory, file.name, path);
    FILE *stream = std::fopen(path, "wbe");
    const bool written =
        stream != nullptr && std::fwrite(file.data, 1, file.bytes, stream) == file.bytes;
    const bool closed = stream != nullptr && std::fclose(stream) == 0;
    if (written && closed) {
        return ERROR_OK;
    }
    return message_set(line, file_error_is_full(errno) ? ERROR_FULL : ERROR_BUFFER,
                       "writing %s/%s failed: %s", directory.final_path, file.name,
                       std::strerror(errno));
}

bool is_result(const char *name) {
    for (const result_format &format : result_formats) {
        if (std::string(format.file_name) == name) {
            return true;
        }
    }
    return false;
}

int store(const std::string &path, const vergence_file *files, size_t count, message *line) {
    std::vector<const char *> names, all;
    for (size_t i = 0; i < count; i++) {
        if (!is_result(files[i].name)) {
            return message_set(line, ERROR_ARGUMENT, "%s: not a file of a result", files[i].name);
        }
        names.push_back(files[i].name);
    }
    for (const result_format &format : result_formats) {
        all.push_back(format.file_name);
    }
    atomic_dir directory{};
    directory.lock_fd = -1;
    int code =
        atomic_dir_begin(&directory, path.c_str(), names.data(), static_cast<int>(count), line);
    for (size_t i = 0; i < count && code == ERROR_OK; i++) {
        code = write_file(directory, files[i], line);
    }
    if (code == ERROR_OK) {
        code = atomic_dir_commit(&directory, all.data(), RESULT_FORMATS, all.back(), line);
    }
    atomic_dir_abort(&directory);
    return code;
}

}  // namespace

int vergence_pairs_list(const char *const *paths, const char *directory,
                        const vergence_calibration *calibration, const char *const *options,
                        vergence_pairs **pairs, vergence_error *error) {
    return library_guard(
        error, [&] { return list(paths, directory, calibration, options, pairs, error); });
}

void vergence_pairs_free(vergence_pairs *pairs) {
    delete pairs;
}

size_t vergence_pairs_count(const vergence_pairs *pairs) {
    return static_cast<size_t>(pairs->table.count);
}

void vergence_pairs_get(const vergence_pairs *pairs, size_t number, vergence_pair *pair) {
    const pairs_row &row = pairs->table.rows[number];
    *pair = {row.session,      static_cast<int>(row.number),
             row.name,         row.done ? 1 : 0,
             row.kept ? 1 : 0, row.error != ERROR_OK ? row.message.text : nullptr,
             row.points,       row.notes,
             row.depth_mm,     row.sigma_mm,
             row.seconds};
}

int vergence_pairs_set(vergence_pairs *pairs, size_t number, const vergence_pair *pair,
                       vergence_error *error) {
    return library_guard(error, [&] {
        pairs_row &row = pairs->table.rows[number];
        row.kept = false;
        row.done = pair->done != 0;
        row.error = pair->error != nullptr ? message_set(&row.message, ERROR_IO, "%s", pair->error)
                                           : static_cast<int>(ERROR_OK);
        row.points = static_cast<uint32_t>(pair->points);
        row.notes = pair->notes;
        row.depth_mm = pair->depth_mm;
        row.sigma_mm = pair->sigma_mm;
        row.seconds = pair->seconds;
        message line{};
        const int code = pairs_table_save(&pairs->table, pairs->request.out_path, &line);
        return code == ERROR_OK ? code : library_fail(error, code, line.text);
    });
}

int vergence_pairs_store(const vergence_pairs *pairs, size_t number, const vergence_file *files,
                         size_t count, vergence_error *error) {
    return library_guard(error, [&] {
        message line{};
        const std::string path =
            std::string(pairs->request.out_path) + "/" + pairs->table.rows[number].name;
        const int code = store(path, files, count, &line);
        return code == ERROR_OK ? code : library_fail(error, code, line.text);
    });
}
