// SPDX-License-Identifier: Apache-2.0
// The client's `reconstruct` for Linux on the Blackfin. Without --out it writes surface.compact to
// standard output: the simulator's user mode has files, but makes no directories.
#include <stdio.h>
#include <string.h>
#include <sys/time.h>
#include <time.h>

#include "core/error.h"
#include "daemon/surface/reconstruct_command.h"
#include "daemon/surface/reconstruct_job.h"

/// In place of the C library's: the simulator has no other clock.
int clock_gettime(clockid_t clock, struct timespec *now) {
    struct timeval time;
    (void)clock;
    const int error = gettimeofday(&time, NULL);
    *now = (struct timespec){.tv_sec = time.tv_sec, .tv_nsec = time.tv_usec * 1000};
    return error;
}

static void put(void *self, const void *bytes, size_t length) {
    fwrite(bytes, 1, length, self);
}

static void show_nothing(void *self, int stage, const char *what, int done, int total) {
    (void)self;
    (void)stage;
    (void)what;
    (void)done;
    (void)total;
}

static int write_surface(int argc, char **argv) {
    struct reconstruct_request request;
    struct message message;
    struct reconstruct_source source = {.program = &reconstruct_program_system};
    const struct output_sink sink = {put, stdout};
    const struct reconstruct_caller caller = {.scale = "--scale",
                                              .smaller = "--scale or --region",
                                              .depth = "--near and --far",
                                              .search = "--near and --far, or --disparity",
                                              .accept = "--accept-mismatch",
                                              .read = reconstruct_inputs_read,
                                              .source = &source,
                                              .progress = show_nothing};
    struct reconstruct_job job = {.program = &reconstruct_program_system,
                                  .request = &request,
                                  .caller = &caller,
                                  .sink = &sink};
    int error = reconstruct_request_read(argc, argv, &request, &message);
    if (error == ERROR_OK) {
        error = reconstruct_job_run(&job);
        message = job.message;
        reconstruct_job_end(&job);
    }
    if (error != ERROR_OK || fflush(stdout) != 0) {
        fprintf(stderr, "vergence-reconstruct: %s\n",
                error != ERROR_OK ? message.text : "cannot write");
        return 1;
    }
    return 0;
}

int main(int argc, char **argv) {
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--out") == 0 || strcmp(argv[i], "--help") == 0) {
            return reconstruct_command_run(&reconstruct_program_system, argc, argv);
        }
    }
    return write_surface(argc, argv);
}
