// SPDX-License-Identifier: Apache-2.0
#include "fake_script.h"

#include <errno.h>
#include <linux/videodev2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fake_file.h"
#include "fake_gpio.h"
#include "fake_i2c.h"
#include "fake_kernel.h"
#include "fake_mtd.h"
#include "fake_picture.h"
#include "fake_video.h"
#include "fake_watchdog.h"

enum { VIDEOS = 4, LINE_BYTES = 1024, WORD_BYTES = 256 };

static void stop(const char *line) {
    fprintf(stderr, "fake kernel: VERGENCE_FAKE_KERNEL: this line is wrong: %s\n", line);
    abort();
}

static uint32_t fourcc_named(const char *name) {
    static const struct {
        const char *name;
        uint32_t fourcc;
    } formats[] = {{"GREY", V4L2_PIX_FMT_GREY},
                   {"YUYV", V4L2_PIX_FMT_YUYV},
                   {"SGRBG10", V4L2_PIX_FMT_SGRBG10},
                   {"MJPEG", V4L2_PIX_FMT_MJPEG}};
    for (size_t i = 0; i < sizeof formats / sizeof formats[0]; i++) {
        if (strcmp(formats[i].name, name) == 0) {
            return formats[i].fourcc;
        }
    }
    return 0;
}

static int errno_named(const char *name) {
    static const struct {
        const char *name;
        int number;
    } errors[] = {{"EIO", EIO},       {"ENODEV", ENODEV}, {"ENOSPC", ENOSPC},
                  {"EROFS", EROFS},   {"EDQUOT", EDQUOT}, {"EBUSY", EBUSY},
                  {"EINTR", EINTR},   {"EAGAIN", EAGAIN}, {"ETIMEDOUT", ETIMEDOUT},
                  {"ENXIO", ENXIO},   {"ENOMEM", ENOMEM}, {"EINVAL", EINVAL},
                  {"EACCES", EACCES}, {"EPIPE", EPIPE}};
    for (size_t i = 0; i < sizeof errors / sizeof errors[0]; i++) {
        if (strcmp(errors[i].name, name) == 0) {
            return errors[i].number;
        }
    }
    return atoi(name);
}

static void add_video(const char *line, const char *rest) {
    // Kept for the lifetime of the program.
    static char pictures[VIDEOS][WORD_BYTES];
    static unsigned count;
    char path[WORD_BYTES], format[WORD_BYTES];
    unsigned frame_us = 0;
    uint32_t width_px = 0, height_px = 0;
    const int words = count == VIDEOS ? 0
                                      : sscanf(rest, "%255s %255s %255s %u %ux%u", path, format,
                                               pictures[count], &frame_us, &width_px, &height_px);
    const uint32_t fourcc = words >= 4 ? fourcc_named(format) : 0;
    if (fourcc == 0 || frame_us == 0 || (words != 6 && fourcc == V4L2_PIX_FMT_MJPEG)) {
        stop(line);
    }
    if (words != 6) {
        fake_picture_size(pictures[count], &width_px, &height_px);
    }
    struct fake_video *video = fake_video_add(path, fourcc, width_px, height_px);
    video->picture = pictures[count++];
    video->frame_us = video->first_us = frame_us;
    video->controls[0] = (struct fake_video_control){V4L2_CID_EXPOSURE_AUTO, 0, 3, 1, 3};
    video->controls[1] = (struct fake_video_control){V4L2_CID_EXPOSURE_ABSOLUTE, 1, 5000, 1, 100};
    video->controls[2] = (struct fake_video_control){V4L2_CID_GAIN, 0, 255, 1, 0};
    video->controls[3] = (struct fake_video_control){V4L2_CID_FOCUS_AUTO, 0, 1, 1, 1};
    video->controls[4] = (struct fake_video_control){V4L2_CID_FOCUS_ABSOLUTE, 0, 250, 5, 50};
    video->controls[5] = (struct fake_video_control){V4L2_CID_AUTO_WHITE_BALANCE, 0, 1, 1, 1};
}

static void add_failure(const char *line, const char *rest) {
    unsigned nth = 0, times = 0;
    char name[WORD_BYTES];
    int at = 0;
    if (sscanf(rest, "%u %u %255s %n", &nth, &times, name, &at) != 3 || nth == 0 || at == 0 ||
        errno_named(name) <= 0) {
        stop(line);
    }
    fake_kernel_fail(rest + at, nth, errno_named(name), times);
}

static void add_end(const char *line, const char *rest,
                    void (*add)(const char *what, unsigned nth)) {
    unsigned nth = 0;
    int at = 0;
    if (sscanf(rest, "%u %n", &nth, &at) != 1 || nth == 0 || at == 0) {
        stop(line);
    }
    add(rest + at, nth);
}

static void add_i2c(const char *line, const char *rest) {
    char path[WORD_BYTES];
    unsigned address = 0;
    if (sscanf(rest, "%255s %i", path, (int *)&address) != 2 || address > 0x7F) {
        stop(line);
    }
    fake_i2c_add(path, (uint8_t)address);
}

static void add_watchdog(const char *line, const char *rest) {
    char path[WORD_BYTES];
    int max_s = 0;
    const int words = sscanf(rest, "%255s %d", path, &max_s);
    if (words < 1 || (words == 2 && max_s < 1)) {
        stop(line);
    }
    struct fake_watchdog *device = fake_watchdog_add(path);
    if (words == 2) {
        device->min_s = 1;
        device->max_s = device->period_s = max_s;
    }
}

