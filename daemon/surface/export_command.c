// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/export_command.h"

#include <fcntl.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/process.h"
#include "daemon/cli/options.h"
#include "daemon/cli/progress.h"
#include "daemon/files/atomic_dir.h"
#include "daemon/files/output_file.h"
#include "daemon/images/picture.h"
#include "daemon/session/capture_info.h"
#include "daemon/session/session_pairs.h"

enum { LABEL_MAX = 200, NAME_BYTES = 256, PAIRS_MAX = 1000000 };

struct arguments {
    bool png;
    int pair;
    const char *out;
    bool quiet;
    struct export_recording recording;
};

/// The state of one run. Large: static.
struct run {
    struct arguments arguments;
    const char *session;
    char label[LABEL_MAX + 1];  // the session's name, used in file names
    struct session_reader reader;
    struct session_pairs pairs;
    uint32_t first, count;  // first pair and number of pairs
    char (*names)[NAME_BYTES];
    const char **files;  // the same, for atomic_dir_commit
    int file_count;
    struct atomic_dir out;
    struct progress progress;
    bool failed_here;  // the error is not in the session
    struct message message;
};

static const struct command_argument options[] = {
    {.name = "png",
     .kind = COMMAND_FLAG,
     .offset = offsetof(struct arguments, png),
     .help = "As PNG, 8 bits a value, in colour if the camera is. The only format so far, so it "
             "may be left out."},
    {.name = "pair",
     .kind = COMMAND_INTEGER,
     .offset = offsetof(struct arguments, pair),
     .value_name = "N",
     .help = "Export only pair N, from 1. Default: all.",
     .min = 1,
     .max = PAIRS_MAX},
    {.name = "out",
     .kind = COMMAND_TEXT,
     .offset = offsetof(struct arguments, out),
     .value_name = "DIR",
     .help = "Directory for the images; created if missing. Default: the working directory."},
    {.name = "quiet",
     .kind = COMMAND_FLAG,
     .offset = offsetof(struct arguments, quiet),
     .help = "Print only errors."},
    // From here on only where recordings can be written.
    {.name = "mcap",
     .kind = COMMAND_TEXT,
     .offset = offsetof(struct arguments, recording.file),
     .value_name = "FILE",
     .help = "Write one MCAP file of ROS 2 messages instead of images: /left/image_raw and "
             "/left/camera_info, the same of the right camera, /tf (pan, and where the right "
             "camera is) and /diagnostics (axes, exposure). All messages of a pair have the time "
             "of its left frame."},
    {.name = "compressed",
     .kind = COMMAND_FLAG,
     .offset = offsetof(struct arguments, recording.compressed),
     .help = "With --mcap: images as PNG, 8 bits a value, as /left/image_raw/compressed."},
    {.name = "result",
     .kind = COMMAND_TEXT,
     .offset = offsetof(struct arguments, recording.result),
     .value_name = "DIR",
     .help =
         "With --mcap: add the result of a pair, as /disparity and /points (m, from points.pcd)."},
    {.name = "calibration",
     .kind = COMMAND_TEXT,
     .offset = offsetof(struct arguments, recording.calibration),
     .value_name = "FILE",
     .help = "With --mcap: the cameras' calibration. Default: the session's own; without one "
             "camera_info is left out."},
};

enum { RECORDING_OPTIONS = 4 };

static const struct option_page page = {
    .command = "vergence export",
    .operands = "SESSION",
    .summary = "write the pairs of a session for other programs",
    .description =
        "Writes both frames of each pair as SESSION-pair1-left.png and SESSION-pair1-right.png: "
        "demosaiced, with the brightness a reconstruction uses (the square root of light). The "
        "axis positions are in the file, as a comment.\n"
        "All images are written, or none. Images of an earlier export are replaced, other files "
        "are not.\n"
        "Exit code: 0 OK; 1 writing failed; 2 invalid command line; 3 no session, no such pair, or "
        "a damaged one.",
    .examples =
        "vergence export files/scene --png\n"
        "vergence export files/scene --pair 1 --out pictures",
    .options = options,
    .option_count = sizeof options / sizeof options[0],
    .operands_min = 1,
    .operands_max = 1,
};

