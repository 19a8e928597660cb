// SPDX-License-Identifier: Apache-2.0
// The daemon: selects the backends and the commands, and serves them.
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends.h"
#include "daemon/backends/linux/watchdog_dev.h"
#include "daemon/backends/store/store.h"
#include "daemon/base/memory.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/process.h"
#include "daemon/cli/help.h"
#include "daemon/cli/options.h"
#include "daemon/client/client.h"
#include "daemon/commands/commands.h"
#include "daemon/commands/manuals.h"
#include "daemon/files/file_io.h"
#include "daemon/files/standard_paths.h"
#include "daemon/server/confine.h"
#include "daemon/server/notify.h"
#include "daemon/server/server.h"
#include "daemon/settings/config.h"
#include "daemon/system/system_check.h"

enum { SETTINGS_MAX = 64, MANUAL_SECTION = 8 };

/// The daemon, and what only its start and end use.
struct program {
    struct daemon daemon;
    struct config_old_lines old_lines;
    struct store store;
    bool store_open;
    struct backends backends;
    struct watchdog_dev watchdog;
    bool watchdog_open;
    struct server server;
};

struct arguments {
    const char *config;
    const char *check;
    bool check_board;
    bool json;
    bool help_config;
    const char *help_profile;
    bool help_lenses;
    bool manual;
    bool version;
};

/// manual.md, embedded by the build.
extern const char *const vergenced_manual;

static const struct command_argument options[] = {
    {.name = "config",
     .kind = COMMAND_TEXT,
     .offset = offsetof(struct arguments, config),
     .value_name = "FILE",
     .help = "Settings file. Default: /etc/vergence/vergenced.conf for root and systemd services, "
             "else ~/.config/vergence/vergenced.conf ($XDG_CONFIG_HOME), if that file exists; "
             "else built-in defaults."},
    {.name = "check",
     .kind = COMMAND_TEXT,
     .offset = offsetof(struct arguments, check),
     .value_name = "FILE",
     .help = "Check a settings file and the profile that it names, or a profile (a name ending in "
             ".profile), and exit. Shows how to write keys that are in an old notation."},
    {.name = "check-board",
     .kind = COMMAND_FLAG,
     .offset = offsetof(struct arguments, check_board),
     .help = "Print what the settings need of this system (functions of the kernel, devices, "
             "partitions of flash, variables of U-Boot), whether it is there and what to do if "
             "not, and exit."},
    {.name = "json",
     .kind = COMMAND_FLAG,
     .offset = offsetof(struct arguments, json),
     .help = "Print that as JSON."},
    {.name = "help-config",
     .kind = COMMAND_FLAG,
     .offset = offsetof(struct arguments, help_config),
     .help = "Print all settings with explanations and defaults, as a file to start from."},
    {.name = "help-profile",
     .kind = COMMAND_TEXT,
     .offset = offsetof(struct arguments, help_profile),
     .value_name = "NAME",
     .help = "Print a built-in profile with explanations, as a file to start from."},
    {.name = "help-lenses",
     .kind = COMMAND_FLAG,
     .offset = offsetof(struct arguments, help_lenses),
     .help = "Print the lens controllers that a profile's \"lenses\" may name."},
    {.name = "manual",
     .kind = COMMAND_FLAG,
     .offset = offsetof(struct arguments, manual),
     .help = "Print the manual of the instrument: commands and answers, settings, focus and "
             "exposure, sessions, images of a board."},
    {.name = "version",
     .kind = COMMAND_FLAG,
     .offset = offsetof(struct arguments, version),
     .help = "Print version and build."},
};

