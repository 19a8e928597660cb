// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/config_keys.h"

#include <string.h>

#include "console/command_words.h"
#include "core/invariant.h"
#include "daemon/settings/config.h"

#define AT(field) offsetof(struct config, field), sizeof(((struct config *)0)->field)
#define TEXT(key, field, meaning) \
    { .name = (key), .kind = CONFIG_TEXT, AT(field), .none = "none", .help = (meaning) }
#define NUMBER(key, field, low, high, unit, meaning)                                  \
    {                                                                                 \
        .name = (key), .kind = CONFIG_NUMBER, AT(field), .min = (low), .max = (high), \
        .quantity = QUANTITY_##unit, .help = (meaning)                                \
    }
#define WAS_BARE(key, field, low, high, unit, meaning)                                \
    {                                                                                 \
        .name = (key), .kind = CONFIG_NUMBER, AT(field), .min = (low), .max = (high), \
        .quantity = QUANTITY_##unit, .was_bare = true, .help = (meaning)              \
    }
#define LINE(key, field, meaning)                                                            \
    {                                                                                        \
        .name = (key), .kind = CONFIG_NUMBER, AT(field), .min = CONFIG_NO_LINE, .max = 1023, \
        .none = "none", .help = (meaning)                                                    \
    }
#define YES(key, field, meaning) \
    { .name = (key), .kind = CONFIG_CHOICE, AT(field), .choices = "no yes", .help = (meaning) }
#define RIG(key, field, low, high, unit, meaning) \
    NUMBER(CONFIG_RIG key, profile.field, low, high, unit, meaning)
#define RIG_ADDRESS(key, field, meaning) \
    WAS_BARE(CONFIG_RIG key, profile.field, 0, 0x77, ADDRESS, meaning)
#define RIG_YES(key, field, meaning) YES(CONFIG_RIG key, profile.field, meaning)
#define LENS_ALL(key, field, meaning)                                                          \
    {                                                                                          \
        .name = CONFIG_RIG key, .kind = CONFIG_NUMBER, AT(profile.lens.axis[0].field),         \
        .repeat = sizeof(struct lens_axis_settings), .max = 1000, .quantity = QUANTITY_COUNTS, \
        .help = (meaning)                                                                      \
    }
#define LENS(word, at, key, field, high, unit, meaning) \
    RIG("lens_" word "_" key, lens.axis[at].field, 0, high, unit, meaning)
#define LENS_AXIS(word, at)                                                                       \
    LENS(word, at, "min", min, 65535, COUNTS, "smallest position of the " word " motor"),         \
        LENS(word, at, "max", max, 65535, COUNTS, "largest position of the " word " motor"),      \
        LENS(word, at, "speed_min", counts_per_s, 100000, COUNTS_PER_S,                           \
             "a slower " word " motor counts as jammed"),                                         \
        LENS(word, at, "backlash", backlash_counts, 1000, COUNTS, "lens_backlash of " word),      \
        LENS(word, at, "tolerance", tolerance_counts, 1000, COUNTS, "lens_tolerance of " word), { \
        .name = CONFIG_RIG "lens_" word "_approach", .kind = CONFIG_CHOICE,                       \
        AT(profile.lens.axis[at].approach), .choices = "below above",                             \
        .help = "side from which the " word " motor reaches its target"                           \
    }
#define SERVO(side, at, key, field, high, unit, meaning) \
    RIG("servo_" side "_" key, servo[at].field, 0, high, unit, meaning)
#define SERVOS(side, at)                                                                      \
    SERVO(side, at, "centre", centre_q4, 65535, PULSE,                                        \
          "pulse at the centre of the " side " servo"),                                       \
        SERVO(side, at, "min", min_q4, 65535, PULSE, "shortest pulse of the " side " servo"), \
        SERVO(side, at, "max", max_q4, 65535, PULSE, "longest pulse of the " side " servo"),  \
        SERVO(side, at, "scale", q4_per_rad, 1000000, SERVO_SCALE,                            \
              "change of the pulse that turns the " side " servo by one degree"),             \
        SERVO(side, at, "speed", urad_per_s, 100000000, TURN_RATE,                            \
              "speed of the " side " servo at the lowest supply voltage"),                    \
        SERVO(side, at, "settle", settle_us, 10000000, MS_IN_US,                              \
              "time until the " side " servo is at rest after a motion")

