// SPDX-License-Identifier: Apache-2.0
// The table of the rig's own commands. It is the only source of their help texts.
#include <math.h>

#include "console/commands.h"
#include "core/invariant.h"
#include "rig/registers.h"
#include "rig/rig.h"

#define COUNT(list) ((unsigned)(sizeof(list) / sizeof(list)[0]))

#define SIDE_OPTION                                                        \
    {                                                                      \
        .name = "side", .kind = COMMAND_CHOICE, .choices = COMMANDS_SIDES, \
        .help = "camera; default: both"                                    \
    }

#define REGION_OPTION(usual)                                                                  \
    {                                                                                         \
        .name = "region", .kind = COMMAND_INTEGER, .unit = "px", .min = 0, .max = UINT16_MAX, \
        .count = 4, .separator = ',', .value_name = "X,Y,W,H",                                \
        .help =                                                                               \
            "part of the sensor to look at: column and row of its corner, "                   \
            "width, height; default: " usual                                                  \
    }

#define ANGLE_VALUE .kind = COMMAND_NUMBER, .unit = "deg", .min = -180, .max = 180

static const struct command_argument pan_arguments[] = {
    {.name = "ANGLE",
     ANGLE_VALUE,
     .optional = true,
     .help = "angle from the middle, positive to the right, within the settings rig.pan_min and "
             "rig.pan_max; without it the angle is shown"},
    SIDE_OPTION,
    {.name = "right",
     ANGLE_VALUE,
     .value_name = "ANGLE",
     .help = "angle of the right camera; default: that of the left"},
};

// The other units and words that an axis accepts.
#define POSITION_ARGUMENT(accepts, words, others)                                                  \
    {                                                                                              \
        .name = "POSITION", .kind = COMMAND_INTEGER, .unit = "counts", .min = -1000000,            \
        .max = 1000000, .optional = true, .units = (accepts), .choices = (words),                  \
        .help =                                                                                    \
            "position in counts of the lens controller, within the limits of the lens, or " others \
            "; without it position and limits are shown"                                           \
    }

#define RIGHT_OPTION(accepts, words)                                                       \
    {                                                                                      \
        .name = "right", .kind = COMMAND_INTEGER, .unit = "counts", .min = -1000000,       \
        .max = 1000000, .units = (accepts), .choices = (words), .value_name = "POSITION",  \
        .help = "position of the right lens, both move at once; default: that of the left" \
    }

#define MM_VALUE(least, most) .kind = COMMAND_NUMBER, .unit = "mm", .min = (least), .max = (most)

#define SHARP_OPTION(text)                                                    \
    {                                                                         \
        .name = "sharp", MM_VALUE(1, INFINITY), .count = 2, .separator = ':', \
        .value_name = "NEAR:FAR", .help = text                                \
    }

// In the order of enum commands_zoom_argument.
static const struct command_argument zoom_arguments[] = {
    POSITION_ARGUMENT(COMMANDS_ZOOM_UNITS, NULL, "magnification (5x) or focal length (40 mm)"),
    SIDE_OPTION,
    RIGHT_OPTION(COMMANDS_ZOOM_UNITS, NULL),
    {.name = "density",
     .kind = COMMAND_NUMBER,
     .unit = "px/mm^2",
     .min = 1e-6,
     .max = 1e6,
     .help = "the zoom at which 1 mm^2 at the distance has so many px in each frame, at least"},
    {.name = "fit",
     MM_VALUE(1, 1e6),
     .value_name = "WIDTH",
     .help = "the zoom at which both cameras see this width at the distance"},
    {.name = "distance",
     MM_VALUE(100, 1e6),
     .help = "for density and fit, from the middle between the cameras, which focus there too; "
             "default: that of the last autofocus. Alone: what the present zoom is good for there"},
    SHARP_OPTION("range to state the iris for; default: the range that the present iris has sharp"),
    {.name = "plan",
     .kind = COMMAND_FLAG,
     .help = "with density or fit: states what it would give, moves nothing"},
};

static const struct command_argument focus_arguments[] = {
    POSITION_ARGUMENT(COMMANDS_FOCUS_UNITS, "infinity", "distance from the lens (1800 mm)"),
    SIDE_OPTION,
    RIGHT_OPTION(COMMANDS_FOCUS_UNITS, "infinity"),
};

