// SPDX-License-Identifier: Apache-2.0
// The kernel is asked by calls and by what it lists in /proc, as a small one has no copy of its
// configuration.
#include "daemon/system/system_check.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "core/error.h"
#include "core/utf8.h"
#include "daemon/base/json.h"
#include "daemon/base/message.h"
#include "daemon/system/flash.h"
#include "daemon/system/uboot_variables.h"
#include "rig/rig.h"

enum { TEXT_BYTES = 8192, NAME_BYTES = CONFIG_TEXT_BYTES + 32, FOUND_BYTES = MESSAGE_BYTES };

/// A row of the table.
struct row {
    const char *kind;
    char name[NAME_BYTES];
    const char *purpose;
    const char *advice;
    bool needed;  ///< these settings need it
    bool there;
    char found[FOUND_BYTES];
};

struct table {
    FILE *file;
    struct json *json;  ///< NULL: text
    int missing;
};

// ---- output

static const char *state_of(const struct row *row) {
    if (row->there) {
        return "there";
    }
    return row->needed ? "missing" : "not needed";
}

static void add_json(struct json *json, const struct row *row) {
    json_open_object(json, NULL);
    json_text(json, "state", state_of(row));
    json_text(json, "kind", row->kind);
    json_text(json, "name", row->name);
    json_text(json, "for", row->purpose);
    json_text(json, "found", row->found);
    json_text(json, "if_missing", row->advice);
    json_close_object(json);
}

static void add(struct table *table, const struct row *row) {
    const bool missing = !row->there && row->needed;
    table->missing += missing ? 1 : 0;
    if (table->json != NULL) {
        add_json(table->json, row);
        return;
    }
    fprintf(table->file, "%-10s  %-9s  %-32s  %s", state_of(row), row->kind, row->name,
            row->purpose);
    if (row->found[0] != '\0') {
        fprintf(table->file, " (%s)", row->found);
    }
    fprintf(table->file, "%s%s\n", missing ? ": " : "", missing ? row->advice : "");
}

// ---- the kernel

/// Whether a file of /proc contains a word.
static bool file_has(const char *path, const char *word) {
    static const char separators[] = " \t\n";
    char text[TEXT_BYTES], *rest = NULL;
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    const ssize_t bytes = fd >= 0 ? read(fd, text, sizeof text - 1) : -1;
    if (fd >= 0) {
        close(fd);
    }
    text[bytes > 0 ? bytes : 0] = '\0';
    for (const char *at = strtok_r(text, separators, &rest); at != NULL;
         at = strtok_r(NULL, separators, &rest)) {
        if (strcmp(at, word) == 0) {
            return true;
        }
    }
    return false;
}

static bool has_device_class(const char *word) {
    return file_has("/proc/devices", word);
}

static bool has_file_system(const char *word) {
    return file_has("/proc/filesystems", word);
}

static bool has_file(const char *path) {
    return access(path, R_OK) == 0;
}

/// Closes a descriptor that a call has made. Whether it has.
static bool was_made(int fd) {
    if (fd >= 0) {
        close(fd);
    }
    return fd >= 0;
}

static bool has_events(const char *unused) {
    (void)unused;
    sigset_t none;
    sigemptyset(&none);
    return was_made(eventfd(0, EFD_CLOEXEC)) && was_made(signalfd(-1, &none, SFD_CLOEXEC));
}

static bool has_locks(const char *path) {
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    const bool locked = fd >= 0 && (flock(fd, LOCK_SH | LOCK_NB) == 0 || errno != ENOSYS);
    return was_made(fd) && locked;
}

static bool has_filter(const char *unused) {
    (void)unused;
    // Without a filter the kernel that knows this call reports a bad address, and changes nothing.
    return prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, NULL, 0, 0) == -1 && errno == EFAULT;
}

