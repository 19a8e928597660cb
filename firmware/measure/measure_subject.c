// SPDX-License-Identifier: Apache-2.0
#include "measure/measure_subject.h"

#include <stddef.h>
#include <string.h>

#include "core/invariant.h"

enum {
    // Bins of depth, each deeper than the one before by 1 / 64 = 16 permille, from 0.1 to 200 m.
    BINS = 512,
    FIRST_UM = 100000,
    BIN_SHIFT = 6,
    GAP_BINS = 3,  // MEASURE_SUBJECT_GAP_PERMILLE
    // Around the ray: a cone of this slope (2^-20), twice as wide each time.
    CONE_FIRST_Q20 = 1 << 14,  // 1 / 64: 28 mm at 1.8 m
    CONES = 5,
    // A layer around the ray is the subject if it has so much of the points there; a bin counts if
    // it
    // has so much of the fullest one around the ray: a table under the subject reaches
    // from near to far, but has little in each bin.
    LAYER_PART = 4,
    BIN_PART = 16,
    // Of a quantile; offsets from the ray are counted in 1/1024 of the depth.
    END_PART = 100,
    ACROSS_BINS = 1024,
    ACROSS_SHIFT = 10,  // from 2^-20
};

// Lower ends of the bins of depth; strictly ascending.
struct depths {
    int32_t begin_um[BINS + 1];
    uint32_t count[BINS];
    uint32_t total;
};

static void begin(struct depths *depths) {
    int64_t at_um = FIRST_UM;
    for (int i = 0; i <= BINS; i++) {
        depths->begin_um[i] = at_um < INT32_MAX ? (int32_t)at_um : INT32_MAX;
        at_um += at_um >> BIN_SHIFT;
    }
    memset(depths->count, 0, sizeof depths->count);
    depths->total = 0;
}

// The bin of a depth; -1: none.
static int bin_of(const struct depths *depths, int32_t depth_um) {
    int low = 0, high = BINS;
    if (depth_um < depths->begin_um[0] || depth_um >= depths->begin_um[BINS]) {
        return -1;
    }
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        *(depth_um >= depths->begin_um[middle] ? &low : &high) = middle;
    }
    return low;
}

// Offset from the ray at the point's depth, um, along x (0) or y (1).
static int64_t offset_um(const struct measure_ray *ray, const struct triangulate_point *point,
                         int axis) {
    const int64_t at_um = axis == 0 ? point->x_um : point->y_um;
    const int64_t ahead_um = (int64_t)point->z_um - ray->origin_um[2];
    return at_um - ray->origin_um[axis] - ahead_um * ray->slope_q20[axis] / (1 << 20);
}

static int64_t absolute(int64_t value) {
    return value < 0 ? -value : value;
}

static bool is_counted(const struct measure_subject_request *request,
                       const struct triangulate_point *point) {
    return (request->near_um == 0 || point->z_um >= request->near_um) &&
           (request->far_um == 0 || point->z_um <= request->far_um);
}

static bool is_in_cone(const struct measure_subject_request *request,
                       const struct triangulate_point *point, int64_t cone_q20) {
    const int64_t limit_um = point->z_um * cone_q20 / (1 << 20);
    return is_counted(request, point) && absolute(offset_um(&request->ray, point, 0)) <= limit_um &&
           absolute(offset_um(&request->ray, point, 1)) <= limit_um;
}

// Whether a picture around the ray, 4 : 3 as the sensors', shows it. `half_q20`: slope of its side;
// 0: all are shown.
static bool is_in_view(const struct measure_subject_request *request,
                       const struct triangulate_point *point, int64_t half_q20) {
    const int64_t limit_um = point->z_um * half_q20 / (1 << 20);
    return is_counted(request, point) &&
           (half_q20 == 0 || (absolute(offset_um(&request->ray, point, 0)) <= limit_um &&
                              4 * absolute(offset_um(&request->ray, point, 1)) <= 3 * limit_um));
}

static void add(struct depths *depths, int32_t depth_um) {
    const int bin = bin_of(depths, depth_um);
    if (bin >= 0) {
        depths->count[bin]++;
        depths->total++;
    }
}

// Bins first .. last that follow each other without a gap, from a bin with points on, and their
// points. A bin counts from `least` points on.
struct layer {
    int first, last;
    uint32_t points;
};

static struct layer layer_around(const struct depths *depths, int bin, uint32_t least) {
    struct layer layer = {bin, bin, depths->count[bin]};
    INVARIANT(bin >= 0 && bin < BINS);
    for (int gap = 0, i = bin - 1; i >= 0 && gap < GAP_BINS; i--) {
        gap = depths->count[i] >= least ? 0 : gap + 1;
        layer.first = gap == 0 ? i : layer.first;
    }
    for (int gap = 0, i = bin + 1; i < BINS && gap < GAP_BINS; i++) {
        gap = depths->count[i] >= least ? 0 : gap + 1;
        layer.last = gap == 0 ? i : layer.last;
    }
    layer.points = 0;
    for (int i = layer.first; i <= layer.last; i++) {
        layer.points += depths->count[i];
    }
    return layer;
}

