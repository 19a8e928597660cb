// SPDX-License-Identifier: Apache-2.0
#include "daemon/measure/measure_request.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/invariant.h"
#include "core/math.h"
#include "daemon/session/session_notes.h"

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
               ? "near and far need each other, and near is less than far (near=1700 far=2000)"
               : NULL;
}

static void __attribute__((format(printf, 2, 3)))
append(char text[SESSION_TEXT_MAX + 1], const char *format, ...) {
    const size_t used = strlen(text), room = SESSION_TEXT_MAX + 1 - used;
    va_list values;
    va_start(values, format);
    const int length = vsnprintf(text + used, room, format, values);
    va_end(values);
    INVARIANT(length >= 0 && (size_t)length < room);
}

void measure_request_print(const struct measure_request *request, const char *before,
                           char text[SESSION_TEXT_MAX + 1]) {
    static const char *const words[] = {[MEASURE_WISH_SUBJECT] = "subject",
                                        [MEASURE_WISH_FIT] = "fit",
                                        [MEASURE_WISH_DENSITY] = "density",
                                        [MEASURE_WISH_ZOOM] = "zoom"};
    text[0] = '\0';
    append(text, "%s%s", before, words[request->wish]);
    if (request->wish != MEASURE_WISH_SUBJECT) {
        append(text, "=%.6g", request->value);
    }
    if (request->has_place) {
        append(text, " at=%d,%d", request->place_px[0], request->place_px[1]);
    }
    if (request->far_mm > 0) {
        append(text, " near=%.3f far=%.3f", request->near_mm, request->far_mm);
    }
    if (request->quick) {
        append(text, " quick=yes");
    }
}

void measure_request_surface(const struct measure_step *step, struct reconstruct_request *request) {
    static const double um_per_mm = 1e3;
    *request = reconstruct_request_defaults();
    request->pair = (int)step->pair;
    request->with_pair = (int)step->with_pair;
    request->scale = step->scale;
    request->depth_mm[0] = math_round(step->near_mm * um_per_mm) / um_per_mm;
    request->depth_mm[1] = math_round(step->far_mm * um_per_mm) / um_per_mm;
    (void)reconstruct_request_check_search(request);  // they are in order
}

void measure_request_print_surface(const struct reconstruct_request *request,
                                   char text[SESSION_TEXT_MAX + 1]) {
    text[0] = '\0';
    append(text, SESSION_NOTE_SURFACE "pair=%d", request->pair);
    if (request->with_pair > 0) {
        append(text, " with-pair=%d", request->with_pair);
    }
    if (request->depth_mm[1] > 0) {
        append(text, " near=%.3f far=%.3f", request->depth_mm[0], request->depth_mm[1]);
    }
    if (request->scale < 1) {
        append(text, " scale=%.6g", request->scale);
    }
    if (request->accept_mismatch) {
        append(text, " accept-mismatch=yes");
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