static const struct option_page page = {
    .command = "vergenced",
    .operands = "[KEY=VALUE ...]",
    .summary = "serves the instrument to consoles and programs",
    .description =
        "Does not bring up the instrument: the command \"bringup\" does. SIGTERM ends the daemon "
        "with the instrument in its safe state; SIGHUP reopens the log.\n"
        "KEY=VALUE replaces or adds a line of the settings file. A key may be set once in each, "
        "\"none\" disables a setting, and profile precedes the rig. keys, which it sets.\n"
        "For root and systemd services the socket is in /run/vergence, files in /var/lib/vergence. "
        "For other users the socket is $XDG_RUNTIME_DIR/vergence/vergenced.sock (or below "
        "~/.local/state), files are in ~/.local/share/vergence/files ($XDG_DATA_HOME), store and "
        "log in ~/.local/state/vergence ($XDG_STATE_HOME). The first lines of output say which.\n"
        "Exit codes: 0 orderly end, or the file is valid; 1 standard output cannot be written, or "
        "--check-board misses something; 2 invalid option; 3 invalid setting, or what it names "
        "cannot be used.",
    .examples =
        "vergenced --check vergenced.conf\n"
        "vergenced \"backend=sim unix:rig.sock\" socket=v.sock console=stdio",
    .options = options,
    .option_count = sizeof options / sizeof options[0],
    .operands_min = 0,
    .operands_max = SETTINGS_MAX,
};

static int fail(const struct message *message) {
    fprintf(stderr, "vergenced: %s\n", message->text);
    return CLIENT_BAD_INPUT;
}

/// Creates the parent directories of default locations only: a location from a setting must exist,
/// so that a typing error is noticed.
static int make_places(const struct config *config, struct message *message) {
    struct standard_paths paths;
    standard_paths_default(&paths);
    const struct {
        const char *key, *path, *by_default;
    } all[] = {
        {"socket", config->socket, paths.socket},
        {"files", config->files, paths.files},
        {"store", config->store, paths.store},
        {"log", config->log_file, paths.log},
    };
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        if (strcmp(all[i].path, all[i].by_default) == 0 &&
            !standard_paths_make_parent(all[i].path, paths.of_user ? 0700 : 0750)) {
            return message_set(message, ERROR_IO, "%s = %s: cannot create its directory: %s",
                               all[i].key, all[i].path, strerror(errno));
        }
    }
    return ERROR_OK;
}

static int open_files(struct program *self, struct message *message) {
    const char *path = self->daemon.config.files;
    self->daemon.files_fd = -1;
    if (path[0] == '\0') {
        return ERROR_OK;
    }
    const bool made = mkdir(path, 0750) == 0;
    if (!made && errno != EEXIST) {
        return message_set(message, ERROR_IO, "files = %s: %s", path, strerror(errno));
    }
    self->daemon.files_fd = open(path, O_PATH | O_DIRECTORY | O_CLOEXEC);
    if (self->daemon.files_fd < 0 || (!sync_directory_at(self->daemon.files_fd, "..") && made)) {
        return message_set(message, ERROR_IO, "files = %s: %s", path, strerror(errno));
    }
    return ERROR_OK;
}

static bool are_same(int left_fd, int right_fd) {
    struct stat left, right;
    return fstat(left_fd, &left) == 0 && fstat(right_fd, &right) == 0 &&
           left.st_dev == right.st_dev && left.st_ino == right.st_ino;
}

static int open_store(struct program *self, struct message *message) {
    const char *path = self->daemon.config.store;
    if (path[0] == '\0') {
        return ERROR_OK;
    }
    const int error = store_open(&self->store, path, message);
    self->store_open = error == ERROR_OK;
    if (error == ERROR_OK) {
        atomic_store(&self->daemon.health.set_s, store_saved_s(&self->store, STORE_CALIBRATION));
    }
    if (error == ERROR_OK && self->daemon.files_fd >= 0 &&
        are_same(self->daemon.files_fd, self->store.directory_fd)) {
        return message_set(message, ERROR_ARGUMENT,
                           "store = %s: same directory as \"files\", whose files clients may "
                           "replace (use a separate directory)",
                           path);
    }
    return error;
}