// The nearest layer with enough of the points.
static struct layer nearest_layer(const struct depths *depths) {
    struct layer layer = {0, -1, 0};
    for (int i = 0; i < BINS; i++) {
        if (depths->count[i] > 0 && i > layer.last) {
            layer = layer_around(depths, i, 1);
            if (layer.points >= depths->total / LAYER_PART) {
                break;
            }
        }
    }
    INVARIANT(layer.last >= 0);
    return layer;
}

// The bin in which a layer has its `*rank`-th point, from 0; `*rank` becomes that within the bin.
static int bin_of_rank(const struct depths *depths, const struct layer *layer, uint32_t *rank) {
    int bin = layer->first;
    while (bin < layer->last && *rank >= depths->count[bin]) {
        *rank -= depths->count[bin++];
    }
    return bin;
}

// The depth of a layer's middle point; points are spread evenly over their bin.
static int32_t middle_of(const struct depths *depths, const struct layer *layer) {
    uint32_t rank = layer->points / 2;
    const int bin = bin_of_rank(depths, layer, &rank);
    const int64_t width_um = (int64_t)depths->begin_um[bin + 1] - depths->begin_um[bin];
    return (int32_t)(depths->begin_um[bin] +
                     width_um * (2 * (int64_t)rank + 1) / (2 * (int64_t)depths->count[bin]));
}

// The points of a cone around the ray that has enough of them. 0: none has.
static int64_t fill_cone(const struct triangulate_point *points, uint32_t count,
                         const struct measure_subject_request *request, struct depths *depths) {
    int64_t cone_q20 = CONE_FIRST_Q20;
    for (int i = 0; i < CONES; i++, cone_q20 *= 2) {
        begin(depths);
        for (uint32_t at = 0; at < count; at++) {
            if (is_in_cone(request, &points[at], cone_q20)) {
                add(depths, points[at].z_um);
            }
        }
        if (depths->total >= MEASURE_SUBJECT_POINTS_MIN) {
            return cone_q20;
        }
    }
    return 0;
}

// Twice the distance from the ray that all but 2 % of the subject's points have across.
static int32_t width_of(const struct triangulate_point *points, uint32_t count,
                        const struct measure_subject_request *request, int64_t half_q20,
                        const struct measure_subject *subject) {
    uint32_t histogram[ACROSS_BINS] = {0}, total = 0;
    for (uint32_t i = 0; i < count; i++) {
        const struct triangulate_point *point = &points[i];
        if (!is_in_view(request, point, half_q20) || point->z_um < subject->near_um ||
            point->z_um > subject->far_um) {
            continue;
        }
        const int64_t slope_q20 =
            absolute(offset_um(&request->ray, point, 0)) * (1 << 20) / point->z_um;
        const int64_t bin = slope_q20 >> ACROSS_SHIFT;
        histogram[bin < ACROSS_BINS ? bin : ACROSS_BINS - 1]++;
        total++;
    }
    uint32_t beyond = 0;
    int bin = ACROSS_BINS - 1;
    while (bin > 0 && beyond + histogram[bin] <= total / (END_PART / 2)) {
        beyond += histogram[bin--];
    }
    const int64_t width_um = ((int64_t)(bin + 1) << ACROSS_SHIFT) * subject->middle_um[2] >> 19;
    return (int32_t)(width_um < INT32_MAX ? width_um : INT32_MAX);
}

bool measure_subject_find(const struct triangulate_point *points, uint32_t count,
                          const struct measure_subject_request *request,
                          struct measure_subject *subject) {
    struct depths depths;
    INVARIANT(points != NULL || count == 0);
    const int64_t cone_q20 = fill_cone(points, count, request, &depths);
    if (cone_q20 == 0) {
        return false;
    }
    const struct layer around = nearest_layer(&depths);
    const int32_t middle_um = middle_of(&depths, &around);
    const int64_t half_q20 = (int64_t)request->half_um * (1 << 20) / middle_um;
    begin(&depths);
    for (uint32_t i = 0; i < count; i++) {
        if (is_in_view(request, &points[i], half_q20)) {
            add(&depths, points[i].z_um);
        }
    }
    uint32_t fullest = 0;
    for (int bin = around.first; bin <= around.last; bin++) {
        fullest = depths.count[bin] > fullest ? depths.count[bin] : fullest;
    }
    const uint32_t least = fullest / BIN_PART + 1;
    const struct layer layer = layer_around(&depths, bin_of(&depths, middle_um), least);
    if (layer.points == 0) {
        return false;
    }
    uint32_t low = layer.points / END_PART, high = layer.points - 1 - low;
    const int first = bin_of_rank(&depths, &layer, &low);
    const int last = bin_of_rank(&depths, &layer, &high);
    const struct measure_ray *ray = &request->ray;
    *subject = (struct measure_subject){.near_um = depths.begin_um[first],
                                        .far_um = depths.begin_um[last + 1],
                                        .points = layer.points,
                                        .around = around.points};
    for (int axis = 0; axis < 2; axis++) {
        subject->middle_um[axis] =
            (int32_t)(ray->origin_um[axis] +
                      ((int64_t)middle_um - ray->origin_um[2]) * ray->slope_q20[axis] / (1 << 20));
    }
    subject->middle_um[2] = middle_um;
    subject->width_um = width_of(points, count, request, half_q20, subject);
    return true;
}
