// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/config_keys.h"

#define AT(field) offsetof(struct config, field), sizeof(((struct config *)0)->field)
#define TEXT(key, field, says) \
    { .name = (key), .kind = CONFIG_TEXT, AT(field), .none = "none", .help = (says) }
#define NUMBER(key, field, low, high, of, says)                                          \
    {                                                                                    \
        .name = (key), .kind = CONFIG_NUMBER, AT(field), .least = (low), .most = (high), \
        .unit = (of), .help = (says)                                                     \
    }
#define LINE(key, field, says)                                                                  \
    {                                                                                           \
        .name = (key), .kind = CONFIG_NUMBER, AT(field), .least = CONFIG_NO_LINE, .most = 1023, \
        .none = "none", .help = (says)                                                          \
    }
#define YES(key, field, says) \
    { .name = (key), .kind = CONFIG_CHOICE, AT(field), .choices = "no yes", .help = (says) }
#define RIG(field, low, high, of, says) \
    NUMBER(CONFIG_RIG #field, profile.field, low, high, of, says)
#define RIG_YES(field, says) YES(CONFIG_RIG #field, profile.field, says)
#define SERVO(side, at, field, low, high, of, says) \
    NUMBER(CONFIG_RIG "servo_" side "_" #field, profile.servo[at].field, low, high, of, says)
#define SERVOS(side, at)                                                                       \
    SERVO(side, at, centre_q4, 0, 65535, "us/16", "pulse in the " side " servo's middle"),     \
        SERVO(side, at, least_q4, 0, 65535, "us/16", "shortest pulse that it may get"),        \
        SERVO(side, at, most_q4, 0, 65535, "us/16", "longest pulse that it may get"),          \
        SERVO(side, at, q4_per_rad, 0, 1000000, "us/16 a radian", "how far a pulse turns it"), \
        SERVO(side, at, urad_per_s, 0, 100000000, "urad/s", "its speed at the lowest supply"), \
        SERVO(side, at, settle_us, 0, 10000000, "us", "until it rests after a motion")

static const struct config_key keys[] = {
    {.name = CONFIG_PROFILE_KEY,
     .kind = CONFIG_PROFILE,
     .sets = CONFIG_RIG,
     .help =
         "which instrument this is: rig (FPGA, two sensors, servos, lenses), two-cameras, "
         "two-cameras-lens, or a file: a name that ends in .profile, or has a / in it; where it "
         "does not begin with one, seen from the folder of this file. Sets every rig. key, "
         "which may be changed in lines below it"},
    {.name = "backend",
     .kind = CONFIG_BACKEND,
     .help =
         "what the instrument hangs on: linux (the devices below), sim unix:PATH or sim "
         "tcp:HOST:PORT (a simulated rig), replay DIRECTORY (a recorded session; of a recording "
         "of all calls the profile is its own, and its commands alone, in their order, are "
         "answered)"},
    TEXT("i2c", i2c, "I2C bus of the FPGA bridge and of the sensors behind it"),
    TEXT("left_camera", camera[RIG_LEFT],
         "V4L2 device of the left camera; behind a bridge that of the port for both"),
    TEXT("right_camera", camera[RIG_RIGHT], "V4L2 device of the right camera"),
    TEXT("lens_uart", lens_uart, "serial line of the lens controller"),
    TEXT("gpio_chip", gpio_chip, "GPIO chip with the lines below"),
    LINE("reset_line", reset_line, "its line to the bridge's reset"),
    YES("reset_active_low", reset_active_low, "whether that line resets when it is low"),
    LINE("irq_line", irq_line, "its line from the bridge's interrupt"),
    YES("irq_active_low", irq_active_low, "whether that line is active when it is low"),
    LINE("lens_power_line", lens_power_line, "its line that switches the lens controller"),
    YES("lens_power_active_low", lens_power_active_low, "whether low switches it on"),
    LINE("trigger_line", trigger_line, "its line to the trigger inputs of both cameras"),
    YES("trigger_active_low", trigger_active_low, "whether low triggers them"),

    TEXT("socket", socket, "Unix socket for clients, for the daemon's user and group"),
    {.name = "tcp_port",
     .kind = CONFIG_NUMBER,
     AT(tcp_port),
     .least = 0,
     .most = 65535,
     .none = "off",
     .help = "TCP port for clients on this machine (127.0.0.1) that give the token"},
    {.name = "tcp_token",
     .kind = CONFIG_TEXT,
     AT(tcp_token),
     .none = "default",
     .help = "file with the token of clients over TCP, which the daemon makes where there is none "
             "and only its user may read; default: vergence/tcp_token in XDG_STATE_HOME where that "
             "is set, else in /var/lib for users who can write there, else in ~/.local/state"},
    TEXT("console", console, "terminal: a serial device, or stdio"),
    NUMBER("console_baud", console_baud, 9600, 921600, "baud", "speed of that device"),
    NUMBER("clients", clients, 1, CONFIG_CLIENTS_MAX, NULL, "most clients at a time"),
    NUMBER("queue", queue, 1, CONFIG_QUEUE_MAX, NULL,
           "commands that may wait; one more is answered ERR BUSY"),
    NUMBER("reader_timeout", reader_timeout_s, 1, 3600, "s",
           "a client that has not read for so long is dropped"),

    TEXT("watchdog", watchdog,
         "watchdog device, such as /dev/watchdog: the system restarts when the daemon has ended "
         "out of order, or the instrument's thread is stuck"),
    NUMBER("watchdog_period", watchdog_s, CONFIG_WATCHDOG_LEAST_S, 3600, "s",
           "of that device, or what it can do next to it; more than ending takes, so that a device "
           "which can do less than 4 is refused"),
    NUMBER("stuck_after", stuck_s, 1, 3600, "s",
           "the instrument's thread is taken for stuck when it has not gone on for so long: "
           "watchdogs are not fed any more. A simulated rig, which renders its frames meanwhile, "
           "has at least 150"),

    TEXT("files", files, "directory of sessions and results, which clients can fetch"),
    TEXT("store", store, "directory of what outlives a restart: settings, the calibration"),
    YES("restore", restore,
        "whether bringup sets exposure, gain and window as \"settings save\" has kept them; the "
        "command \"settings restore\" does, and moves the axes, too"),
    TEXT("log", log_file, "file of the log; none: standard error"),
    {.name = "log_level",
     .kind = CONFIG_CHOICE,
     AT(log_level),
     .least = 3,
     .choices = "error warning notice info debug",
     .help = "the least important lines that are kept"},
    TEXT("faults", faults,
         "for tests: which calls of which part fail, such as i2c.transfer@5=i2c_nack"),
    YES("confine", confine, "give up, after the start, all system calls that are not needed"),

    {.name = CONFIG_RIG "name",
     .kind = CONFIG_NAME,
     AT(profile.name),
     .help = "what the instrument is called in its status and its sessions: letters, digits, - _ "
             "and ."},
    // Of parts that the profile lacks the numbers are 0; rig_profile_check looks at the others.
    RIG_YES(bridge, "whether there is an FPGA bridge, and both sensors behind it"),
    RIG(bridge_address, 0, 0x77, NULL, "I2C address of the bridge"),
    NUMBER(CONFIG_RIG "sensor_address_left", profile.sensor_address[RIG_LEFT], 0, 0x77, NULL,
           "I2C address of the left sensor"),
    NUMBER(CONFIG_RIG "sensor_address_right", profile.sensor_address[RIG_RIGHT], 0, 0x77, NULL,
           "I2C address of the right sensor"),
    RIG(sensor_clock_hz, 0, 48000000, "Hz", "clock that the sensors get"),
    RIG_YES(servos, "whether servos turn the cameras"),
    SERVOS("left", RIG_LEFT),
    SERVOS("right", RIG_RIGHT),
    RIG(servo_slew_q4, 0, 2047, "us/16 a pulse", "greatest change from pulse to pulse"),
    RIG(watchdog_ms, 0, 1500, "ms", "silence after which the bridge lets the servos rest"),
    RIG(pan_least_urad, -1570796, 1570796, "urad", "farthest turn to the left"),
    RIG(pan_most_urad, -1570796, 1570796, "urad", "farthest turn to the right"),
    RIG(pan_repeatability_urad, 0, 174533, "urad",
        "standard deviation of an angle approached again; a calibration made further away than "
        "this "
        "is refused"),
    {.name = CONFIG_RIG "lenses",
     .kind = CONFIG_LENSES,
     AT(profile.lenses),
     .sets = CONFIG_RIG "lens_",
     .choices = "fixed v3lc v1lc",
     .help = "fixed; two motorized ones on a V3LC; the left one on a V1LC. Sets the lens_ keys, "
             "which may be changed in lines below it"},
    NUMBER(CONFIG_RIG "lens_counts_per_s_zoom", profile.lens_counts_per_s[0], 0, 100000, "counts/s",
           "a slower zoom motor is taken for jammed"),
    NUMBER(CONFIG_RIG "lens_counts_per_s_focus", profile.lens_counts_per_s[1], 0, 100000,
           "counts/s", "a slower focus motor is taken for jammed"),
    NUMBER(CONFIG_RIG "lens_counts_per_s_iris", profile.lens_counts_per_s[2], 0, 100000, "counts/s",
           "a slower iris motor is taken for jammed"),
    RIG(lens_backlash_counts, 0, 100, "counts", "moves end from below, after so far past"),
    RIG(lens_tolerance_counts, 0, 100, "counts", "a move has arrived within this"),
    RIG(lens_repeatability_counts, 0, 100, "counts",
        "a calibration made further away than this in zoom, focus or iris is refused"),
    RIG(lens_zoom_ppm, 0, 100000, "ppm a count", "change of the focal length by one count of zoom"),
    RIG(width_px, 16, 16384, "px", "width of full frames"),
    RIG(height_px, 16, 16384, "px", "height of full frames"),
    RIG(frame_us, 1000, 60000000, "us", "longest time between frames where no sensor tells"),
    RIG(skew_limit_us, 1, 60000000, "us", "longest time between the frames of a pair"),
    RIG_YES(trigger,
            "whether both cameras, on ports of their own and set to external trigger, take each "
            "pair with a pulse of trigger_line; those behind a bridge run freely"),
    RIG(trigger_us, 0, 1000000, "us", "length of that pulse, 100 at least"),
};

const struct config_key *config_keys(size_t *count) {
    *count = sizeof keys / sizeof keys[0];
    return keys;
}
