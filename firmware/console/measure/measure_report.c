// SPDX-License-Identifier: Apache-2.0
#include "console/measure/measure_report.h"

#include <string.h>

#include "console/commands.h"
#include "console/measure/measure_request.h"
#include "console/measure/measure_share.h"
#include "console/measure_text.h"
#include "core/error.h"
#include "measure/measure_tuning.h"

enum {
    SENTENCE_BYTES = 1024,
    WISH_BYTES = 160,
    KEY_BYTES = 40,
    SESSION_SHOWN = 60,
    WHY_SHOWN = 600
};

struct measure_report_step *measure_report_add(struct measure_report *self,
                                               const struct measure_step *step, double at_s) {
    if (self->steps == MEASURE_REPORT_STEPS_MAX) {
        return NULL;
    }
    struct measure_report_step *added = &self->step[self->steps++];
    struct command_text text = command_text_begin(added->text, sizeof added->text);
    measure_text_add_step(&text, step);
    added->at_s = at_s;
    return added;
}

void measure_report_pair(struct measure_report *self, enum measure_phase phase,
                         const struct pair_frame *left, double f_number) {
    self->captures++;
    if (phase != MEASURE_PAIR && phase != MEASURE_MERGED) {
        return;
    }
    self->f_number = f_number;
    const int single = left->exposure_us != 0 ? 1 : 0;
    self->exposures = left->parts > 0 ? left->parts : single;
    for (int i = 0; i < self->exposures; i++) {
        self->exposure_us[i] = left->parts > 0 ? left->part[i].exposure_us : left->exposure_us;
    }
}

void measure_report_surface(struct measure_report *self, const struct measure_surface *surface,
                            const struct surface_figures_depths *depths, struct arena *arena,
                            struct measure_event *event) {
    const struct reconstruct_result *result = surface->result;
    struct measure_share share;
    self->points = surface_figures_measured_count(result);
    for (int reason = 0; reason < REASON_COUNT; reason++) {
        self->reason_count[reason] = result->reason_count[reason];
    }
    if (!measure_share_of(result, depths, arena, &share) || share.measured == 0) {
        share.spread = surface->spread;  // the subject is not there: what is, then
    } else {
        event->surface.near_mm = share.spread.depth_mm[0];
        event->surface.far_mm = share.spread.depth_mm[2];
    }
    memcpy(self->depth_mm, share.spread.depth_mm, sizeof self->depth_mm);
    event->surface.depth_mm = share.spread.depth_mm[1];
    event->surface.sigma_mm = share.spread.sigma_mm[1];
    event->surface.common_mm = surface->common_mm;
    if (surface->spread.depth_mm[1] > 0) {
        const double nearer = event->surface.depth_mm / surface->spread.depth_mm[1];
        event->surface.common_mm *= nearer * nearer;
    }
    const double pixels = (double)share.measured + share.missed;
    event->surface.share = pixels > 0 ? share.measured / pixels : 0;
    event->surface.hole = event->surface.share < MEASURE_SHARE_WHOLE && share.hole != REASON_VALID
                              ? reason_text((int)share.hole)
                              : NULL;
    event->surface.with_used = surface->with_used;
    event->misfit = surface->misfit;
    event->unlike = surface->doubt != NULL;
    struct command_text doubt = command_text_begin(self->doubt, sizeof self->doubt);
    command_text_add(&doubt, event->unlike ? surface->doubt : "");
}

void measure_report_no_surface(const struct reconstruct_result *result,
                               const struct measure_request *request, struct command_text *text) {
    const uint32_t *count = result->reason_count;
    const uint32_t unmatched =
        count[REASON_OCCLUDED] + count[REASON_NO_TEXTURE] + count[REASON_AMBIGUOUS];
    if (count[REASON_OUT_OF_RANGE] > unmatched) {
        command_text_join(text, "nothing within the depths searched (state ",
                          request->far_mm > 0 ? "other " : "", "near and far)");
    } else {
        command_text_add(text,
                         "no texture in view, as what is blank, transparent or a mirror has none "
                         "(give it texture)");
    }
}