static const struct config_key keys[] = {
    {.name = CONFIG_PROFILE_KEY,
     .kind = CONFIG_PROFILE,
     .help =
         "the instrument: rig (FPGA, two sensors, servos, lenses), two-cameras, two-cameras-lens, "
         "or the path of a profile: a name that ends in .profile or contains a /; a relative path "
         "starts at the directory of this file. Sets all rig. keys; other lines change them"},
    {.name = "backend",
     .kind = CONFIG_BACKEND,
     .help = "what drives the instrument: linux (the devices below), sim unix:PATH or sim "
             "tcp:HOST:PORT (a simulated rig), replay DIRECTORY (a recorded session; a recording "
             "of all calls brings its own profile and answers only its own commands, in their "
             "order)"},
    TEXT("i2c", i2c, "I2C bus of the FPGA bridge and of the sensors behind it"),
    TEXT("left_camera", camera[RIG_LEFT],
         "V4L2 device of the left camera; with a bridge, the port of both sensors"),
    TEXT("right_camera", camera[RIG_RIGHT], "V4L2 device of the right camera"),
    TEXT("lens_uart", lens_uart, "serial port of the lens controller"),
    TEXT("gpio_chip", gpio_chip, "GPIO chip of the lines below"),
    LINE("reset_line", reset_line, "GPIO line to the reset input of the bridge"),
    YES("reset_active_low", reset_active_low, "whether reset_line is active low"),
    LINE("irq_line", irq_line, "GPIO line from the interrupt output of the bridge"),
    YES("irq_active_low", irq_active_low, "whether irq_line is active low"),
    LINE("lens_power_line", lens_power_line, "GPIO line that powers the lens controller"),
    YES("lens_power_active_low", lens_power_active_low, "whether lens_power_line is active low"),
    LINE("trigger_line", trigger_line, "GPIO line to the trigger inputs of both cameras"),
    YES("trigger_active_low", trigger_active_low, "whether trigger_line is active low"),

    TEXT("socket", socket, "Unix socket for clients of the daemon's user and group"),
    {.name = "tcp_port",
     .kind = CONFIG_NUMBER,
     AT(tcp_port),
     .min = 0,
     .max = 65535,
     .none = "off",
     .help = "TCP port for clients that present the token; on this machine only, at 127.0.0.1, if "
             "tcp_network does not add others"},
    TEXT("tcp_network", tcp_network,
         "also serve tcp_port to clients of this IPv4 network, such as 192.0.2.0/24, at all "
         "addresses of this machine. Nothing is encrypted: anyone who can read the network's "
         "traffic "
         "gets the token and with it the instrument"),
    {.name = "tcp_token",
     .kind = CONFIG_TEXT,
     AT(tcp_token),
     .none = "default",
     .help = "file with the token of TCP clients; the daemon creates it, readable only by its own "
             "user. default: vergence/tcp_token in XDG_STATE_HOME where that is set, else in "
             "/var/lib for users who can write there, else in ~/.local/state"},
    TEXT("console", console, "terminal: a serial device, or stdio"),
    NUMBER("console_baud", console_baud, 9600, 921600, NUMBER, "baud rate of the console"),
    NUMBER("clients", clients, 1, CONFIG_CLIENTS_MAX, NUMBER, "maximum number of clients"),
    NUMBER("queue", queue, 1, CONFIG_QUEUE_MAX, NUMBER,
           "maximum number of waiting commands; one more is answered ERR BUSY"),
    WAS_BARE("reader_timeout", reader_timeout_s, 1, 3600, S,
             "a client that reads nothing for this long is disconnected"),

    TEXT("watchdog", watchdog,
         "watchdog device, such as /dev/watchdog: restarts the system when the daemon ends "
         "unexpectedly or the instrument's thread is stuck"),
    WAS_BARE("watchdog_period", watchdog_s, CONFIG_WATCHDOG_MIN_S, 3600, S,
             "timeout of the watchdog device, or the nearest one that the device supports. A "
             "device that supports less than 4 s only is rejected: stopping the daemon may take "
             "as long"),
    WAS_BARE("stuck_after", stuck_s, 1, 3600, S,
             "the instrument's thread counts as stuck after this long without progress: watchdogs "
             "are no longer fed. At least 150 s are used with a simulated rig, which has frames "
             "to render"),

    TEXT("files", files, "directory of sessions and results; clients can fetch them"),
    {.name = "files_limit",
     .kind = CONFIG_NUMBER,
     AT(files_limit_mb),
     .min = 0,
     .max = 1000000000,
     .quantity = QUANTITY_MB,
     .none = "none",
     .help =
         "maximum size of everything in \"files\", for directories in memory: commands that would "
         "write more are rejected before they begin"},
    TEXT("store", store, "directory of saved settings and the calibration"),
    YES("restore", restore,
        "whether bringup restores exposure, gain and window from \"settings save\"; the command "
        "\"settings restore\" also moves the axes"),
    TEXT("board", board, "name of this board, for which an image of \"update\" must be made"),
    TEXT("image_slot", image_slot,
         "name in /proc/mtd of the partition of flash that \"update\" writes an image to"),
    TEXT("image_slot_2", image_slot_2,
         "a second one: then the older of both is written, and the other stays whole"),
    TEXT("log", log_file, "log file; none: standard error"),
    {.name = "log_level",
     .kind = CONFIG_CHOICE,
     AT(log_level),
     .min = 3,
     .choices = "error warning notice info debug",
     .help = "lowest level that is logged"},
    TEXT("faults", faults,
         "for tests: which calls of which part fail, such as i2c.transfer@5=i2c_nack"),
    YES("confine", confine, "whether to give up, after the start, all unneeded system calls"),

    {.name = CONFIG_RIG "name",
     .kind = CONFIG_NAME,
     AT(profile.name),
     .help = "name of the instrument in its status and its sessions: letters, digits, - _ and ."},
    // Numbers of parts that the profile does not have are 0; rig_profile_check checks the others.
    RIG_YES("bridge", bridge, "whether there is an FPGA bridge, with both sensors behind it"),
    RIG_ADDRESS("bridge_address", bridge_address, "I2C address of the bridge"),
    RIG_ADDRESS("sensor_address_left", sensor_address[RIG_LEFT], "I2C address of the left sensor"),
    RIG_ADDRESS("sensor_address_right", sensor_address[RIG_RIGHT],
                "I2C address of the right sensor"),
    RIG("sensor_clock", sensor_clock_hz, 0, 48000000, MHZ, "clock of the sensors"),
    RIG_YES("servos", servos, "whether servos pan the cameras"),
    SERVOS("left", RIG_LEFT),
    SERVOS("right", RIG_RIGHT),
    RIG("servo_slew", servo_slew_q4, 0, 2047, PULSE, "largest change from one pulse to the next"),
    RIG("servo_watchdog", watchdog_ms, 0, 1500, MS,
        "the bridge brings the servos to rest after this long without I2C traffic"),
    RIG("pan_min", pan_min_urad, -1570796, 1570796, ANGLE, "leftmost pan angle"),
    RIG("pan_max", pan_max_urad, -1570796, 1570796, ANGLE, "rightmost pan angle"),
    RIG("pan_repeatability", pan_repeatability_urad, 0, 174533, ANGLE,
        "standard deviation of a pan angle that is approached again; a calibration made further "
        "away than this is rejected"),
    {.name = CONFIG_RIG "lenses",
     .kind = CONFIG_LENSES,
     AT(profile.lens_driver),
     .help = "fixed, or the controller of motorized lenses (vergenced --help-lenses lists them). "
             "Sets the lens_ keys; other lines change them"},
    RIG("lens_baud", lens.bits_per_s, 0, 921600, NUMBER,
        "baud rate of a lens controller on a serial port"),
    RIG_ADDRESS("lens_address", lens.address, "I2C address of a lens controller on I2C"),
    LENS_ALL("lens_backlash", backlash_counts,
             "a move overshoots by this much, so that each ends from the same side; for all axes"),
    LENS_ALL("lens_tolerance", tolerance_counts,
             "a move is complete within this distance of its target; for all axes"),
    LENS_AXIS("zoom", LENS_ZOOM),
    LENS_AXIS("focus", LENS_FOCUS),
    LENS_AXIS("iris", LENS_IRIS),
    RIG("lens_repeatability", lens.repeatability_counts, 0, 1000, COUNTS,
        "a calibration made further away than this in zoom, focus or iris is rejected"),
    RIG("lens_zoom_step", lens.zoom_ppm, 0, 100000, PERCENT,
        "change of the focal length by one count of zoom"),
    RIG("focal_length_wide", optics.focal_length_wide_um, 0, 1000000, MM_IN_UM,
        "focal length at the smallest position of zoom, by the lens's data sheet; 0 mm: not known"),
    RIG("focal_length_tele", optics.focal_length_tele_um, 0, 1000000, MM_IN_UM,
        "focal length at the largest position of zoom"),
    RIG("focus_nearest", optics.focus_nearest_um, 0, 100000000, MM_IN_UM,
        "distance in focus at the largest position of focus; at the smallest it is infinity. 0 mm: "
        "not known"),
    RIG("f_number_open", optics.f_number_open, 0, 64000, F_NUMBER,
        "f-number at the largest position of iris; 0: not known"),
    RIG("f_number_closed", optics.f_number_closed, 0, 64000, F_NUMBER,
        "f-number at the smallest position of iris"),
    RIG("pixel_pitch", optics.pixel_nm, 0, 50000, UM_IN_NM,
        "distance from pixel to pixel on the sensor; 0 um: not known"),
    RIG("width", width_px, 16, 16384, PX, "width of full frames"),
    RIG("height", height_px, 16, 16384, PX, "height of full frames"),
    RIG("frame_interval", frame_us, 1000, 60000000, MS_IN_US,
        "longest time between frames of cameras that do not report it"),
    RIG("skew_limit", skew_limit_us, 1, 60000000, MS_IN_US,
        "longest time between the two frames of a pair"),
    RIG("mains", mains_hz, 0, 100, HZ,
        "frequency of the mains: autoexpose prefers exposures of whole half periods, in which its "
        "lamps do not flicker; 0 Hz: constant light"),
    RIG_YES("trigger", trigger,
            "whether a pulse of trigger_line triggers each pair; both cameras have ports of their "
            "own and are set to external trigger. Not with a bridge, whose sensors run freely"),
    RIG("trigger_pulse", trigger_us, 0, 1000000, MS_IN_US, "length of that pulse, at least 0.1 ms"),
};