/// The last part of the session's path as one word, also for a path such as ".".
static void set_label(struct run *self) {
    char *whole = realpath(self->session, NULL);
    const char *path = whole != NULL ? whole : self->session;
    const char *slash = strrchr(path, '/');
    snprintf(self->label, sizeof self->label, "%s", slash != NULL ? slash + 1 : path);
    for (char *at = self->label; *at != '\0'; at++) {
        *at = (unsigned char)*at < ' ' || *at == 0x7F ? '?' : *at;
    }
    free(whole);
}

static int open_session(struct run *self) {
    memset(&self->pairs, 0, sizeof self->pairs);
    return session_reader_open(&self->reader, AT_FDCWD, self->session, NULL, &self->message);
}

/// Determines the pairs that exist and those to export.
static int choose_pairs(struct run *self) {
    const uint32_t wanted = (uint32_t)self->arguments.pair;
    int error = open_session(self);
    if (error != ERROR_OK) {
        return error;
    }
    error = session_pairs_find(&self->pairs, &self->reader, wanted, &self->message);
    if (error == ERROR_OK && self->reader.cut) {
        fprintf(
            stderr,
            "vergence: note: %s was cut off or is still being written: there may be more pairs\n",
            self->session);
    }
    session_reader_close(&self->reader);
    self->first = wanted != 0 ? wanted : 1;
    self->count = wanted != 0 ? 1 : self->pairs.count;
    return error;
}

static int make_names(struct run *self) {
    static const char *const sides[RIG_SIDES] = {"left", "right"};
    self->names = calloc((size_t)self->count * RIG_SIDES, sizeof *self->names);
    self->files = calloc((size_t)self->count * RIG_SIDES, sizeof *self->files);
    if (self->names == NULL || self->files == NULL) {
        return message_set(&self->message, ERROR_MEMORY, "out of memory");
    }
    for (uint32_t i = 0; i < self->count * RIG_SIDES; i++) {
        snprintf(self->names[i], NAME_BYTES, "%s-pair%u-%s.png", self->label,
                 (unsigned)(self->first + i / RIG_SIDES), sides[i % RIG_SIDES]);
        self->files[i] = self->names[i];
    }
    return ERROR_OK;
}

/// Checks that a file of this name may be written: it does not exist, or has an export's picture
/// (own_listing.h names it, but its contents may have been replaced).
static int check_name(struct run *self, const char *name) {
    char path[ATOMIC_DIR_PATH_BYTES];
    struct stat about;
    uint8_t head[PICTURE_HEAD_BYTES];
    const int length = snprintf(path, sizeof path, "%s/%s", self->arguments.out, name);
    if (length < 0 || length >= (int)sizeof path || lstat(path, &about) != 0) {
        return ERROR_OK;  // other errors show when it is written
    }
    const int fd = S_ISREG(about.st_mode) ? open(path, O_RDONLY | O_NOFOLLOW | O_CLOEXEC) : -1;
    const ssize_t bytes = fd >= 0 ? read(fd, head, sizeof head) : 0;
    if (fd >= 0) {
        close(fd);
    }
    return bytes > 0 && picture_png_is_ours(head, (size_t)bytes)
               ? ERROR_OK
               : message_set(&self->message, ERROR_ARGUMENT,
                             "%s exists and was not written by vergence export (move it, or give "
                             "another --out)",
                             path);
}