void measure_report_no_subject(const struct measure_request *request, struct command_text *text) {
    command_text_join(text, "nothing with texture ",
                      request->has_place ? "at that place" : "in the middle of the view");
    if (request->far_mm > 0) {
        command_text_print(text, ", from %.0f to %.0f mm", request->near_mm, request->far_mm);
    }
    command_text_add(text, " (aim at it, or give it texture)");
}

static void add_part(struct command_text *text, const char *added, size_t most) {
    for (size_t i = 0; i < most && added[i] != '\0'; i++) {
        command_text_print(text, "%s", (const char[]){added[i], '\0'});
    }
}

void measure_report_failure(const struct measure_report *self, const struct measure_result *result,
                            const char *session, const char *why, struct command_text *text) {
    static const char own[] = "measure: ";  // of what is checked for this command, too
    const size_t lead = strncmp(why, own, sizeof own - 1) == 0 ? sizeof own - 1 : 0;
    command_text_join(text, measure_phase_text(result->phase),
                      result->error == ERROR_NO_SURFACE ? ": no surface: " : ": ");
    const char *reason = why[0] != '\0' ? why + lead : error_text(result->error);
    if (result->error == ERROR_CANCELLED) {
        reason = "cancelled";
    }
    add_part(text, reason, WHY_SHOWN);
    if (self->captures > 0 && session != NULL) {
        command_text_add(text, "; ");
        add_part(text, session, SESSION_SHOWN);
        command_text_print(text, " has %u pair%s (\"reconstruct ", self->captures,
                           self->captures > 1 ? "s" : "");
        add_part(text, session, SESSION_SHOWN);
        if (result->phase == MEASURE_SURFACE) {
            command_text_add(text, "\", or on a PC \"vergence measure ");
            add_part(text, session, SESSION_SHOWN);
        }
        command_text_add(text, "\")");
    }
}

// ---- the answer

static void put_known(const struct command_call *call, const char *key, double value, int decimals,
                      const char *unit) {
    if (value > 0) {
        reply_number(call, key, value, decimals, unit);
    }
}

static void put_sharp(const struct command_call *call, const struct measure_result *result) {
    put_known(call, "near_sharp_mm", result->sharp_near_mm, 1, "mm");
    if (result->sharp_far_mm > 0) {
        commands_lens_distance(call, "far_sharp_mm", result->sharp_far_mm);
    }
}

static void put_steps(const struct measure_report *self, const struct command_call *call) {
    reply_group_begin(call, "steps", true);
    for (int i = 0; i < self->steps; i++) {
        const struct measure_report_step *step = &self->step[i];
        reply_group_begin(call, NULL, false);
        reply_text(call, "step", step->text);
        reply_number(call, "at", step->at_s, 1, "s");
        reply_number(call, "seconds", step->taken_s, 1, "s");
        if (step->failed[0] != '\0') {
            reply_text(call, "failed", step->failed);
        }
        reply_group_end(call);
    }
    reply_group_end(call);
}

// "no texture: nothing to match" as no_texture.
static void put_reasons(const struct measure_report *self, const struct command_call *call) {
    reply_group_begin(call, "reasons", false);
    for (int reason = 0; reason < REASON_COUNT; reason++) {
        char key[KEY_BYTES];
        size_t length = 0;
        for (const char *at = reason_text(reason);
             *at != '\0' && *at != ':' && length < sizeof key - 1; at++) {
            key[length++] = *at == ' ' ? '_' : *at;
        }
        key[length] = '\0';
        if (self->reason_count[reason] > 0) {
            reply_number(call, key, self->reason_count[reason], 0, NULL);
        }
    }
    reply_group_end(call);
}