/// Names of versions that wrote the firmware's integers, in decimal and without a unit. These
/// names occur in files: they never change.
static const struct {
    const char *name, *now;
} old_names[] = {
    {"sensor_clock_hz", "sensor_clock"},
    {"servo_left_centre_q4", "servo_left_centre"},
    {"servo_left_least_q4", "servo_left_min"},
    {"servo_left_most_q4", "servo_left_max"},
    {"servo_left_q4_per_rad", "servo_left_scale"},
    {"servo_left_urad_per_s", "servo_left_speed"},
    {"servo_left_settle_us", "servo_left_settle"},
    {"servo_right_centre_q4", "servo_right_centre"},
    {"servo_right_least_q4", "servo_right_min"},
    {"servo_right_most_q4", "servo_right_max"},
    {"servo_right_q4_per_rad", "servo_right_scale"},
    {"servo_right_urad_per_s", "servo_right_speed"},
    {"servo_right_settle_us", "servo_right_settle"},
    {"servo_slew_q4", "servo_slew"},
    {"watchdog_ms", "servo_watchdog"},
    {"pan_least_urad", "pan_min"},
    {"pan_most_urad", "pan_max"},
    {"pan_repeatability_urad", "pan_repeatability"},
    {"lens_counts_per_s_zoom", "lens_zoom_speed_min"},
    {"lens_counts_per_s_focus", "lens_focus_speed_min"},
    {"lens_counts_per_s_iris", "lens_iris_speed_min"},
    {"lens_backlash_counts", "lens_backlash"},
    {"lens_tolerance_counts", "lens_tolerance"},
    {"lens_repeatability_counts", "lens_repeatability"},
    {"lens_zoom_ppm", "lens_zoom_step"},
    {"width_px", "width"},
    {"height_px", "height"},
    {"frame_us", "frame_interval"},
    {"skew_limit_us", "skew_limit"},
    {"trigger_us", "trigger_pulse"},
};