static void add_mtd(const char *line, const char *rest) {
    char name[WORD_BYTES], file[WORD_BYTES], word[WORD_BYTES] = "";
    unsigned block_bytes = 0;
    if (sscanf(rest, "%255s %255s %u %255s", name, file, &block_bytes, word) < 3) {
        stop(line);
    }
    struct fake_mtd *partition = fake_mtd_add(name, file, block_bytes);
    if (partition == NULL) {
        stop(line);
        return;
    }
    partition->worn = strcmp(word, "worn") == 0;
}

static void set_video(const char *line, const char *rest) {
    char path[WORD_BYTES], key[WORD_BYTES];
    unsigned value = 0;
    struct fake_device *device = NULL;
    if (sscanf(rest, "%255s %255s %u", path, key, &value) == 3) {
        device = fake_file_device_at(path);
    }
    struct fake_video *video = device == NULL ? NULL : device->state;
    if (video == NULL) {
        stop(line);
    } else if (strcmp(key, "first_us") == 0) {
        video->first_us = value;
    } else if (strcmp(key, "phase_us") == 0) {
        video->phase_us = (int32_t)value;
    } else if (strcmp(key, "damage_every") == 0) {
        video->damage_every = value;
    } else if (strcmp(key, "lose_every") == 0) {
        video->lose_every = value;
    } else if (strcmp(key, "readout_us") == 0) {
        video->readout_us = value;
    } else if (strcmp(key, "bright_at") == 0) {
        video->bright_at = value;
    } else {
        stop(line);
    }
}

/// Connections from the chip's wires to the cameras' trigger inputs.
static struct {
    unsigned wire;
    struct fake_video *camera;
} inputs[VIDEOS];
static unsigned input_count;

/// Triggers the cameras when the wire goes high.
static void drive_inputs(struct fake_gpio *chip, unsigned wire) {
    for (unsigned i = 0; i < input_count; i++) {
        if (inputs[i].wire == wire && chip->wire[wire]) {
            fake_video_pulse(inputs[i].camera);
        }
    }
}

static void add_trigger(const char *line, const char *rest, struct fake_gpio *chip) {
    char path[WORD_BYTES];
    unsigned wire = 0;
    const int words = sscanf(rest, "%255s %u", path, &wire);
    const struct fake_device *device = words < 1 ? NULL : fake_file_device_at(path);
    if (device == NULL || input_count == VIDEOS ||
        (words == 2 && (chip == NULL || wire >= FAKE_GPIO_LINES))) {
        stop(line);
        return;
    }
    struct fake_video *camera = device->state;
    camera->triggered = true;
    if (words == 2) {
        inputs[input_count].wire = wire;
        inputs[input_count++].camera = camera;
        chip->drive = drive_inputs;
    }
}

static void set_plug(const char *line, const char *rest) {
    char path[WORD_BYTES];
    int at = 0;
    if (sscanf(rest, "%255s %n", path, &at) != 1 || at == 0 || rest[at] == '\0' ||
        !fake_kernel_plug(path, rest + at)) {
        stop(line);
    }
}

static void follow(const char *line) {
    static struct fake_gpio *chip;
    char word[WORD_BYTES] = "";
    int at = 0;
    if (sscanf(line, "%255s %n", word, &at) != 1 || word[0] == '#') {
        return;
    }
    const char *rest = line + at;
    if (strcmp(word, "video") == 0) {
        add_video(line, rest);
    } else if (strcmp(word, "set") == 0) {
        set_video(line, rest);
    } else if (strcmp(word, "plug") == 0) {
        set_plug(line, rest);
    } else if (strcmp(word, "i2c") == 0) {
        add_i2c(line, rest);
    } else if (strcmp(word, "gpio") == 0) {
        chip = fake_gpio_add(rest);
    } else if (strcmp(word, "trigger") == 0) {
        add_trigger(line, rest, chip);
    } else if (strcmp(word, "watchdog") == 0) {
        add_watchdog(line, rest);
    } else if (strcmp(word, "mtd") == 0) {
        add_mtd(line, rest);
    } else if (strcmp(word, "watch") == 0) {
        fake_kernel_watch(rest);
    } else if (strcmp(word, "fail") == 0) {
        add_failure(line, rest);
    } else if (strcmp(word, "kill") == 0) {
        add_end(line, rest, fake_kernel_kill);
    } else if (strcmp(word, "hang") == 0) {
        add_end(line, rest, fake_kernel_hang);
    } else if (strcmp(word, "slow") == 0) {
        add_end(line, rest, fake_kernel_slow);
    } else if (strcmp(word, "record") == 0) {
        fake_kernel_record_to(rest);
    } else {
        stop(line);
    }
}

void fake_script_run(const char *path) {
    FILE *file = fopen(path, "r");
    if (file == NULL) {
        fprintf(stderr, "fake kernel: VERGENCE_FAKE_KERNEL=%s cannot be read\n", path);
        abort();
    }
    char line[LINE_BYTES];
    while (fgets(line, sizeof line, file) != NULL) {
        line[strcspn(line, "\n")] = '\0';
        follow(line);
    }
    fclose(file);
    fake_file_prepare();
}

__attribute__((constructor)) static void begin(void) {
    const char *path = getenv("VERGENCE_FAKE_KERNEL");
    if (path != NULL && path[0] != '\0') {
        fake_script_run(path);
    }
}
