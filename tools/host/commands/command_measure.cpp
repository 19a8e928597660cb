// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "core/error.h"
#include "daemon/cli/options.h"
#include "daemon/session/session_notes.h"
#include "daemon/surface/reconstruct_request.h"
#include "tools/host/commands/commands.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

/// Options of `reconstruct` that a session of `measure` decides, or that are for pictures.
const char *const decided[] = {"pair",  "with-pair", "disparity",   "rectified",
                               "focal", "baseline",  "unit",        "bayer",
                               "bits",  "raw",       "first-camera"};

std::vector<command_argument> options_of() {
    std::vector<command_argument> options;
    for (std::size_t i = 0; i < reconstruct_argument_count; i++) {
        const char *name = reconstruct_arguments[i].name;
        if (std::none_of(std::begin(decided), std::end(decided),
                         [&](const char *one) { return std::strcmp(one, name) == 0; })) {
            options.push_back(reconstruct_arguments[i]);
        }
    }
    return options;
}

const char description[] =
    "Makes the surface of a measurement that \"measure\" took at an instrument (\"vergence "
    "--connect ADDRESS measure NAME\" also fetches it): the same points, with the options that the "
    "instrument used, and a report that lists its decisions. SESSION may be a recording of it.\n"
    "Options are those of \"vergence reconstruct\" and replace the instrument's. The results are "
    "in SESSION-surface, in the working directory, unless --out names another.\n"
    "Exit codes: as of \"vergence reconstruct\"; 3 also for a session that was not taken by "
    "measure.";

int refuse(int code, const std::string &text) {
    message line{};
    message_set(&line, 0, "%s", text.c_str());
    std::fprintf(stderr, "vergence measure: %s\n", line.text);
    return code;
}

/// Adds the instrument's words ("pair=3 near=1568.000") as options of the command line. A session
/// may come from anywhere: only options that decide the surface are taken. False: another one.
bool add_noted(const char *words, std::vector<std::string> *line) {
    std::istringstream stream(words);
    for (std::string word; stream >> word;) {
        const std::size_t equals = word.find('=');
        const std::string name = word.substr(0, equals);
        const std::string value = equals == std::string::npos ? "yes" : word.substr(equals + 1);
        const command_argument *const end = reconstruct_arguments + RECONSTRUCT_SHARED;
        const command_argument *option =
            std::find_if(reconstruct_arguments, end,
                         [&](const command_argument &one) { return name == one.name; });
        if (option == end) {
            return false;
        }
        if (option->kind != COMMAND_FLAG) {
            line->insert(line->end(), {"--" + name, value});
        } else if (value == "yes") {
            line->push_back("--" + name);
        }
    }
    return true;
}

std::string out_of(std::string session) {
    while (session.size() > 1 && session.back() == '/') {
        session.pop_back();
    }
    return report_text_file_name(session) + "-surface";
}

}  // namespace

int command_measure(int argc, char **argv, int (*reconstruct)(int argc, char **argv)) {
    const std::vector<command_argument> options = options_of();
    const option_page page = {"vergence measure",
                              "SESSION",
                              "make the surface of a measurement of an instrument",
                              description,
                              "vergence measure cylinder\n"
                              "vergence measure cylinder --out fine --preset best",
                              options.data(),
                              static_cast<unsigned>(options.size()),
                              1,
                              1};
    reconstruct_request asked = reconstruct_request_defaults();
    const char *session = nullptr;
    int count = 0;
    const int parsed = options_parse(&page, argc, argv, &asked, &session, &count);
    if (parsed != OPTIONS_CONTINUE) {
        return parsed;
    }
    const auto notes = std::make_unique<session_notes>();
    message why{};
    const int got = session_notes_read(AT_FDCWD, session, notes.get(), &why);
    if (got <= 0) {
        return refuse(CLIENT_BAD_INPUT,
                      got < 0 ? why.text
                              : std::string(session) +
                                    ": was not taken by measure: use vergence reconstruct");
    }
    if (notes->surface[0] == '\0') {
        return refuse(CLIENT_BAD_INPUT, std::string(session) +
                                            ": measure ended before its surface: use vergence "
                                            "reconstruct for its pairs");
    }
    std::vector<std::string> line = {"reconstruct", session, "--out", out_of(session)};
    if (!add_noted(notes->surface, &line)) {
        return refuse(CLIENT_BAD_INPUT, std::string(session) +
                                            ": taken by another version of measure (\"" +
                                            notes->surface + "\"): use vergence reconstruct");
    }
    for (int i = 1; i < argc; i++) {
        if (argv[i] != session) {
            line.emplace_back(argv[i]);
        }
    }
    std::vector<char *> words;
    for (std::string &word : line) {
        words.push_back(&word[0]);
    }
    words.push_back(nullptr);
    return reconstruct(static_cast<int>(words.size()) - 1, words.data());
}
