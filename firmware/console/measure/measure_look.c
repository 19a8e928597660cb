// SPDX-License-Identifier: Apache-2.0
#include "console/measure/measure_look.h"

#include <math.h>

#include "console/measure/measure_share.h"
#include "core/math.h"
#include "measure/measure_tuning.h"
#include "stereo/geometry/geometry.h"
#include "stereo/zoom/adjust_expect.h"

static const double um_per_mm = 1e3, q20 = 1 << 20;
// How much wider than the picture that is wanted the part is in which the subject is looked for.
static const double margin = 1.2;
// A coarse surface: its width, and as near as lenses focus.
static const double width_px = 512, nearest_mm = 500;

struct look {
    struct measure_ray ray;
    /// Width in which the subject is: mm + per_mm * its distance; 0 0: all of the view.
    double width_mm, width_per_mm;
};

static int32_t to_um(double mm) {
    return (int32_t)math_round(um_per_mm * math_max(-2e6, math_min(2e6, mm)));
}

// The line through the middle of both cameras, along the mean of their views.
static struct measure_ray ray_of_middle(const struct calibration *calibration) {
    static const double ahead[3] = {0, 0, 1};
    double R_right_left[9], right_ahead[3], pupil_mm[3];
    geometry_rotation_from_vector(calibration->rotation_right_left_rad, R_right_left);
    geometry_rotate_back(R_right_left, ahead, right_ahead);
    geometry_rotate_back(R_right_left, calibration->translation_right_left_mm, pupil_mm);
    struct measure_ray ray;
    for (int i = 0; i < 3; i++) {
        ray.origin_um[i] = to_um(-pupil_mm[i] / 2);
    }
    const double z = 1 + math_max(right_ahead[2], 0);
    for (int i = 0; i < 2; i++) {
        ray.slope_q20[i] = (int32_t)math_round(q20 * right_ahead[i] / z);
    }
    return ray;
}

// Where the right camera sees a point of the left camera's frame, px of the whole sensor.
static bool project_right(const struct measure_surface *surface, const double left_mm[3],
                          double right_px[2]) {
    const struct calibration *calibration = surface->calibration;
    const struct pair_window *window = &surface->frames[RIG_RIGHT].window;
    double R_right_left[9], right_mm[3];
    geometry_rotation_from_vector(calibration->rotation_right_left_rad, R_right_left);
    geometry_rotate(R_right_left, left_mm, right_mm);
    for (int i = 0; i < 3; i++) {
        right_mm[i] += calibration->translation_right_left_mm[i];
    }
    if (!lens_project(&calibration->right, right_mm, right_px)) {
        return false;
    }
    for (int i = 0; i < 2; i++) {
        right_px[i] = (right_px[i] + 0.5) * surface->shrink - 0.5;
    }
    if (window->skip > 0) {
        const struct calibration_window part = {window->column_px, window->row_px, window->skip};
        adjust_to_sensor(&part, right_px);
    }
    return true;
}

void measure_look_prepare(const struct measure_step *step, const struct pair_frame *left,
                          struct measure_search *search) {
    *search = (struct measure_search){
        .scale = math_min(1, width_px / left->image.width_px),
        // A small subject alone has too few pixels to count as a surface: what is behind it, too.
        .near_mm = step->near_mm > 0 ? math_min(step->near_mm, nearest_mm) : nearest_mm,
        .far_mm = (double)INFINITY,
    };
}

// Sets the width by what is wanted of the picture.
static void set_width(struct look *self, const struct measure_request *request,
                      const struct zoom_calibration *calibration, const struct pair_frame *left) {
    const struct zoom_camera *camera = &calibration->camera[RIG_LEFT];
    const double sensor_px = left->image.width_px * math_max(left->window.skip, 1);
    if (request->wish == MEASURE_WISH_FIT) {
        self->width_mm = margin * request->value;
    } else if (request->wish == MEASURE_WISH_DENSITY) {
        self->width_mm = margin * left->image.width_px / sqrt(request->value);
    } else if (request->wish == MEASURE_WISH_ZOOM) {
        const double wide_px = zoom_function_value(camera, ZOOM_FOCAL, camera->zoom.min);
        self->width_per_mm = margin * sensor_px / (request->value * wide_px);
    }
}

// The ray at the place that the request asks for, else through the middle.
static bool find_ray(const struct measure_surface *surface, const struct measure *machine,
                     const struct zoom_state *axes, const struct measure_place *place,
                     struct measure_ray *ray) {
    if (machine->request.has_place) {
        return measure_place_ray(place, machine->instrument.calibration, axes, ray);
    }
    *ray = ray_of_middle(surface->calibration);
    return true;
}

bool measure_look_at(const struct measure_surface *surface, const struct measure *machine,
                     const struct measure_step *step, const struct measure_place *place,
                     struct measure_event *event) {
    const struct reconstruct_result *result = surface->result;
    const struct zoom_calibration *calibration = machine->instrument.calibration;
    struct look look = {.width_mm = 0};
    if (!find_ray(surface, machine, &machine->axes, place, &look.ray)) {
        return false;
    }
    set_width(&look, &machine->request, calibration, &surface->frames[RIG_LEFT]);
    struct measure_subject_request request = {
        .ray = look.ray,
        .half_um = look.width_per_mm > 0 ? 0 : to_um(look.width_mm / 2),
        .near_um = to_um(step->near_mm),
        .far_um = to_um(step->far_mm),
    };
    struct measure_subject subject;
    if (result->points == NULL ||
        !measure_subject_find(result->points, result->vertex_count, &request, &subject)) {
        return false;
    }
    if (look.width_per_mm > 0) {
        request.half_um =
            to_um((look.width_mm + look.width_per_mm * subject.middle_um[2] / um_per_mm) / 2);
        if (!measure_subject_find(result->points, result->vertex_count, &request, &subject)) {
            return false;
        }
    }
    double left_mm[3];
    for (int i = 0; i < 3; i++) {
        left_mm[i] = event->subject.left_mm[i] = subject.middle_um[i] / um_per_mm;
    }
    event->subject.near_mm = subject.near_um / um_per_mm;
    event->subject.far_mm = subject.far_um / um_per_mm;
    event->subject.width_mm = subject.width_um / um_per_mm;
    return project_right(surface, left_mm, event->subject.right_px);
}

struct surface_figures_depths measure_look_depths(const struct measure_surface *surface,
                                                  const struct measure *machine,
                                                  const struct measure_place *place,
                                                  struct arena *arena) {
    struct surface_figures_depths depths = {0, INT32_MAX};
    const bool known = machine->near_mm > 0 && machine->far_mm > 0;
    if (known) {
        depths = (struct surface_figures_depths){to_um(machine->near_mm), to_um(machine->far_mm)};
    }
    struct measure_subject_request request = {
        .near_um = to_um(machine->request.near_mm),
        .far_um = to_um(machine->request.far_mm),
    };
    struct measure_subject subject;
    if (!find_ray(surface, machine, &machine->pair_axes, place, &request.ray) ||
        !measure_share_find(surface->result, &request, arena, &subject)) {
        return depths;
    }
    // Each pair has an error that all of its depths share.
    const int32_t margin_um = to_um(MEASURE_SEARCH_MARGIN * machine->distance_mm);
    const int32_t middle_um = subject.middle_um[2];
    const bool other =
        middle_um < depths.near_um - margin_um || (known && middle_um > depths.far_um + margin_um);
    return other ? depths : (struct surface_figures_depths){subject.near_um, subject.far_um};
}
