// SPDX-License-Identifier: Apache-2.0
#include "tools/host/view/view_results.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "daemon/files/standard_paths.h"
#include "tools/host/formats/whole_file.hpp"
#include "tools/host/view/view_source.hpp"
#include "tools/host/view/view_webcams.hpp"

namespace {

constexpr std::size_t result_max_bytes = std::size_t{1} << 30;

/// A name of a session or a file without a path.
bool is_name(const std::string &name) {
    return !name.empty() && name[0] != '.' && name[0] != '-' && name.size() < 200 &&
           name.find_first_not_of(
               "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789"
               "-_.+=,@") == std::string::npos;
}

bool ends_with(const std::string &text, const std::string &end) {
    return text.size() >= end.size() &&
           text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// The command line of the reconstruction of what is `here`.
std::vector<std::string> words_of(const view_settings &settings, const std::string &here,
                                  const std::string &pair, const std::string &surface) {
    std::vector<std::string> words = {"vergence", "reconstruct", here, "--out", surface, "--quiet"};
    if (!pair.empty()) {
        words.insert(words.end(), {"--pair", pair});
    }
    if (!settings.calibration.empty()) {
        words.insert(words.end(), {"--calibration", settings.calibration});
    }
    if (settings.far_mm > 0) {
        words.insert(words.end(), {"--near", std::to_string(settings.near_mm), "--far",
                                   std::to_string(settings.far_mm)});
    }
    return words;
}

const char *type_of(const std::string &name) {
    if (ends_with(name, ".svg")) {
        return "image/svg+xml";
    }
    return ends_with(name, ".png") ? "image/png" : "text/plain; charset=utf-8";
}

std::string last_line(std::string text) {
    text.erase(text.find_last_not_of('\n') + 1);
    return text.substr(text.rfind('\n') + 1);
}

}  // namespace

bool view_results_make_folder(const std::string &path, std::string *error) {
    standard_paths_make_parent(path.c_str(), 0777);
    struct stat status {};
    if ((mkdir(path.c_str(), 0777) != 0 && errno != EEXIST) || stat(path.c_str(), &status) != 0) {
        *error = path + ": cannot be created: " + std::strerror(errno);
    } else if (!S_ISDIR(status.st_mode)) {
        *error = path + ": exists and is not a directory (give another name, --out)";
    } else if (faccessat(AT_FDCWD, path.c_str(), W_OK | X_OK, AT_EACCESS) != 0) {
        *error = path + ": cannot be written: " + std::strerror(errno);
    }
    return error->empty();
}

std::string view_result_fetch(view_source *source, const view_settings &settings,
                              const std::string &name, std::string *error) {
    if (!is_name(name)) {
        *error = "not the name of a session";
        return "";
    }
    return view_results_make_folder(settings.out, error) ? source->fetch(name, settings.out, error)
                                                         : "";
}

int view_result_run(std::vector<std::string> words, std::string *command, std::string *said) {
    for (const std::string &word : words) {
        *command += (command->empty() ? "" : " ") + word;
    }
    words[0] = view_program(nullptr, 0);
    std::string output;
    const int code = view_run_program(words.data(), words.size(), &output);
    *said = last_line(output);
    return code;
}

std::string view_surface_make(view_source *source, const view_settings &settings,
                              const std::string &session) {
    std::string error;
    const std::string here = view_result_fetch(source, settings, session, &error);
    if (here.empty()) {
        return view_failed("IO", error);
    }
    const std::string name = "surface-" + (source->is_live() ? session : "pair" + session);
    std::string command;
    std::string said;
    const int code = view_result_run(
        words_of(settings, here, source->is_live() ? "" : session, settings.out + "/" + name),
        &command, &said);
    if (code != 0) {
        return view_failed("FAILED", said);
    }
    return nlohmann::json{{"ok", true}, {"report", "out/" + name}, {"command", command}}.dump();
}

bool view_result_read(view_source *source, const view_settings &settings, const std::string &path,
                      view_result *result, std::string *error) {
    const std::size_t slash = path.find('/');
    const std::string name = slash != std::string::npos ? path.substr(slash + 1) : "";
    *error = "no such file";
    if (!is_name(name)) {
        return false;
    }
    if (path.compare(0, slash, "out") == 0) {
        result->type = "text/html; charset=utf-8";
        result->ours = true;
        const char *const page = name == "calibrated" ? "/calibration.html" : "/report.html";
        return whole_file_read(settings.out + "/" + name + page, result_max_bytes, "a report",
                               &result->content, error) == 0;
    }
    if (path.compare(0, slash, "file") != 0 || !source->is_live() ||
        !view_results_make_folder(settings.out, error)) {
        return false;
    }
    result->type = type_of(name);
    const std::string local = source->fetch(name, settings.out, error);
    return !local.empty() &&
           whole_file_read(local, result_max_bytes, "a file", &result->content, error) == 0;
}