/// Reads, develops and encodes a frame. The caller frees `*png`.
static int make_png(struct run *self, int side, const struct develop_balance *balance,
                    const struct raw_image *frame, uint8_t **png, size_t *bytes) {
    char text[2 * CAPTURE_INFO_BYTES], line[CAPTURE_INFO_BYTES];
    const struct capture_info info = {self->label, &self->pairs.pair.pair,
                                      self->pairs.has_instrument ? &self->pairs.instrument : NULL};
    struct picture picture = {.width_px = frame->width_px,
                              .height_px = frame->height_px,
                              .channels = frame->layout == RAW_GREY ? 1 : 3,
                              .text = text};
    capture_info_line(&info, 0, line);
    snprintf(text, sizeof text, "%s\n", line);
    capture_info_line(&info, 1 + side, line);
    strcat(text, line);
    for (char *at = text; *at != '\0'; at++) {
        *at = (unsigned char)*at >= 0x7F ? '?' : *at;
    }
    picture.row_bytes = (size_t)picture.width_px * (size_t)picture.channels;
    picture.pixels = malloc(picture.row_bytes * (size_t)picture.height_px);
    int error =
        picture.pixels != NULL ? picture_develop(frame, balance, 1, &picture) : ERROR_MEMORY;
    *png = error == ERROR_OK ? picture_png(&picture, bytes) : NULL;
    free(picture.pixels);
    if (error == ERROR_ARGUMENT) {
        return message_set(&self->message, error, "%s: pair %u: unsupported frame depth: %d bits",
                           self->session, (unsigned)self->pairs.count, frame->bits);
    }
    return *png != NULL
               ? ERROR_OK
               : message_set(&self->message, ERROR_MEMORY, "%s: out of memory", self->session);
}

static int write_png(struct run *self, const char *name, const uint8_t *png, size_t bytes) {
    char path[ATOMIC_DIR_PATH_BYTES];
    struct output_file file;
    atomic_dir_file_path(&self->out, name, path);
    output_file_open(&file, path);
    if (file.stream != NULL) {
        output_file_write(&file, png, bytes);
    }
    const int error = output_file_close(&file, &self->message);
    self->failed_here = error != ERROR_OK;
    atomic_dir_name_final(&self->out, &self->message);
    return error;
}

/// Exports the pair found last. Both frames use the white balance of the left one, as in a
/// reconstruction.
static int export_pair(struct run *self) {
    struct develop_balance balance = {{0, 0, 0}};
    int error = ERROR_OK;
    for (int side = 0; error == ERROR_OK && side < RIG_SIDES; side++) {
        struct raw_image image = self->pairs.pair.pair.frame[side].image;
        uint8_t *png = NULL;
        size_t bytes = 0;
        error = session_reader_load(&self->reader, &image, self->pairs.pair.frame_crc[side],
                                    &self->message);
        if (error == ERROR_OK && side == RIG_LEFT) {
            balance = develop_balance_of(&image);
        }
        if (error == ERROR_OK) {
            error = make_png(self, side, &balance, &image, &png, &bytes);
        }
        raw_image_release(&image);
        if (error == ERROR_OK) {
            error = write_png(self, self->names[self->file_count++], png, bytes);
        }
        free(png);
        progress_show(&self->progress, 0, "exporting", self->file_count,
                      (int)self->count * RIG_SIDES);
    }
    return error;
}

static int export_pairs(struct run *self) {
    int error = open_session(self);
    if (error != ERROR_OK) {
        return error;
    }
    while (error == ERROR_OK && self->pairs.count + 1 < self->first + self->count) {
        const int got = session_pairs_next(&self->pairs, &self->reader, &self->message);
        if (got != 1) {
            error = got != 0 ? got
                             : message_set(&self->message, ERROR_MISSING,
                                           "%s: changed during the export", self->session);
        } else if (self->pairs.count >= self->first) {
            error = export_pair(self);
        }
    }
    session_reader_close(&self->reader);
    return error;
}

