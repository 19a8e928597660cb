// SPDX-License-Identifier: Apache-2.0
#include "console/measure/measure_request.h"

#include <string.h>

const char *measure_request_make(const struct command_value *values,
                                 struct measure_request *request) {
    static const enum measure_wish wishes[] = {[MEASURE_REQUEST_FIT] = MEASURE_WISH_FIT,
                                               [MEASURE_REQUEST_DENSITY] = MEASURE_WISH_DENSITY,
                                               [MEASURE_REQUEST_ZOOM] = MEASURE_WISH_ZOOM};
    memset(request, 0, sizeof *request);
    for (int i = MEASURE_REQUEST_FIT; i <= MEASURE_REQUEST_ZOOM; i++) {
        if (values[i].given && request->wish != MEASURE_WISH_SUBJECT) {
            return "fit, density and zoom exclude each other (give one)";
        }
        if (values[i].given) {
            request->wish = wishes[i];
            request->value = values[i].number;
        }
    }
    request->has_place = values[MEASURE_REQUEST_AT].given;
    for (int i = 0; i < 2 && request->has_place; i++) {
        request->place_px[i] = (int)values[MEASURE_REQUEST_AT].numbers[i];
    }
    const struct command_value *near = &values[MEASURE_REQUEST_NEAR];
    const struct command_value *far = &values[MEASURE_REQUEST_FAR];
    request->near_mm = near->given ? near->number : 0;
    request->far_mm = far->given ? far->number : 0;
    request->quick = command_is_set(&values[MEASURE_REQUEST_QUICK]);
    return near->given != far->given || (near->given && request->near_mm >= request->far_mm)
               ? "near and far need each other, near the smaller one (as in near=1700 far=2000)"
               : NULL;
}

bool measure_request_needs_zoom(const struct measure_request *request) {
    return request->wish != MEASURE_WISH_SUBJECT || request->has_place;
}

// The value of a wish with six digits.
static void add_value(struct command_text *text, double value) {
    int decimals = 5;
    for (double rest = value; rest >= 10 && decimals > 0; rest /= 10) {
        decimals--;
    }
    for (double rest = value; rest < 1 && decimals < COMMAND_TEXT_DECIMALS_MAX; rest *= 10) {
        decimals++;
    }
    command_text_add_number(text, value, decimals);
}

void measure_request_add(struct command_text *text, const struct measure_request *request) {
    static const char *const words[] = {[MEASURE_WISH_SUBJECT] = "subject",
                                        [MEASURE_WISH_FIT] = "fit=",
                                        [MEASURE_WISH_DENSITY] = "density=",
                                        [MEASURE_WISH_ZOOM] = "zoom="};
    command_text_add(text, words[request->wish]);
    if (request->wish != MEASURE_WISH_SUBJECT) {
        add_value(text, request->value);
    }
    if (request->has_place) {
        command_text_print(text, " at=%d,%d", request->place_px[0], request->place_px[1]);
    }
    if (request->far_mm > 0) {
        command_text_print(text, " near=%.3f far=%.3f", request->near_mm, request->far_mm);
    }
    if (request->quick) {
        command_text_add(text, " quick=yes");
    }
}

const struct command_argument measure_request_arguments[MEASURE_REQUEST_ARGUMENTS] = {
    {.name = "NAME",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = 60,
     .help = "of the new session: letters, digits and - _ . + = , @"},
    {.name = "fit",
     .kind = COMMAND_NUMBER,
     .min = 1,
     .max = 1e6,
     .unit = "mm",
     .help = "width that both cameras see at the subject; default: 1.25 times its own"},
    {.name = "density",
     .kind = COMMAND_NUMBER,
     .min = 1e-3,
     .max = 1e6,
     .value_name = "PX_PER_MM2",
     .help = "pixels for each square millimetre of the subject, in place of fit"},
    {.name = "zoom",
     .kind = COMMAND_NUMBER,
     .min = 1,
     .max = 1000,
     .units = "x",
     .help = "magnification, in place of fit"},
    {.name = "at",
     .kind = COMMAND_INTEGER,
     .min = 0,
     .max = UINT16_MAX,
     .unit = "px",
     .count = 2,
     .separator = ',',
     .value_name = "X,Y",
     .help = "pixel of the last view's picture, in either half, that shows the subject; default: "
             "the middle"},
    {.name = "near",
     .kind = COMMAND_NUMBER,
     .min = 1,
     .max = 1e6,
     .unit = "mm",
     .help = "nearest depth of the subject; default: as the wide view shows it"},
    {.name = "far",
     .kind = COMMAND_NUMBER,
     .min = 100,
     .max = 1e6,
     .unit = "mm",
     .help = "farthest depth"},
    {.name = "quick", .kind = COMMAND_FLAG, .help = "one look, and no pair at a second zoom"},
    {.name = "plan",
     .kind = COMMAND_FLAG,
     .help = "only show the steps; nothing moves. The subject is taken to be in the middle of near "
             "and far, or 2 m ahead"},
};
