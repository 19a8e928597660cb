// SPDX-License-Identifier: Apache-2.0
// The instrument's own commands. What people read about them stands here and nowhere else.
#include "console/commands.h"
#include "core/invariant.h"
#include "rig/registers.h"
#include "rig/rig.h"

#define COUNT(list) ((unsigned)(sizeof(list) / sizeof(list)[0]))

#define SIDE_ARGUMENT                                                                        \
    {                                                                                        \
        .name = "SIDE", .kind = COMMAND_CHOICE, .choices = COMMANDS_SIDES, .optional = true, \
        .help = "which camera; both when left out"                                           \
    }

#define ANGLE_ARGUMENT(text, says)                                                         \
    {                                                                                      \
        .name = (text), .kind = COMMAND_NUMBER, .unit = "deg", .least = -180, .most = 180, \
        .optional = true, .help = (says)                                                   \
    }

static const struct command_argument pan_arguments[] = {
    SIDE_ARGUMENT,
    ANGLE_ARGUMENT("ANGLE",
                   "from the middle, positive to the right, as far as the settings "
                   "rig.pan_least_urad and rig.pan_most_urad let it turn; shown when left out"),
    ANGLE_ARGUMENT("RIGHT_ANGLE", "of the right camera, when it differs from the left one's"),
};

static const struct command_argument position_arguments[] = {
    SIDE_ARGUMENT,
    {.name = "POSITION",
     .kind = COMMAND_INTEGER,
     .unit = "counts",
     .least = -1000000,
     .most = 1000000,
     .optional = true,
     .help = "of the lens controller, within the limits of the lens; shown with them when left "
             "out"},
};

#define KEPT_HELP                                                                               \
    "What was taken is shown. \"not set\": nobody has set it since the bring-up, and a camera " \
    "with a port of its own does as it did before."

static const struct command_argument exposure_arguments[] = {
    SIDE_ARGUMENT,
    {.name = "TIME",
     .kind = COMMAND_INTEGER,
     .unit = "us",
     .least = 1,
     .most = RIG_EXPOSURE_MOST_US,
     .optional = true,
     .help = "the nearest that the camera has is taken, but a camera with a port of its own "
             "refuses what is beyond its range; shown when left out"},
};

static const struct command_argument gain_arguments[] = {
    SIDE_ARGUMENT,
    {.name = "FACTOR",
     .kind = COMMAND_NUMBER,
     .least = 1,
     .most = 128,
     .optional = true,
     .help = "1 is the camera's least; the nearest that it has is taken; shown when left out"},
};

static const struct command_argument window_arguments[] = {
    {.name = "WIDTH",
     .kind = COMMAND_INTEGER,
     .unit = "px",
     .least = 16,
     .most = 8192,
     .optional = true,
     .help = "of the sensor's part that frames show; shown when left out"},
    {.name = "HEIGHT",
     .kind = COMMAND_INTEGER,
     .unit = "px",
     .least = 16,
     .most = 8192,
     .optional = true,
     .help = "of that part"},
    {.name = "SKIP",
     .kind = COMMAND_INTEGER,
     .least = 1,
     .most = 8,
     .optional = true,
     .help = "every so many pixels one is taken, both ways; 1 when left out"},
};

static const struct command_argument registers_arguments[] = {
    {.name = "WHERE",
     .kind = COMMAND_CHOICE,
     .choices = REGISTERS_PLACE_NAMES,
     .help = "the FPGA bridge, or the sensor of a camera"},
    {.name = "NAME",
     .kind = COMMAND_TEXT,
     .least = 1,
     .most = 40,
     .optional = true,
     .help = "or index of a register; all that have a name when left out",
     .candidates = commands_registers_candidates},
};

static const struct command_argument wait_arguments[] = {
    {.name = "TIME",
     .kind = COMMAND_NUMBER,
     .unit = "s",
     .least = 0,
     .most = 100000,
     .help = "of the instrument's clock"},
};