/// Arms the watchdog: from here on the system restarts if it is not fed.
static int open_watchdog(struct program *self, struct message *message) {
    const struct config *config = &self->daemon.config;
    if (config->watchdog[0] == '\0') {
        return ERROR_OK;
    }
    const int error =
        watchdog_dev_open(&self->watchdog, config->watchdog, config->watchdog_s, message);
    self->watchdog_open = error == ERROR_OK;
    const unsigned period_s = (unsigned)(self->watchdog.period_us / MONOTONIC_US_IN_S);
    if (error == ERROR_OK && period_s != 0 && period_s < CONFIG_WATCHDOG_MIN_S) {
        return message_set(message, ERROR_UNSUPPORTED,
                           "watchdog = %s: its period is at most %u s, but an orderly end may take "
                           "longer (use a watchdog of %d s or more, or none)",
                           config->watchdog, period_s, CONFIG_WATCHDOG_MIN_S);
    }
    return error;
}

/// Disarms the watchdog, after the rig's thread has ended orderly.
static void close_watchdog(struct program *self) {
    if (self->watchdog_open && !watchdog_dev_close(&self->watchdog, true)) {
        log_ring_print(&self->daemon.log_ring, HAL_LOG_ERROR, "cannot stop the watchdog");
    }
}

static void cancel_as_recorded(void *rig_worker) {
    worker_cancel(rig_worker);
}

/// Limit for frames waiting for a slow disk. A command takes at most six of 6 MiB (a pair, a third
/// one to compare, each repeated once); a board of 64 MB waits for its disk instead.
static size_t held_max_bytes(void) {
    enum { MAX_BYTES = 64 << 20 };
    const uint64_t half = memory_available_bytes() / 2;
    return half < MAX_BYTES ? (size_t)half : MAX_BYTES;
}

/// Opens everything that the server uses. 0, or an error with a message.
static int open_parts(struct program *self, struct rig_ports *ports, struct message *message) {
    const int number = log_ring_open(&self->daemon.log_ring, self->daemon.config.log_file,
                                     self->daemon.config.log_level);
    if (number != 0) {
        return message_set(message, ERROR_IO, "log = %s: %s", self->daemon.config.log_file,
                           strerror(number));
    }
    self->daemon.log = log_ring_log(&self->daemon.log_ring);
    if (self->old_lines.count > 0) {
        log_ring_print(&self->daemon.log_ring, HAL_LOG_WARNING,
                       "settings in an old notation: %u (vergenced --check FILE shows the new one)",
                       self->old_lines.count);
    }
    int error = open_files(self, message);
    error = error != ERROR_OK ? error : open_store(self, message);
    if (error == ERROR_OK) {
        error =
            backends_open(&self->backends, &self->daemon.config, &self->daemon.log, ports, message);
    }
    return error != ERROR_OK ? error : open_watchdog(self, message);
}

/// Connects the opened parts.
static void join_parts(struct program *self, const struct rig_ports *inner) {
    struct daemon *daemon = &self->daemon;
    struct backends *backends = &self->backends;
    struct rig_ports ports = {0};
    daemon->table = commands_all();
    daemon->store = backends_store(backends, self->store_open ? &self->store.hal : NULL);
    daemon->watchdog =
        backends_watchdog(backends, self->watchdog_open ? &self->watchdog.hal : NULL);
    backends->replay.rig = &daemon->rig;
    backends->replay.cancel = cancel_as_recorded;
    backends->replay.self = &daemon->rig_worker;
    for (int side = 0; side < RIG_SIDES; side++) {
        daemon->cameras[side] = backend_linux_camera(&backends->devices, side);
    }
    record_init(&daemon->record, inner, &ports);
    ports.log = &daemon->log;
    const struct rig_observer observer = worker_observer(&daemon->rig_worker);
    rig_init(&daemon->rig, &daemon->config.profile, &ports, &observer);
}

static int start(struct program *self, struct message *message) {
    struct daemon *daemon = &self->daemon;
    struct rig_ports ports;
    int error = open_parts(self, &ports, message);
    if (error != ERROR_OK) {
        return error;
    }
    join_parts(self, &ports);
    error = server_open(&self->server, daemon, message);
    if (error != ERROR_OK) {
        return error;
    }
    daemon->disk_writer.held_max_bytes = held_max_bytes();
    // Only now that signals are blocked, as the thread inherits the mask.
    if (!disk_writer_start(&daemon->disk_writer)) {
        return message_set(message, ERROR_IO, "cannot start a thread");
    }
    daemon->record.disk_writer = &daemon->disk_writer;
    return server_start(&self->server, message);
}

