// SPDX-License-Identifier: Apache-2.0
#include "focus/lens_learned.h"

#include <math.h>

#include "core/invariant.h"
#include "core/math.h"

enum {
    // Entries closer than this part of the zoom's range are one.
    NEAR_PARTS = 64,
    SIGMA_MIN_Q4 = 8,
    // An object moves a little between two times, and a ring never rests quite where it is sent.
    OBJECT_MOVES_Q4 = 8,
    REST_Q4 = 11,
    GATE_SIGMAS = 3,
    COUNT_MAX = 999,
};

bool lens_table_is_valid(const struct lens_table *table) {
    if (table->count > LENS_POINTS_MAX) {
        return false;
    }
    for (uint32_t i = 1; i < table->count; i++) {
        if (table->point[i].at <= table->point[i - 1].at) {
            return false;
        }
    }
    return true;
}

// Index of the first entry at `at` or above.
static uint32_t find(const struct lens_table *table, double at) {
    uint32_t i = 0;
    INVARIANT(table->count <= LENS_POINTS_MAX);
    while (i < table->count && table->point[i].at < at) {
        i++;
    }
    return i;
}

bool lens_table_value(const struct lens_table *table, double at, double *value) {
    const uint32_t i = find(table, at);
    if (table->count == 0) {
        return false;
    }
    if (i == 0 || i == table->count) {
        *value = table->point[i == 0 ? 0 : i - 1].value;
        return true;
    }
    const struct lens_point *low = &table->point[i - 1], *high = &table->point[i];
    INVARIANT(low->at < high->at);
    const double part = (at - low->at) / (double)(high->at - low->at);
    *value = low->value + part * (high->value - low->value);
    return true;
}

bool lens_table_position(const struct lens_table *table, double value, double *at) {
    for (uint32_t i = 1; i < table->count; i++) {
        const struct lens_point *low = &table->point[i - 1], *high = &table->point[i];
        if (low->value >= value && value >= high->value && low->value > high->value) {
            const double part = (low->value - value) / (double)(low->value - high->value);
            *at = low->at + part * (high->at - low->at);
            return true;
        }
    }
    return false;
}

static void remove_at(struct lens_table *table, uint32_t i) {
    INVARIANT(i < table->count);
    table->count--;
    for (; i < table->count; i++) {
        table->point[i] = table->point[i + 1];
    }
}

// Makes one entry, in the middle of both, of the two that are closest.
static void merge_closest(struct lens_table *table) {
    uint32_t best = 1;
    INVARIANT(table->count >= 2);
    for (uint32_t i = 2; i < table->count; i++) {
        if (table->point[i].at - table->point[i - 1].at <
            table->point[best].at - table->point[best - 1].at) {
            best = i;
        }
    }
    struct lens_point *low = &table->point[best - 1];
    const struct lens_point *high = &table->point[best];
    low->at += (high->at - low->at) / 2;
    low->value = (low->value + high->value) / 2;
    low->sigma = low->sigma > high->sigma ? low->sigma : high->sigma;
    low->count = low->count > high->count ? low->count : high->count;
    remove_at(table, best);
}

void lens_table_put(struct lens_table *table, const struct lens_point *point) {
    uint32_t i = find(table, point->at);
    if (i < table->count && table->point[i].at == point->at) {
        table->point[i] = *point;
        return;
    }
    if (table->count == LENS_POINTS_MAX) {
        merge_closest(table);
        i = find(table, point->at);
        if (i < table->count && table->point[i].at == point->at) {
            table->point[i] = *point;
            return;
        }
    }
    INVARIANT(table->count < LENS_POINTS_MAX);
    for (uint32_t k = table->count; k > i; k--) {
        table->point[k] = table->point[k - 1];
    }
    table->point[i] = *point;
    table->count++;
    INVARIANT(lens_table_is_valid(table));
}

// Index of the entry nearest to a zoom; `count` if the table is empty.
static uint32_t nearest(const struct lens_table *table, int32_t zoom) {
    const uint32_t i = find(table, zoom);
    if (i == 0 || (i < table->count && table->point[i].at - zoom < zoom - table->point[i - 1].at)) {
        return i;
    }
    return i - 1;
}

static int32_t gap(const struct lens_table *table, uint32_t i, int32_t zoom) {
    return table->point[i].at > zoom ? table->point[i].at - zoom : zoom - table->point[i].at;
}