static const struct command commands[] = {
    {.name = "status",
     .summary = "what the instrument is set to and where it looks",
     .help = "Angles and lens positions are read from the hardware.",
     .run = commands_state_status},
    {.name = "health",
     .summary = "how each part works, and what has been counted",
     .help = "Looks at every part without moving any; in the safe state it tells why that is, and "
             "how they were before. The error is that of the first part that does not work.",
     .run = commands_state_health},
    {.name = "selftest",
     .summary = "test the parts and the way of the pictures, moving nothing",
     .help = "Beside what health looks at, a test picture that the bridge makes is taken as a "
             "camera's frame would be, and must arrive bit for bit.",
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG,
     .run = commands_selftest_run},
    {.name = COMMANDS_BRINGUP,
     .summary = "find and set up every part; again after a failure",
     .help = "Servos stay where they are until the first pan. When a part is missing the others "
             "are looked at all the same, and the instrument stays in its safe state.",
     .flags = COMMAND_LONG | COMMAND_MOVES,
     .run = commands_state_bringup},
    {.name = "safe",
     .summary = "stop the motors, end the streams, let the servos rest",
     .help = "Goes on when a part fails.",
     .flags = COMMAND_MOVES,
     .run = commands_state_safe},
    {.name = "pan",
     .summary = "turn the cameras, or show where they look",
     .help = "pan both 3.97 -3.97 lets both look at a point 1.8 m in front of a base of 250 mm. "
             "Waits until they rest.",
     .arguments = pan_arguments,
     .argument_count = COUNT(pan_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES,
     .run = commands_aim_pan},
    {.name = "zoom",
     .summary = "set the zoom, or show it",
     .help = "Moves end from below, so that backlash does not count. Waits until the lens is "
             "there.",
     .arguments = position_arguments,
     .argument_count = COUNT(position_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES,
     .run = commands_aim_zoom},
    {.name = "focus",
     .summary = "set the focus, or show it",
     .help = "As zoom.",
     .arguments = position_arguments,
     .argument_count = COUNT(position_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES,
     .run = commands_aim_focus},
    {.name = "iris",
     .summary = "set the iris, or show it",
     .help = "As zoom.",
     .arguments = position_arguments,
     .argument_count = COUNT(position_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES,
     .run = commands_aim_iris},
    {.name = "exposure",
     .summary = "set the exposure time, or show it",
     .help = KEPT_HELP,
     .arguments = exposure_arguments,
     .argument_count = COUNT(exposure_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_MOVES,
     .run = commands_camera_exposure},
    {.name = "gain",
     .summary = "set the gain, or show it",
     .help = KEPT_HELP,
     .arguments = gain_arguments,
     .argument_count = COUNT(gain_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_MOVES,
     .run = commands_camera_gain},
    {.name = "window",
     .summary = "set the part of the sensors that frames show, or show its size",
     .help =
         "The part is the middle one. What is shown is the size of the frames. Sensors behind a "
         "bridge have 2048 x 1536 px, and take multiples of 2 * SKIP; other cameras take the "
         "sizes that they have, without SKIP.",
     .arguments = window_arguments,
     .argument_count = COUNT(window_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_MOVES,
     .run = commands_camera_window},
    {.name = "registers",
     .summary = "read registers of the bridge or of a sensor",
     .help = "registers bridge status; registers left 0x09. Reading changes nothing.",
     .arguments = registers_arguments,
     .argument_count = COUNT(registers_arguments),
     .flags = COMMAND_NEEDS_RIG,
     .run = commands_registers_run},
    {.name = "wait",
     .summary = "let time pass for the instrument",
     .help = "In a simulation without wall time nothing else lets time pass but what commands "
             "wait for.",
     .arguments = wait_arguments,
     .argument_count = COUNT(wait_arguments),
     .flags = COMMAND_LONG,
     .run = commands_state_wait},
};

const struct command *command_rig_table(size_t *count) {
    *count = COUNT(commands);
    INVARIANT(*count > 0);
    return commands;
}
