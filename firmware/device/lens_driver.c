// SPDX-License-Identifier: Apache-2.0
#include "device/lens_driver.h"

#include "core/error.h"
#include "core/invariant.h"

enum { ZOOM = 1 << LENS_ZOOM, FOCUS = 1 << LENS_FOCUS, IRIS = 1 << LENS_IRIS };

// The drivers' functions: each in its device/lens_NAME.c.
extern const struct lens_operations lens_v3lc_operations, lens_arducam_operations;

// Both take about 7 s from end to end (assumed). Of the V1LC's range the figures are the same
// shares, rounded up. 10x zoom: ln(10) / (max - min) a count.
//
// They approach their targets from above, so that there is room for it at the lower end: at 300 the
// zoom is 1x, the iris is closed, and the focus is at its far end, and 4 counts of play are 6.5 %
// of the focal length or of the diameter of the iris (13 % of the light) if these are linear in the
// position; targets there are common. At 850 there is no room instead: 4 counts are 0.7 % of the
// focal length at 10x, and all 10 of the profile with the tolerance 2 %; of an open iris, 1.3 % of
// the light.
#define V3LC_AXIS                                                                                 \
    {                                                                                             \
        .min = 300, .max = 850, .counts_per_s = 80, .backlash_counts = 10, .tolerance_counts = 4, \
        .approach = LENS_FROM_ABOVE                                                               \
    }
#define V1LC_AXIS                                                                               \
    {                                                                                           \
        .min = 44, .max = 180, .counts_per_s = 19, .backlash_counts = 3, .tolerance_counts = 2, \
        .approach = LENS_FROM_ABOVE                                                             \
    }

static const struct lens_driver drivers[] = {
    {
        .name = "v3lc",
        .help = "Image Labs V3LC: two lenses",
        .lenses = 2,
        .port = LENS_PORT_UART,
        .abilities = {.axes = ZOOM | FOCUS | IRIS, .reads_position = true},
        .position_max = 999,
        .settings = {.bits_per_s = 9600,
                     .axis = {V3LC_AXIS, V3LC_AXIS, V3LC_AXIS},
                     .repeatability_counts = 4,
                     .zoom_ppm = 4187},
        .operations = &lens_v3lc_operations,
    },
    {
        .name = "v1lc",
        .help = "Image Labs V1LC: one lens, on the left; the iris is not driven, because its "
                "readings are random",
        .lenses = 1,
        .port = LENS_PORT_UART,
        .abilities = {.axes = ZOOM | FOCUS, .reads_position = true},
        .position_max = 999,
        .settings = {.bits_per_s = 9600,
                     .axis = {V1LC_AXIS, V1LC_AXIS, V1LC_AXIS},
                     .repeatability_counts = 1,
                     .zoom_ppm = 16931},
        .operations = &lens_v3lc_operations,
    },
    {
        .name = "arducam",
        .help = "Arducam zoom lens controller: one lens, on the left, without position sensors",
        .lenses = 1,
        .port = LENS_PORT_I2C,
        .abilities = {.axes = ZOOM | FOCUS, .reports_moving = true},
        .position_max = 20000,
        // Within 5 s from end to end; play and lens (10x) are assumed. From below, as which end is
        // the wide one is not known.
        .settings = {.address = 0x0C,
                     .axis = {{.min = 3000,
                               .max = 20000,
                               .counts_per_s = 3400,
                               .backlash_counts = 100,
                               .tolerance_counts = 1},
                              {.min = 0,
                               .max = 20000,
                               .counts_per_s = 4000,
                               .backlash_counts = 100,
                               .tolerance_counts = 1}},
                     .repeatability_counts = 50,
                     .zoom_ppm = 135},
        .operations = &lens_arducam_operations,
    },
};

const char *const lens_axis_names[LENS_AXES] = {"zoom", "focus", "iris"};

const struct lens_driver *lens_drivers(size_t *count) {
    *count = sizeof drivers / sizeof drivers[0];
    return drivers;
}

static bool is_same(const char *a, const char *b) {
    while (*a != '\0' && *a == *b) {
        a++;
        b++;
    }
    return *a == *b;
}

const struct lens_driver *lens_driver_named(const char *name) {
    for (size_t i = 0; i < sizeof drivers / sizeof drivers[0]; i++) {
        if (is_same(drivers[i].name, name)) {
            return &drivers[i];
        }
    }
    return NULL;
}

void lens_controller_init(struct lens_controller *self, const struct lens_driver *driver,
                          const struct lens_settings *settings, const struct lens_ports *ports) {
    INVARIANT(driver->lenses >= 1 && driver->lenses <= LENS_LENSES_MAX);
    INVARIANT(ports->clock != NULL);
    INVARIANT(driver->port == LENS_PORT_UART ? ports->uart != NULL : ports->i2c != NULL);
    *self = (struct lens_controller){.driver = driver, .settings = settings, .ports = *ports};
}

// The controller of a lens that exists.
static struct lens_controller *controller_of(const struct lens_drive *lens) {
    INVARIANT(lens->controller != NULL && lens->number < lens->controller->driver->lenses);
    return lens->controller;
}

bool lens_has_axis(const struct lens_drive *lens, enum lens_axis axis) {
    const unsigned axes = controller_of(lens)->driver->abilities.axes;
    return (unsigned)axis < LENS_AXES && (axes >> axis & 1) != 0;
}

int lens_open(const struct lens_drive *lens, uint64_t deadline_us) {
    struct lens_controller *controller = controller_of(lens);
    return controller->driver->operations->open(controller, lens->number, deadline_us);
}

int lens_go(const struct lens_drive *lens, enum lens_axis axis, int32_t position,
            uint64_t deadline_us) {
    struct lens_controller *controller = controller_of(lens);
    if (!lens_has_axis(lens, axis)) {
        return ERROR_NOT_CONNECTED;
    }
    const struct lens_axis_settings *settings = &controller->settings->axis[axis];
    if (position < settings->min || position > settings->max) {
        return ERROR_RANGE;
    }
    return controller->driver->operations->go(controller, lens->number, axis, position,
                                              deadline_us);
}

int lens_stop(const struct lens_drive *lens, uint64_t deadline_us) {
    struct lens_controller *controller = controller_of(lens);
    const struct lens_operations *operations = controller->driver->operations;
    INVARIANT((operations->stop != NULL) == controller->driver->abilities.stops);
    return operations->stop != NULL ? operations->stop(controller, lens->number, deadline_us)
                                    : ERROR_UNSUPPORTED;
}

int lens_read(const struct lens_drive *lens, uint64_t deadline_us,
              struct lens_reading readings[LENS_AXES]) {
    struct lens_controller *controller = controller_of(lens);
    return controller->driver->operations->read(controller, lens->number, deadline_us, readings);
}

uint64_t lens_last_rx(const struct lens_drive *lens) {
    const struct lens_controller *controller = controller_of(lens);
    return controller->driver->operations->last_rx(controller);
}