static const struct command_argument iris_arguments[] = {
    POSITION_ARGUMENT(COMMANDS_IRIS_UNITS, "learn", "f-number (f/8)"),
    SIDE_OPTION,
    RIGHT_OPTION(COMMANDS_IRIS_UNITS, NULL),
    SHARP_OPTION("closes the iris as far as this range of distances from the lens needs at the "
                 "present zoom and focus, and no further: up to 1 px of blur at its ends, or until "
                 "diffraction blurs as much. The exposure follows"),
};

static const struct command_argument lens_arguments[] = {
    {.name = "ACTION",
     .kind = COMMAND_CHOICE,
     .choices = COMMANDS_LENS_ACTIONS,
     .help = "status: what each axis means in mm, f-numbers and blur; learned: the tables, in the "
             "form of the options; forget: empties the tables, for example after a lens was "
             "changed"},
    SIDE_OPTION,
    {.name = "focus",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = 480,
     .value_name = "TABLE",
     .help = "with learned: replaces the zoom-to-focus table, ZOOM:DEVIATION:SIGMA:TIMES,..., "
             "counts"},
    {.name = "iris",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = 480,
     .value_name = "TABLE",
     .help = "with learned: replaces the table of the iris, IRIS:RATIO:SIGMA:TIMES,..., f-number "
             "relative to open"},
    {.name = "object",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = 40,
     .value_name = "FOCUS:SIGMA",
     .help = "with learned: replaces the object last focused on, counts of a nominal lens"},
};

#define VALUE_HELP                                                                      \
    "Shows the value in effect. \"not set\": not changed since the bring-up; a camera " \
    "with its own port then keeps its previous value."

static const struct command_argument exposure_arguments[] = {
    {.name = "TIME",
     .kind = COMMAND_INTEGER,
     .unit = "us",
     .min = 1,
     .max = RIG_EXPOSURE_MAX_US,
     .optional = true,
     .help = "the nearest possible value is used, but a camera with its own port rejects values "
             "outside its range; without it the value is shown"},
    SIDE_OPTION,
};

static const struct command_argument gain_arguments[] = {
    {.name = "FACTOR",
     .kind = COMMAND_NUMBER,
     .min = 1,
     .max = 128,
     .units = "x",
     .optional = true,
     .help = "factor, 1 is the camera's minimum; the nearest possible value is used; without it "
             "the value is shown"},
    SIDE_OPTION,
};

static const struct command_argument window_arguments[] = {
    {.name = "WIDTH",
     .kind = COMMAND_INTEGER,
     .unit = "px",
     .min = 16,
     .max = 8192,
     .optional = true,
     .help = "width of the window; without it the size is shown"},
    {.name = "HEIGHT",
     .kind = COMMAND_INTEGER,
     .unit = "px",
     .min = 16,
     .max = 8192,
     .optional = true,
     .help = "height of the window"},
    {.name = "skip",
     .kind = COMMAND_INTEGER,
     .min = 1,
     .max = 8,
     .help = "use every N-th pixel in both directions; default: 1"},
    {.name = "column",
     .kind = COMMAND_INTEGER,
     .unit = "px",
     .min = 0,
     .max = MT9T001_WIDTH_PX,
     .help = "first column of the window on the sensor; default: centred"},
    {.name = "row",
     .kind = COMMAND_INTEGER,
     .unit = "px",
     .min = 0,
     .max = MT9T001_HEIGHT_PX,
     .help = "first row of the window on the sensor; default: centred"},
    SIDE_OPTION,
};

static const struct command_argument autofocus_arguments[] = {
    SIDE_OPTION,
    REGION_OPTION("100 x 100 px in the middle; at least 32 x 32 px"),
    {.name = "measure",
     .kind = COMMAND_CHOICE,
     .choices = "variance normalized tenengrad laplacian",
     .help = "what counts as sharp; default: variance"},
    {.name = "prefer",
     .kind = COMMAND_CHOICE,
     .choices = "stronger near far",
     .help = "which of two distances to focus on; default: stronger"},
    {.name = "whole",
     .kind = COMMAND_FLAG,
     .help = "search the whole range, whatever was learned before"},
    {.name = "curve",
     .kind = COMMAND_FLAG,
     .help = "only sweep the whole range, then return to where the focus was"},
};

