// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <cstring>
#include <iostream>

#include "daemon/base/message.h"
#include "daemon/base/process.h"
#include "daemon/cli/options.h"
#include "daemon/cli/progress.h"
#include "tools/host/calibrate/calibrate_request.hpp"
#include "tools/host/commands/commands.hpp"

namespace {

void print_line(const char *begin, const std::string &text) {
    message line{};
    message_set(&line, 0, "%s", text.c_str());
    std::fprintf(stderr, "%s: %s\n", begin, line.text);
}

void print_outcome(const calibrate_outcome &outcome, const calibrate_output &output) {
    for (size_t i = 0; i < outcome.notes.size() && !output.quiet; i++) {
        print_line("vergence: note", outcome.notes[i]);
    }
    if (output.json) {
        std::cout << outcome.json;
    } else if (!output.quiet) {
        std::cout << outcome.text;
    }
    std::cout.flush();
    if (outcome.code != CLIENT_OK) {
        print_line("vergence calibrate", outcome.message);
    }
}

}  // namespace

int command_calibrate(int argc, char **argv) {
    if (argc > 1 && std::strcmp(argv[1], "capture") == 0) {
        return command_capture(argc - 1, argv + 1);
    }
    calibrate_job job;
    calibrate_output output{};
    std::string message;
    const int parsed = calibrate_request_parse(argc, argv, &job, &output, &message);
    if (parsed != OPTIONS_CONTINUE) {
        if (!message.empty()) {
            print_line("vergence calibrate", message);
        }
        return parsed;
    }
    progress bar{};
    job.expect = [&bar](const double *work, int stages) { progress_expect(&bar, work, stages); };
    job.progress = [&bar](int stage, const char *what, int done, int total) {
        progress_show(&bar, stage, what, done, total);
    };
    interrupt_catch();
    progress_begin(&bar, output.quiet);
    const calibrate_outcome outcome = calibrate_job_run(job);
    progress_end(&bar);
    print_outcome(outcome, output);
    return outcome.interrupted ? interrupt_exit_code() : outcome.code;
}