static int confine(struct program *self, struct message *message) {
    if (!self->daemon.config.confine) {
        return ERROR_OK;
    }
    const int error = confine_process(message);
    if (error == ERROR_UNSUPPORTED) {
        log_ring_print(&self->daemon.log_ring, HAL_LOG_WARNING, "%s", message->text);
        return ERROR_OK;
    }
    return error;
}

/// Reports a line of the start to the log, and to the terminal if the log is elsewhere.
__attribute__((format(printf, 3, 4))) static void report(struct program *self,
                                                         enum hal_log_level level,
                                                         const char *format, ...) {
    struct message line;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line.text, sizeof line.text, format, arguments);
    va_end(arguments);
    log_ring_print(&self->daemon.log_ring, level, "%s", line.text);
    if (self->daemon.config.log_file[0] != '\0') {
        fprintf(stderr, "vergenced: %s\n", line.text);
    }
}

static void report_start(struct program *self) {
    const struct config *config = &self->daemon.config;
    const struct {
        const char *what, *place;
    } paths[] = {{"socket", config->socket},
                 {"files", config->files},
                 {"store", config->store},
                 {"log", config->log_file}};
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++) {
        if (paths[i].place[0] != '\0') {
            report(self, HAL_LOG_NOTICE, "%s: %s", paths[i].what, paths[i].place);
        }
    }
    if (self->backends.awaited) {
        report(self, HAL_LOG_NOTICE, "waiting for the rig at %s; bringup waits, too",
               config->backend_address);
    }
    if (config->tcp_network[0] != '\0') {
        report(self, HAL_LOG_WARNING,
               "tcp_network = %s: served without encryption: anyone who can read this network's "
               "traffic can take the token and drive the instrument",
               config->tcp_network);
    }
    log_ring_print(&self->daemon.log_ring, HAL_LOG_NOTICE, "vergenced %s (build %s): serving",
                   version_text(), version_build_id());
    if (config->log_file[0] != '\0') {
        fputs("vergenced: serving until Ctrl-C\n", stderr);
    }
}

static int serve(struct program *self) {
    struct message message;
    notify_open();
    int error = start(self, &message);
    error = error != ERROR_OK ? error : confine(self, &message);
    const int code = error != ERROR_OK ? fail(&message) : CLIENT_OK;
    if (error == ERROR_OK) {
        report_start(self);
        server_run(&self->server);
    }
    server_close(&self->server);
    close_watchdog(self);
    commands_session_end(&self->daemon);
    disk_writer_stop(&self->daemon.disk_writer);
    backends_report_mismatch(&self->backends);
    backends_close(&self->backends);
    if (self->store_open) {
        store_close(&self->store);
    }
    if (self->daemon.files_fd >= 0) {
        close(self->daemon.files_fd);
    }
    log_ring_close(&self->daemon.log_ring);
    return code;
}

static void print_version(FILE *file) {
    fprintf(file, "vergenced %s (build %s)\n", version_text(), version_build_id());
}

static void print_manual_text(FILE *file) {
    const char *title = strchr(vergenced_manual, '#');
    INVARIANT(title != NULL);  // the licence is above the title
    fputs(title, file);
}