static const struct command_argument autoexpose_arguments[] = {
    SIDE_OPTION,
    REGION_OPTION("the whole window; at least 16 x 16 px"),
    {.name = "target",
     .kind = COMMAND_NUMBER,
     .unit = "%",
     .min = 1,
     .max = 90,
     .value_name = "PERCENT",
     .help = "mean of green in the range from black to full scale; default: 50"},
    {.name = "whites",
     .kind = COMMAND_FLAG,
     .help = "the brightest 1 % stays at or below 80 %: for the white fields of a calibration "
             "board; default: no"},
    {.name = "iris",
     .kind = COMMAND_FLAG,
     .help = "whether the iris may move, if nothing else is left; default: yes"},
};

static const struct command_argument registers_arguments[] = {
    {.name = "WHERE",
     .kind = COMMAND_CHOICE,
     .choices = REGISTERS_DEVICE_NAMES,
     .help = "device: the FPGA bridge, or the sensor of a camera"},
    {.name = "NAME",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = 40,
     .optional = true,
     .help = "name or index of a register; without it all named registers are shown",
     .candidates = commands_registers_candidates},
};

static const struct command_argument wait_arguments[] = {
    {.name = "TIME",
     .kind = COMMAND_NUMBER,
     .unit = "s",
     .min = 0,
     .max = 100000,
     .help = "time on the instrument's clock"},
};

