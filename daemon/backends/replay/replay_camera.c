// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/replay/replay_camera.h"

#include <stdlib.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"

int replay_camera_lend(struct replay_camera *camera, const struct pair_frame *form, uint32_t crc32,
                       struct hal_camera_frame *frame) {
    struct replay *self = camera->replay;
    const size_t values = (size_t)session_frame_row_values(form) * form->height_px;
    int place = 0;
    while (place < REPLAY_FRAMES_LENT && camera->lent[place]) {
        place++;
    }
    if (place == REPLAY_FRAMES_LENT) {
        return message_set(&self->last_error, ERROR_MEMORY, "%s: two frames are already lent",
                           self->session.path);
    }
    const int fits = session_reader_frame_fits(&self->session, form, crc32, &self->last_error);
    if (fits != 0) {
        return fits;
    }
    if (values > camera->values[place]) {
        uint16_t *more = realloc(camera->pixels[place], values * sizeof *more);
        if (more == NULL) {
            return message_set(&self->last_error, ERROR_MEMORY, "%s: out of memory for a frame",
                               self->session.path);
        }
        camera->pixels[place] = more;
        camera->values[place] = values;
    }
    const int code = session_reader_frame(&self->session, form, crc32, camera->pixels[place],
                                          camera->values[place], &self->last_error);
    if (code != 0) {
        return code;
    }
    camera->lent[place] = true;
    *frame = (struct hal_camera_frame){.data = camera->pixels[place],
                                       .width_px = form->width_px,
                                       .height_px = form->height_px,
                                       .stride = session_frame_row_values(form),
                                       .bits = form->bits,
                                       .layout = form->layout,
                                       .sequence = form->sequence,
                                       .begin_us = form->begin_us,
                                       .end_us = form->end_us,
                                       .token = camera->pixels[place]};
    return 0;
}

void replay_camera_take_back(struct replay_camera *camera, const struct hal_camera_frame *frame) {
    for (int place = 0; place < REPLAY_FRAMES_LENT; place++) {
        if (camera->lent[place] && camera->pixels[place] == frame->token) {
            camera->lent[place] = false;
        }
    }
}
