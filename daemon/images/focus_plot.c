// SPDX-License-Identifier: Apache-2.0
#include "daemon/images/focus_plot.h"

#include <math.h>
#include <stdlib.h>

#include "core/invariant.h"

enum {
    WIDTH = 800,
    PANEL_HEIGHT = 300,
    // Margins between the axes and the border of their panel.
    LEFT = 80,
    RIGHT = 20,
    TOP = 50,
    BOTTOM = 50,
    TICKS_MAX = 8,
};

static const char *const leg_names[FOCUS_LEGS] = {"sweep", "pass", "rest"};
static const char *const leg_colours[FOCUS_LEGS] = {"#7f7f7f", "#1f77b4", "#2ca02c"};

/// One panel: from counts and sharpness to the drawing's units.
struct panel {
    FILE *stream;
    const struct focus_plot *plot;
    double top;  // upper edge of the panel in the drawing
    double x_min, x_max, y_max;
};

static double x_of(const struct panel *self, double position) {
    const double part = (position - self->x_min) / (self->x_max - self->x_min);
    return LEFT + part * (WIDTH - LEFT - RIGHT);
}

static double y_of(const struct panel *self, double sharpness) {
    const double part = fmin(fmax(sharpness / self->y_max, 0), 1);
    return self->top + PANEL_HEIGHT - BOTTOM - part * (PANEL_HEIGHT - TOP - BOTTOM);
}

/// 1, 2 or 5 times a power of ten that divides a range into at most TICKS_MAX parts.
static double tick_of(double range) {
    double tick = pow(10, floor(log10(range / TICKS_MAX)));
    const double factors[] = {1, 2, 5, 10};
    for (int i = 0; i < 4; i++) {
        if (range / (tick * factors[i]) <= TICKS_MAX) {
            return tick * factors[i];
        }
    }
    return tick * 10;
}

static void line(const struct panel *self, double x1, double y1, double x2, double y2,
                 const char *style) {
    fprintf(self->stream, "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" %s/>\n", x1, y1,
            x2, y2, style);
}

static void draw_axes(const struct panel *self) {
    const double bottom = self->top + PANEL_HEIGHT - BOTTOM;
    const double tick_x = tick_of(self->x_max - self->x_min), tick_y = tick_of(self->y_max);
    const int decimals = (int)fmax(0, -floor(log10(tick_y * 1.001)));
    for (double x = ceil(self->x_min / tick_x) * tick_x; x <= self->x_max; x += tick_x) {
        line(self, x_of(self, x), self->top + TOP, x_of(self, x), bottom, "stroke=\"#ddd\"");
        fprintf(self->stream, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%g</text>\n",
                x_of(self, x), bottom + 16, x);
    }
    for (double y = 0; y <= self->y_max * 1.0001; y += tick_y) {
        line(self, LEFT, y_of(self, y), WIDTH - RIGHT, y_of(self, y), "stroke=\"#ddd\"");
        fprintf(self->stream, "<text x=\"%d\" y=\"%.1f\" text-anchor=\"end\">%.*f</text>\n",
                LEFT - 6, y_of(self, y) + 4, decimals, y);
    }
    fprintf(self->stream,
            "<text x=\"%d\" y=\"%.1f\" text-anchor=\"middle\">focus ring (counts; larger: nearer)"
            "</text>\n",
            (LEFT + WIDTH - RIGHT) / 2, bottom + 36);
    fprintf(self->stream,
            "<text transform=\"translate(18 %.1f) rotate(-90)\" text-anchor=\"middle\">sharpness "
            "(relative)</text>\n",
            (self->top + TOP + bottom) / 2);
}

static int by_position(const void *a, const void *b) {
    const struct focus_sample *const *first = a, *const *second = b;
    return ((*first)->position > (*second)->position) - ((*first)->position < (*second)->position);
}

/// The curve through the samples of the sweep.
static void draw_sweep(const struct panel *self) {
    const struct focus_curve *curve = &self->plot->search->curve;
    const struct focus_sample *order[FOCUS_SAMPLES_MAX];
    size_t count = 0;
    for (unsigned i = 0; i < curve->count; i++) {
        if (curve->samples[i].leg == FOCUS_LEG_SWEEP) {
            order[count++] = &curve->samples[i];
        }
    }
    qsort(order, count, sizeof order[0], by_position);
    fprintf(self->stream, "<polyline fill=\"none\" stroke=\"%s\" points=\"",
            leg_colours[FOCUS_LEG_SWEEP]);
    for (size_t i = 0; i < count; i++) {
        fprintf(self->stream, "%.1f,%.1f ", x_of(self, order[i]->position),
                y_of(self, order[i]->sharpness[FOCUS_CHANNEL_CHOSEN]));
    }
    fprintf(self->stream, "\"/>\n");
}

static void draw_samples(const struct panel *self) {
    const struct focus_curve *curve = &self->plot->search->curve;
    for (unsigned i = 0; i < curve->count; i++) {
        const struct focus_sample *sample = &curve->samples[i];
        fprintf(self->stream, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2\" fill=\"%s\"/>\n",
                x_of(self, sample->position), y_of(self, sample->sharpness[FOCUS_CHANNEL_CHOSEN]),
                leg_colours[sample->leg]);
    }
}