static int export_session(struct run *self) {
    const double work = 1;
    int error = choose_pairs(self);
    error = error != ERROR_OK ? error : make_names(self);
    for (uint32_t i = 0; error == ERROR_OK && i < self->count * RIG_SIDES; i++) {
        error = check_name(self, self->names[i]);
    }
    if (error != ERROR_OK) {
        return error;
    }
    self->failed_here = true;
    if (session_pairs_here(self->arguments.out)) {
        return message_set(&self->message, ERROR_BUFFER,
                           "%s: is a session, which pictures do not belong into (name another "
                           "directory)",
                           self->arguments.out);
    }
    error = atomic_dir_begin(&self->out, self->arguments.out, self->files,
                             (int)self->count * RIG_SIDES, &self->message);
    if (error != ERROR_OK) {
        return error;
    }
    self->failed_here = false;
    progress_begin(&self->progress, self->arguments.quiet);
    progress_expect(&self->progress, &work, 1);
    error = export_pairs(self);
    progress_end(&self->progress);
    if (error != ERROR_OK) {
        atomic_dir_abort(&self->out);
        return error;
    }
    self->failed_here = true;
    return atomic_dir_commit(&self->out, self->files, self->file_count,
                             self->files[self->file_count - 1], &self->message);
}

static int exit_code_of(const struct run *self, int error) {
    if (self->failed_here && error != ERROR_CANCELLED) {
        return CLIENT_FAILED;
    }
    return options_exit_code(error);
}

/// Whether options are given that exclude each other, with one line about it.
static bool options_conflict(const struct arguments *asked) {
    const struct export_recording *file = &asked->recording;
    const char *wrong = NULL;
    if (file->file != NULL && (asked->png || strcmp(asked->out, ".") != 0)) {
        wrong = "--mcap FILE excludes --png and --out";
    } else if (file->file == NULL && (file->compressed || file->result || file->calibration)) {
        wrong = "--compressed, --result and --calibration need --mcap FILE";
    }
    if (wrong != NULL) {
        fprintf(stderr, "vergence export: %s\n", wrong);
    }
    return wrong != NULL;
}

static int export_as_recording(struct run *self, export_recording_writer *write) {
    struct export_recording *request = &self->arguments.recording;
    request->session = self->session;
    request->pair = (uint32_t)self->arguments.pair;
    request->quiet = self->arguments.quiet;
    struct message why;
    const int exit_code = write(request, &why);
    if (exit_code != CLIENT_OK) {
        fprintf(stderr, "vergence export: %s\n", why.text);
    } else if (!request->quiet) {
        printf("written: %s\n", request->file);
    }
    return exit_code;
}

static int export_as_images(struct run *self) {
    set_label(self);
    const int error = export_session(self);
    if (error != ERROR_OK) {
        fprintf(stderr, "vergence export: %s\n", self->message.text);
    }
    const bool here = strcmp(self->arguments.out, ".") == 0;
    for (int i = 0; error == ERROR_OK && !self->arguments.quiet && i < self->file_count; i++) {
        printf("written: %s%s%s\n", here ? "" : self->arguments.out, here ? "" : "/",
               self->files[i]);
    }
    free(self->names);
    free(self->files);
    return error == ERROR_OK ? CLIENT_OK : exit_code_of(self, error);
}

int export_command_run(int argc, char **argv, export_recording_writer *write_recording) {
    static struct run self;
    struct option_page shown = page;
    int count = 0;
    if (write_recording == NULL) {
        shown.option_count -= RECORDING_OPTIONS;
    }
    self = (struct run){.arguments = {.out = "."}};
    const int exit_code = options_parse(&shown, argc, argv, &self.arguments, &self.session, &count);
    if (exit_code != OPTIONS_CONTINUE) {
        return exit_code;
    }
    if (options_conflict(&self.arguments)) {
        return CLIENT_USAGE;
    }
    interrupt_catch();
    if (self.arguments.recording.file != NULL) {
        return export_as_recording(&self, write_recording);
    }
    return export_as_images(&self);
}