static bool has_unix(const char *unused) {
    (void)unused;
    return was_made(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
}

static bool has_inet(const char *unused) {
    (void)unused;
    return was_made(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
}

/// Whether the date is that of a clock that was set.
static bool has_date(const char *unused) {
    (void)unused;
    enum { YEAR_2025_S = 1735689600 };
    return time(NULL) > YEAR_2025_S;
}

/// What needs a function.
enum need { ALWAYS, CONFINED, SOCKET, NETWORK, I2C, CAMERAS, GPIO, WATCHDOG, BOARD };

static bool is_needed(const struct config *config, enum need need) {
    const bool devices = config->backend == CONFIG_BACKEND_LINUX;
    const bool board = config->board[0] != '\0';
    switch (need) {
        case CONFINED:
            return config->confine;
        case SOCKET:
            return config->socket[0] != '\0';
        case NETWORK:
            return config->tcp_port != 0 || board;
        case I2C:
            return devices && rig_needs_i2c(&config->profile);
        case CAMERAS:
            return devices;
        case GPIO:
            return devices &&
                   (config->reset_line != CONFIG_NO_LINE || config->irq_line != CONFIG_NO_LINE ||
                    config->lens_power_line != CONFIG_NO_LINE ||
                    config->trigger_line != CONFIG_NO_LINE);
        case WATCHDOG:
            return config->watchdog[0] != '\0';
        case BOARD:
            return board;
        case ALWAYS:
            break;
    }
    return true;
}

static void check_kernel(struct table *table, const struct config *config) {
    static const struct {
        const char *options, *purpose;
        enum need need;
        bool (*probe)(const char *what);
        const char *what;
    } functions[] = {
        {"PROC_FS", "free memory, partitions of flash", ALWAYS, has_file, "/proc/meminfo"},
        {"EVENTFD, SIGNALFD", "the daemon's event loop", ALWAYS, has_events, NULL},
        {"FILE_LOCKING", "one program at a serial line", ALWAYS, has_locks, "/dev/null"},
        {"SECCOMP_FILTER", "confine = yes", CONFINED, has_filter, NULL},
        {"UNIX", "clients on the board", SOCKET, has_unix, NULL},
        {"INET", "clients over TCP; put and update by TFTP", NETWORK, has_inet, NULL},
        {"I2C_CHARDEV", "bridge, sensors", I2C, has_device_class, "i2c"},
        {"VIDEO_DEV", "frames", CAMERAS, has_device_class, "video4linux"},
        {"GPIO_CDEV", "reset, interrupt, lens power, trigger", GPIO, has_device_class, "gpiochip"},
        {"WATCHDOG", "restart of a stuck system", WATCHDOG, has_device_class, "watchdog"},
        {"DEVTMPFS", "device files", BOARD, has_file_system, "devtmpfs"},
        {"TMPFS", "root and files in memory", BOARD, has_file_system, "tmpfs"},
        {"MTD, MTD_CFI, MTD_PHYSMAP", "update; store in flash", BOARD, has_file, "/proc/mtd"},
        {"JFFS2_FS", "store in flash", BOARD, has_file_system, "jffs2"},
        {"RTC_CLASS, RTC_HCTOSYS", "dates of files", BOARD, has_date, NULL},
    };
    for (size_t i = 0; i < sizeof functions / sizeof functions[0]; i++) {
        struct row row = {.kind = "kernel",
                          .purpose = functions[i].purpose,
                          .advice = "build the kernel with these options",
                          .needed = is_needed(config, functions[i].need),
                          .there = functions[i].probe(functions[i].what)};
        snprintf(row.name, sizeof row.name, "%s", functions[i].options);
        add(table, &row);
    }
}

// ---- devices

static bool inspect_device(const char *path, char found[FOUND_BYTES]) {
    struct stat about;
    if (path[0] == '\0') {
        snprintf(found, FOUND_BYTES, "not set");
    } else if (stat(path, &about) != 0 || access(path, R_OK | W_OK) != 0) {
        snprintf(found, FOUND_BYTES, "%s", strerror(errno));
    } else if (!S_ISCHR(about.st_mode)) {
        snprintf(found, FOUND_BYTES, "not a device");
    } else {
        return true;
    }
    return false;
}

static void check_devices(struct table *table, const struct config *config) {
    const bool devices = config->backend == CONFIG_BACKEND_LINUX;
    const bool console = config->console[0] != '\0' && strcmp(config->console, "stdio") != 0;
    const struct {
        const char *key, *path, *purpose;
        bool needed;
    } all[] = {
        {"i2c", config->i2c, "bridge, sensors", is_needed(config, I2C)},
        {"left_camera", config->camera[RIG_LEFT], "frames", devices},
        {"right_camera", config->camera[RIG_RIGHT], "frames without a bridge",
         devices && !config->profile.bridge},
        {"lens_uart", config->lens_uart, "lens controller",
         devices && rig_needs_lens_uart(&config->profile)},
        {"gpio_chip", config->gpio_chip, "lines of the bridge", is_needed(config, GPIO)},
        {"watchdog", config->watchdog, "restart of a stuck system", is_needed(config, WATCHDOG)},
        {"console", console ? config->console : "", "terminal", console},
    };
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        struct row row = {.kind = "device",
                          .purpose = all[i].purpose,
                          .advice =
                              "enable its driver in kernel and device tree, set this to its "
                              "name, and permit the daemon's user to use it",
                          .needed = all[i].needed};
        snprintf(row.name, sizeof row.name, "%s = %s", all[i].key,
                 all[i].path[0] != '\0' ? all[i].path : "none");
        row.there = inspect_device(all[i].path, row.found);
        add(table, &row);
    }
}

// ---- flash and the boot loader

static void check_slot(struct table *table, const char *key, const char *name, bool needed) {
    struct row row = {.kind = "partition",
                      .purpose = "images of update",
                      .advice =
                          "partition the flash in the device tree, or by mtdparts= on the "
                          "kernel's command line, and set this to the name",
                      .needed = needed};
    struct flash flash;
    struct message message = {.text = "not set"};
    snprintf(row.name, sizeof row.name, "%s = %s", key, name[0] != '\0' ? name : "none");
    row.there = name[0] != '\0' && flash_open(&flash, name, &message) == 0;
    if (row.there) {
        snprintf(row.found, sizeof row.found, "%s: %u bytes, erased by %u", flash.device,
                 (unsigned)flash.bytes, (unsigned)flash.block_bytes);
        flash_close(&flash);
    } else {
        snprintf(row.found, sizeof row.found, "%s", message.text);
    }
    add(table, &row);
}

static void check_variables(struct table *table, bool board) {
    static const struct {
        const char *name, *purpose, *advice;
        bool needed;
    } variables[] = {
        {"bootcmd", "boots without a person",
         "setenv bootcmd 'dhcp && tftpboot ${scriptaddr} boot.scr && source ${scriptaddr}'", true},
        {"scriptaddr", "where boot.scr is loaded", "setenv scriptaddr, a free address in memory",
         false},
        {"board_args", "added to the kernel's command line", "setenv board_args 'rescue', say",
         false},
    };
    struct uboot_variables environment;
    struct message message;
    const int error = uboot_variables_read(&environment, &message);
    struct row row = {.kind = "partition",
                      .purpose = "variables of U-Boot",
                      .advice =
                          "name U-Boot's partition for saveenv \"environment\" or "
                          "\"u-boot-env\", of the size CONFIG_ENV_SIZE, and saveenv",
                      .needed = board,
                      .there = error == ERROR_OK};
    snprintf(row.name, sizeof row.name, "environment");
    snprintf(row.found, sizeof row.found, "%s",
             error == ERROR_OK ? environment.device : message.text);
    add(table, &row);
    for (size_t i = 0; i < sizeof variables / sizeof variables[0]; i++) {
        const char *value =
            error == ERROR_OK ? uboot_variables_find(&environment, variables[i].name) : NULL;
        row = (struct row){.kind = "variable",
                           .purpose = variables[i].purpose,
                           .advice = variables[i].advice,
                           .needed = board && variables[i].needed,
                           .there = value != NULL};
        snprintf(row.name, sizeof row.name, "%s", variables[i].name);
        utf8_copy_printable(value != NULL ? value : "", row.found, sizeof row.found);
        add(table, &row);
    }
    if (error == ERROR_OK) {
        uboot_variables_free(&environment);
    }
}

int system_check_print(FILE *file, const struct config *config, bool as_json) {
    struct json json;
    struct table table = {.file = file, .json = as_json ? &json : NULL};
    const bool board = config->board[0] != '\0';
    if (as_json) {
        json_begin(&json, file);
        json_open_object(&json, NULL);
        json_open_array(&json, "rows");
    }
    check_kernel(&table, config);
    check_devices(&table, config);
    check_slot(&table, "image_slot", config->image_slot, board);
    check_slot(&table, "image_slot_2", config->image_slot_2, config->image_slot_2[0] != '\0');
    check_variables(&table, board);
    if (as_json) {
        json_close_array(&json);
        json_integer(&json, "missing", table.missing);
        json_close_object(&json);
        json_end(&json);
    } else {
        fprintf(file, "%d missing\n", table.missing);
    }
    return table.missing;
}