/// The names of the legs that occur, in their colours.
static void draw_legend(const struct panel *self) {
    const struct focus_curve *curve = &self->plot->search->curve;
    double x = WIDTH - RIGHT;
    for (int leg = FOCUS_LEGS - 1; leg >= 0; leg--) {
        bool occurs = false;
        for (unsigned i = 0; i < curve->count && !occurs; i++) {
            occurs = curve->samples[i].leg == leg;
        }
        if (occurs) {
            fprintf(self->stream,
                    "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\" fill=\"%s\">%s</text>\n", x,
                    self->top + PANEL_HEIGHT - 14, leg_colours[leg], leg_names[leg]);
            x -= 70;
        }
    }
}

static void draw_peak(const struct panel *self, const struct focus_peak *peak, const char *style) {
    if (!(peak->height > 0)) {
        return;
    }
    const double x = x_of(self, peak->position);
    line(self, x, self->top + TOP, x, self->top + PANEL_HEIGHT - BOTTOM, style);
    fprintf(self->stream, "<text x=\"%.1f\" y=\"%.1f\" fill=\"#d62728\">%.1f</text>\n", x + 4,
            self->top + TOP + 12, peak->position);
}

/// Whether what is highest is a peak.
static bool has_peak(const struct focus_result *result) {
    return result->peak.height > 0 && result->verdict != FOCUS_NO_CONTRAST;
}

/// What was found, in words.
static void write_title(const struct panel *self) {
    const struct focus_plot *plot = self->plot;
    const struct focus_result *result = &plot->search->result;
    fprintf(self->stream, "<text x=\"%d\" y=\"%.1f\" font-size=\"15\">%s lens: %s", LEFT,
            self->top + 18, plot->name, focus_search_text(plot->search));
    if (has_peak(result)) {
        fprintf(self->stream, ", peak at %.1f counts, half width %.1f counts",
                result->peak.position, result->peak.half_width);
    }
    if (result->blur_px >= 0) {
        fprintf(self->stream, ", blur %.1f px", result->blur_px);
    }
    fprintf(self->stream, "</text>\n");
    fprintf(self->stream, "<text x=\"%d\" y=\"%.1f\" fill=\"#555\">%s</text>\n", LEFT,
            self->top + 36, plot->about);
}

static void draw_ring(const struct panel *self) {
    const double x = x_of(self, self->plot->search->result.position);
    const double y = self->top + PANEL_HEIGHT - BOTTOM;
    fprintf(self->stream,
            "<path d=\"M%.1f %.1f l-5 9 h10 z\" fill=\"#2ca02c\"><title>the ring is here</title>"
            "</path>\n",
            x, y);
}

static double highest(const struct focus_curve *curve) {
    double max = 0;
    for (unsigned i = 0; i < curve->count; i++) {
        max = fmax(max, curve->samples[i].sharpness[FOCUS_CHANNEL_CHOSEN]);
    }
    return max;
}

static void draw_panel(FILE *stream, const struct focus_plot *plot, double top) {
    const struct focus_search *search = plot->search;
    const double max = highest(&search->curve);
    INVARIANT(search->options.min < search->options.max);
    INVARIANT(search->curve.count <= FOCUS_SAMPLES_MAX);
    const struct panel panel = {.stream = stream,
                                .plot = plot,
                                .top = top,
                                .x_min = search->options.min,
                                .x_max = search->options.max,
                                .y_max = max > 0 ? 1.05 * max : 1};
    write_title(&panel);
    draw_axes(&panel);
    draw_sweep(&panel);
    draw_samples(&panel);
    if (has_peak(&search->result)) {
        draw_peak(&panel, &search->result.peak, "stroke=\"#d62728\"");
    }
    draw_peak(&panel, &search->result.second, "stroke=\"#d62728\" stroke-dasharray=\"4 3\"");
    draw_ring(&panel);
    draw_legend(&panel);
}

void focus_plot_svg(FILE *stream, const struct focus_plot *plots, int count) {
    fprintf(stream,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" viewBox=\"0 0 %d "
            "%d\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%%\" "
            "height=\"100%%\" fill=\"#fff\"/>\n",
            WIDTH, count * PANEL_HEIGHT, WIDTH, count * PANEL_HEIGHT);
    for (int i = 0; i < count; i++) {
        draw_panel(stream, &plots[i], (double)i * PANEL_HEIGHT);
    }
    fprintf(stream, "</svg>\n");
}

void focus_plot_csv(FILE *stream, const struct focus_plot *plots, int count) {
    fprintf(stream,
            "lens,leg,position_counts,sharpness,sharpness_deviation,tenengrad,"
            "tenengrad_deviation,laplacian,laplacian_deviation,mean,saturated_permille,"
            "time_ms\n");
    for (int i = 0; i < count; i++) {
        const struct focus_curve *curve = &plots[i].search->curve;
        for (unsigned k = 0; k < curve->count; k++) {
            const struct focus_sample *sample = &curve->samples[k];
            INVARIANT(sample->leg < FOCUS_LEGS);
            fprintf(stream, "%s,%s,%.2f", plots[i].name, leg_names[sample->leg],
                    (double)sample->position);
            for (int channel = 0; channel < FOCUS_CHANNELS; channel++) {
                fprintf(stream, ",%.5g,%.3g", (double)sample->sharpness[channel],
                        (double)sample->deviation[channel]);
            }
            fprintf(stream, ",%.1f,%u,%u\n", (double)sample->mean,
                    (unsigned)sample->saturated_permille, (unsigned)sample->time_ms);
        }
    }
}