static const struct command commands[] = {
    {.name = "status",
     .summary = "show settings, angles and lens positions",
     .help = "Angles and lens positions are read from the hardware: a position is the mean of four "
             "readings, and its sigma the standard error.",
     .flags = COMMAND_GROUP_LOOK | COMMAND_DAILY,
     .run = commands_state_status},
    {.name = "health",
     .summary = "check every part, and show counters",
     .help = "Checks every part without moving any. In the safe state it shows the reason, and the "
             "state of the parts before. The error is that of the first failed part.",
     .flags = COMMAND_GROUP_LOOK,
     .run = commands_state_health},
    {.name = "selftest",
     .summary = "test all parts and the frame path without moving anything",
     .help = "In addition to the checks of health, the bridge sends a test picture through the "
             "frame path, which must arrive bit for bit.",
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG,
     .run = commands_selftest_run},
    {.name = COMMANDS_BRINGUP,
     .summary = "find and set up every part; also after a failure",
     .help = "Servos stay where they are until the first pan. If a part is missing, the others are "
             "still checked, and the instrument stays in its safe state.",
     .flags = COMMAND_LONG | COMMAND_MOVES | COMMAND_GROUP_MOVE | COMMAND_DAILY,
     .run = commands_state_bringup},
    {.name = "safe",
     .summary = "stop the motors and streams, and switch the servo pulses off",
     .help = "Continues if a part fails.",
     .flags = COMMAND_MOVES | COMMAND_GROUP_MOVE,
     .run = commands_state_safe},
    {.name = "pan",
     .summary = "turn the cameras, or show their angles",
     .help = "Example: pan 3.97 right=-3.97 points both cameras at an object 1.8 m in front of a "
             "base of 250 mm. Waits until the cameras have stopped.",
     .arguments = pan_arguments,
     .argument_count = COUNT(pan_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES | COMMAND_GROUP_MOVE,
     .run = commands_aim_pan},
    {.name = "zoom",
     .summary = "set or show the zoom",
     .help = "Examples: zoom 5x; zoom 40 mm; zoom 540; zoom fit=360 distance=1800. Moves end from "
             "the same side, so that backlash does not matter. Waits until the lens has arrived. "
             "density and fit need a saved calibration of all zooms (\"calibration set FILE\").",
     .arguments = zoom_arguments,
     .argument_count = COUNT(zoom_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES | COMMAND_GROUP_MOVE | COMMAND_DAILY,
     .run = commands_axis_zoom},
    {.name = "focus",
     .summary = "set or show the focus",
     .help =
         "Examples: focus 1800 mm; focus infinity; focus 544. As zoom. Distances are those of "
         "the lens's data sheet (rig.focus_nearest), corrected by what was learned. A camera with "
         "a focus control of its own has steps instead, larger ones nearer.",
     .arguments = focus_arguments,
     .argument_count = COUNT(focus_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES | COMMAND_GROUP_MOVE,
     .run = commands_focus_run},
    {.name = "iris",
     .summary = "set or show the iris, or close it for a depth of field",
     .help =
         "Examples: iris f/8; iris 480; iris sharp=1750:1850. As zoom. Only sharp= changes the "
         "exposure. \"iris learn\" measures the f-numbers of all positions, from the brightness "
         "of a scene in constant light, and brings the iris back to where it was; it takes a "
         "minute for each lens.",
     .arguments = iris_arguments,
     .argument_count = COUNT(iris_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES | COMMAND_GROUP_LIGHT,
     .run = commands_axis_iris},
    {.name = "autofocus",
     .summary = "find the focus",
     .help = "Sweeps the focus while small frames of a region arrive, approaches the sharpest "
             "position from one side, and checks it there. Where a focus was found before at this "
             "zoom, only its neighbourhood is searched. The verdict is \"focused\", \"sharp "
             "everywhere\" or \"two peaks\" (two distances; the sharper one is taken); the "
             "command fails with \"no contrast\", \"peak at end of range\", \"misled by "
             "lights\" and \"scene changed\". Exposure, gain and window are afterwards as before.",
     .arguments = autofocus_arguments,
     .argument_count = COUNT(autofocus_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES | COMMAND_GROUP_MOVE | COMMAND_DAILY,
     .run = commands_focus_auto},
    {.name = "lens",
     .summary = "show what the lens positions mean, and what was learned",
     .help = "Distances, f-numbers and blur come from the settings rig.focal_length_wide and its "
             "neighbours, and from what autofocus and \"iris learn\" have found for each lens. "
             "\"settings save\" saves the tables.",
     .arguments = lens_arguments,
     .argument_count = COUNT(lens_arguments),
     .flags = COMMAND_LONG | COMMAND_GROUP_LOOK,
     .run = commands_lens_run},
    {.name = "exposure",
     .summary = "set or show the exposure time",
     .help = VALUE_HELP,
     .arguments = exposure_arguments,
     .argument_count = COUNT(exposure_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_MOVES | COMMAND_GROUP_LIGHT,
     .run = commands_exposure_run},
    {.name = "gain",
     .summary = "set or show the gain",
     .help = VALUE_HELP,
     .arguments = gain_arguments,
     .argument_count = COUNT(gain_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_MOVES | COMMAND_GROUP_LIGHT,
     .run = commands_exposure_gain},
    {.name = "autoexpose",
     .summary = "find exposure and gain",
     .help =
         "Example: autoexpose region=974,718,100,100. Changes the exposure first, to multiples "
         "of half the mains period where possible (setting rig.mains) and no longer than pairs "
         "allow (rig.skew_limit), then the gain up to 8, and the iris last. At most 0.1 % of "
         "the pixels saturate. The right camera becomes as bright as the left one in the field "
         "that both see: the region, or without one the middle half of the field. The reply "
         "says what limits the brightness: the target, highlights, whites, or too little light. "
         "After an error or a cancellation exposure and gain are as before.",
     .arguments = autoexpose_arguments,
     .argument_count = COUNT(autoexpose_arguments),
     .flags =
         COMMAND_NEEDS_RIG | COMMAND_LONG | COMMAND_MOVES | COMMAND_GROUP_LIGHT | COMMAND_DAILY,
     .run = commands_exposure_auto},
    {.name = "window",
     .summary = "set the window of the sensors, or show the frame size",
     .help =
         "The size of the frames is shown, and where the windows begin. Sensors behind a bridge "
         "have 2048 x 1536 px, and accept multiples of 2 * skip at any even column and row; both "
         "windows have the same size, so that of one side can only be moved. Texture finer "
         "than skip aliases, and matches worse. Other cameras accept the sizes that they support, "
         "without skip, column, row and side.",
     .arguments = window_arguments,
     .argument_count = COUNT(window_arguments),
     .flags = COMMAND_NEEDS_RIG | COMMAND_MOVES | COMMAND_GROUP_LOOK,
     .run = commands_window_run},
    {.name = "registers",
     .summary = "read registers of the bridge or of a sensor",
     .help = "Examples: registers bridge status; registers left 0x09. Reading changes nothing.",
     .arguments = registers_arguments,
     .argument_count = COUNT(registers_arguments),
     .flags = COMMAND_NEEDS_RIG,
     .run = commands_registers_run},
    {.name = "wait",
     .summary = "wait on the instrument's clock",
     .help = "In a simulation without wall time, time passes only while commands wait.",
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