// Variance that the deviation gains between the entries and a zoom: as that of a random walk that
// reaches the prior's over the whole range, tied to the entries.
static double walk(const struct lens_table *table, int32_t zoom, int32_t span) {
    const uint32_t i = find(table, zoom);
    const double scale = (double)LENS_PRIOR_Q4 * LENS_PRIOR_Q4 / span;
    INVARIANT(table->count > 0);
    if (i == 0 || i == table->count) {
        return scale * gap(table, i == 0 ? 0 : i - 1, zoom);
    }
    const double below = gap(table, i - 1, zoom), above = gap(table, i, zoom);
    return scale * below * above / (below + above);
}

void lens_learned_deviation(const struct lens_table *table, int32_t zoom, int32_t span,
                            double *deviation_q4, double *sigma_q4) {
    double deviation = 0, sigma = LENS_PRIOR_Q4;
    INVARIANT(span > 0);
    if (lens_table_value(table, zoom, &deviation)) {
        const double known = table->point[nearest(table, zoom)].sigma;
        sigma = math_min(sqrt(known * known + walk(table, zoom, span)), LENS_PRIOR_Q4);
    }
    *deviation_q4 = deviation;
    *sigma_q4 = sigma;
    INVARIANT(sigma <= LENS_PRIOR_Q4);
}

static int32_t rounded(double value) {
    return (int32_t)(value < 0 ? value - 0.5 : value + 0.5);
}

static uint16_t sigma_of(double variance) {
    const double sigma = sqrt(variance);
    return (uint16_t)rounded(math_clamp(sigma, SIGMA_MIN_Q4, 16000));
}

// The entry to change: an existing one nearby, or a new one with the value that is expected here.
static struct lens_point entry_at(const struct lens_table *table, int32_t zoom, int32_t span) {
    const uint32_t i = nearest(table, zoom);
    if (i < table->count && gap(table, i, zoom) <= span / NEAR_PARTS) {
        return table->point[i];
    }
    double deviation = 0, sigma = 0;
    lens_learned_deviation(table, zoom, span, &deviation, &sigma);
    return (struct lens_point){
        .at = zoom, .value = rounded(deviation), .sigma = sigma_of(sigma * sigma)};
}

// The object is at another distance than before, or it is the first one. `elsewhere`: the last time
// was at another zoom or with the other lens.
static void take_new_object(struct lens_object *object, struct lens_point *entry, bool elsewhere,
                            int32_t position_q4, double noise) {
    const double variance = (double)entry->sigma * entry->sigma;
    if (object->known && object->is_new && elsewhere) {
        entry->sigma = sigma_of(math_min(4 * variance, LENS_PRIOR_Q4 * LENS_PRIOR_Q4));
    }
    object->position_q4 = position_q4 - entry->value;
    object->sigma_q4 = sigma_of(noise + variance);
}

bool lens_learned_focus(struct lens_table *table, uint8_t lens, struct lens_object *object,
                        int32_t zoom, int32_t span, int32_t position_q4, uint16_t sigma_q4,
                        int32_t distance_q4) {
    const bool measured = distance_q4 != INT32_MIN;
    const double noise = (double)sigma_q4 * sigma_q4 + REST_Q4 * REST_Q4;
    struct lens_point entry = entry_at(table, zoom, span);
    if (!measured && !object->known && table->count == 0) {
        // The first of all is nominal by definition, the others are relative to it.
        entry.sigma = SIGMA_MIN_Q4;
    }
    if (measured) {
        object->known = true;
        object->position_q4 = distance_q4;
        object->sigma_q4 = SIGMA_MIN_Q4;
    }
    const double moves = measured ? 0 : OBJECT_MOVES_Q4 * OBJECT_MOVES_Q4;
    const double of_object = (double)object->sigma_q4 * object->sigma_q4 + moves;
    const double of_entry = (double)entry.sigma * entry.sigma;
    const double variance = of_entry + of_object + noise;
    const double difference = (double)position_q4 - object->position_q4 - entry.value;
    INVARIANT(variance > 0);
    const bool same = object->known &&
                      (measured || difference * difference <= GATE_SIGMAS * GATE_SIGMAS * variance);
    if (same) {
        object->position_q4 += measured ? 0 : rounded(difference * of_object / variance);
        object->sigma_q4 = sigma_of(of_object * (1 - of_object / variance));
        entry.value += rounded(difference * of_entry / variance);
        entry.sigma = sigma_of(of_entry * (1 - of_entry / variance));
    } else {
        const bool elsewhere = object->zoom != entry.at || object->lens != lens;
        take_new_object(object, &entry, elsewhere, position_q4, noise);
    }
    object->known = true;
    object->is_new = !same;
    object->zoom = entry.at;
    object->lens = lens;
    entry.count = (uint16_t)(entry.count < COUNT_MAX ? entry.count + 1 : COUNT_MAX);
    lens_table_put(table, &entry);
    return same;
}