/// Prints a page instead of serving, if requested. Returns the exit code, or OPTIONS_CONTINUE.
static int print_page(const struct arguments *arguments, const char *const *settings, int count) {
    const struct {
        bool asked;
        const char *option;
        void (*print)(FILE *file);  ///< NULL: a profile
    } pages[] = {
        {arguments->help_config, "--help-config", config_help_print},
        {arguments->help_profile != NULL, "--help-profile", NULL},
        {arguments->help_lenses, "--help-lenses", config_lenses_print},
        {arguments->manual, "--manual", print_manual_text},
        {arguments->version, "--version", print_version},
    };
    for (size_t i = 0; i < sizeof pages / sizeof pages[0]; i++) {
        struct message message;
        if (!pages[i].asked) {
            continue;
        }
        if (count > 0) {
            fprintf(stderr, "vergenced: %s does not accept settings: %s\n", pages[i].option,
                    settings[0]);
            return CLIENT_USAGE;
        }
        if (pages[i].print == NULL &&
            config_profile_print(stdout, arguments->help_profile, &message) != 0) {
            return fail(&message);
        }
        if (pages[i].print != NULL) {
            pages[i].print(stdout);
        }
        return CLIENT_OK;
    }
    return OPTIONS_CONTINUE;
}

/// Prints manual pages and shell completion data, for the build. Returns the exit code, or
/// OPTIONS_CONTINUE for other arguments.
static int print_manual(const char *argument) {
    const bool console = strcmp(argument, "--help-man-console") == 0;
    if (strcmp(argument, "--help-man-config") == 0) {
        manuals_print_config(stdout);
        return CLIENT_OK;
    }
    if (strcmp(argument, "--help-man") == 0) {
        manual_options(stdout, &page, MANUAL_SECTION);
        manual_heading(stdout, "SEE ALSO");
        manual_reference(stdout, "", "vergenced.conf", 5, false);
        manual_reference(stdout, "", "vergence-console", 7, false);
        manual_reference(stdout, "", "vergence-connect", 1, true);
        return CLIENT_OK;
    }
    if (!console && strcmp(argument, "--help-words") != 0) {
        return OPTIONS_CONTINUE;
    }
    const struct command_table table = commands_all();
    if (console) {
        manuals_print_console(stdout, table.rows, table.count);
    } else {
        manuals_print_completion(stdout, table.rows, table.count);
        shell_completion_options(stdout, &page);
    }
    return CLIENT_OK;
}

/// The file to read, or NULL.
static const char *settings_path(const struct arguments *arguments,
                                 const struct standard_paths *paths) {
    const char *given = arguments->check != NULL ? arguments->check : arguments->config;
    return given != NULL || access(paths->config, F_OK) != 0 ? given : paths->config;
}

/// Reports on settings that were read, or on what they need. Returns the exit code.
static int report_check(const struct arguments *arguments, const struct config *config) {
    if (arguments->check != NULL) {
        printf("%s: good\n", arguments->check);
    }
    return !arguments->check_board || system_check_print(stdout, config, arguments->json) == 0
               ? CLIENT_OK
               : CLIENT_FAILED;
}

/// Returns the exit code; standard output may still be buffered.
static int run(int argc, char **argv) {
    static struct program program;
    struct arguments arguments = {0};
    const char *settings[SETTINGS_MAX];
    int setting_count = 0;
    int code = argc == 2 ? print_manual(argv[1]) : OPTIONS_CONTINUE;
    if (code != OPTIONS_CONTINUE) {
        return code;
    }
    code = options_parse(&page, argc, argv, &arguments, settings, &setting_count);
    code = code == OPTIONS_CONTINUE ? print_page(&arguments, settings, setting_count) : code;
    if (code != OPTIONS_CONTINUE) {
        return code;
    }
    struct message message;
    struct standard_paths paths;
    standard_paths_default(&paths);
    const char *path = settings_path(&arguments, &paths);
    const bool check = arguments.check != NULL;
    program.old_lines.report = check ? stderr : NULL;
    if (config_load(&program.daemon.config, path, settings, setting_count, &program.old_lines,
                    &message) != 0) {
        return fail(&message);
    }
    if (check || arguments.check_board) {
        return report_check(&arguments, &program.daemon.config);
    }
    return make_places(&program.daemon.config, &message) == 0 ? serve(&program) : fail(&message);
}

int main(int argc, char **argv) {
    memory_return_freed();
    return client_occupy_standard_streams() ? client_finish_output("vergenced", run(argc, argv))
                                            : CLIENT_FAILED;
}