const struct config_key *config_keys(size_t *count) {
    *count = sizeof keys / sizeof keys[0];
    INVARIANT(*count <= CONFIG_KEYS_MAX && keys[0].kind == CONFIG_PROFILE);
    return keys;
}

const char *config_key_called(const struct config_key *key, bool in_profile) {
    INVARIANT(key >= keys && key < keys + sizeof keys / sizeof keys[0]);
    if (!in_profile) {
        return key->name;
    }
    return key->kind == CONFIG_PROFILE ? CONFIG_LIKE : key->name + strlen(CONFIG_RIG);
}

static bool is_of_rig(const struct config_key *key) {
    return strncmp(key->name, CONFIG_RIG, strlen(CONFIG_RIG)) == 0;
}

/// The key of this name, or NULL and a similar name.
static const struct config_key *find(const char *called, bool in_profile, struct suggest *suggest) {
    suggest_begin(suggest, called, "");
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        const bool of_rig = is_of_rig(&keys[i]);
        if (in_profile && keys[i].kind != CONFIG_PROFILE && !of_rig) {
            continue;
        }
        const char *name = config_key_called(&keys[i], in_profile);
        if (strcmp(name, called) == 0 || (of_rig && strcmp(keys[i].name, called) == 0)) {
            return &keys[i];
        }
        suggest_consider(suggest, name);
    }
    return NULL;
}

const struct config_key *config_key_find(const char *called, bool in_profile, bool *old,
                                         struct suggest *suggest) {
    const struct config_key *key = find(called, in_profile, suggest);
    const bool prefixed = strncmp(called, CONFIG_RIG, strlen(CONFIG_RIG)) == 0;
    const char *name = called + (prefixed ? strlen(CONFIG_RIG) : 0);
    struct suggest other;
    *old = false;
    for (size_t i = 0;
         key == NULL && (prefixed || in_profile) && i < sizeof old_names / sizeof old_names[0];
         i++) {
        *old = strcmp(old_names[i].name, name) == 0;
        key = *old ? find(old_names[i].now, true, &other) : NULL;
    }
    return key;
}

bool config_key_is_old(const struct config_key *key, bool old_name, const char *value) {
    return old_name ||
           (key->was_bare && *value != '\0' && value[strspn(value, "0123456789")] == '\0');
}