static void put_surface(const struct measure_report *self, const struct command_call *call,
                        const struct measure_result *result) {
    reply_text(call, "result", self->result);
    reply_number(call, "pair", result->pair, 0, NULL);
    if (result->with_pair != 0) {
        reply_number(call, "with_pair", result->with_pair, 0, NULL);
    }
    reply_number(call, "points", self->points, 0, NULL);
    reply_number(call, "measured_percent", 100 * result->share, 1, "%");
    reply_number(call, "distance_mm", result->distance_mm, 1, "mm");
    reply_number(call, "depth_near_mm", self->depth_mm[0], 1, "mm");
    reply_number(call, "depth_far_mm", self->depth_mm[2], 1, "mm");
    reply_number(call, "sigma_point_mm", result->sigma_mm, 3, "mm");
    if (result->common_mm >= 0) {
        reply_number(call, "sigma_common_mm", result->common_mm, 3, "mm");
    }
    if (self->scale < 1) {
        reply_number(call, "scale", self->scale, 3, NULL);
    }
    put_reasons(self, call);
}

static void put_texts(const struct measure_report *self, const struct command_call *call,
                      const struct measure_result *result, const char *why) {
    reply_group_begin(call, "losses", true);
    for (unsigned loss = 0; loss < MEASURE_LOSSES; loss++) {
        if ((result->losses >> loss & 1) != 0) {
            reply_text(call, NULL, measure_loss_text((enum measure_loss)loss));
        }
    }
    reply_group_end(call);
    reply_group_begin(call, "advice", true);
    if (result->advice != MEASURE_ADVICE_NOTHING) {
        reply_text(call, NULL, measure_advice_text(result->advice));
    }
    reply_group_end(call);
    reply_group_begin(call, "notes", true);
    if (self->doubt[0] != '\0') {
        reply_text(call, NULL, self->doubt);
    }
    reply_group_end(call);
    char sentence[SENTENCE_BYTES];
    struct command_text text = command_text_begin(sentence, sizeof sentence);
    measure_text_add_result(&text, result, why);
    reply_text(call, "sentence", sentence);
}

void measure_report_put_plan(const struct measure_report *self, const struct command_call *call,
                             const struct measure_result *result) {
    put_steps(self, call);
    reply_number(call, "seconds", self->seconds, 1, "s");
    put_known(call, "density_px_per_mm2", result->density_per_mm2, 3, "px/mm^2");
    put_known(call, "width_mm", result->width_mm, 1, "mm");
    put_sharp(call, result);
}

void measure_report_put(const struct measure_report *self, const struct command_call *call,
                        const char *name, const char *session,
                        const struct measure_request *request, const struct measure_result *result,
                        const char *why) {
    char wish[WISH_BYTES];
    struct command_text words = command_text_begin(wish, sizeof wish);
    reply_text(call, "name", name);
    if (self->captures > 0 && session != NULL) {
        reply_text(call, "session", session);
    }
    measure_request_add(&words, request);
    reply_text(call, "wish", wish);
    put_steps(self, call);
    reply_number(call, "seconds", self->seconds, 1, "s");
    reply_number(call, "computing_seconds", self->computing_seconds, 1, "s");
    reply_number(call, "captures", self->captures, 0, NULL);
    put_known(call, "density_px_per_mm2", result->density_per_mm2, 3, "px/mm^2");
    put_known(call, "width_mm", result->width_mm, 1, "mm");
    put_sharp(call, result);
    put_known(call, "f_number", self->f_number, 2, "f/");
    if (self->exposures > 0) {
        reply_group_begin(call, "exposures", true);
        for (int i = 0; i < self->exposures; i++) {
            reply_number(call, NULL, self->exposure_us[i], 0, "us");
        }
        reply_group_end(call);
    }
    if (result->error == ERROR_OK) {
        put_surface(self, call, result);
    }
    put_texts(self, call, result, why);
}
