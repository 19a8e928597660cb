// SPDX-License-Identifier: Apache-2.0
/// The state of a replay, and the frames that its cameras lend, for both modes.
#ifndef VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_CAMERA_H
#define VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_CAMERA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "daemon/base/message.h"
#include "daemon/session/session_read.h"
#include "daemon/session/trace.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Frames of one source that may be lent at a time.
enum { REPLAY_FRAMES_LENT = 2 };

struct replay_camera {
    struct replay *replay;
    int number;
    uint16_t *pixels[REPLAY_FRAMES_LENT];  // allocated; grows with the frames
    size_t values[REPLAY_FRAMES_LENT];
    bool lent[REPLAY_FRAMES_LENT];
    struct hal_camera_counts counts;  // pairs only
    uint64_t begin_us, end_us;        // pairs only: the frame that was lent last
    uint32_t sequence;                // pairs only: number of the next frame
    uint32_t of_pair;  // pairs only: the pair that it belongs to, from 1; 0: none yet
};

struct replay {
    struct session_reader session;
    struct rig_ports ports;  // the ports it provides
    struct hal_clock clock;
    struct hal_i2c i2c;
    struct hal_i2c_operations i2c_operations;
    struct hal_gpio gpio;
    struct hal_uart uart;
    struct hal_camera camera[RIG_SIDES];
    struct hal_camera_operations camera_operations[RIG_SIDES];
    struct replay_camera camera_state[RIG_SIDES];

    FILE *log;  // calls.log; NULL: pairs only
    uint32_t line;
    uint32_t lines;  // valid lines: up to the last matching check
    uint32_t calls;  // calls among them that are still to be made
    uint32_t made;   // calls that were made
    char text[TRACE_LINE_MAX * 2 + 16];
    bool peeked;                // `text` holds the next call
    bool ended;                 // a mismatch occurred, or everything was replayed
    bool ran_out;               // the mismatch: more calls were made than recorded
    struct message last_error;  // the reason; "" if there is none
    uint64_t now_us;

    struct session_event *pairs;  // allocated; pairs only
    uint32_t pair_count;
    uint32_t next_pair;  // the pair that both cameras show
};

/// Lends a frame with the pixels of `frame`. 0, ERROR_MEMORY (two are lent already, or out of
/// memory) or an error of session_reader_frame, with `last_error` set.
int replay_camera_lend(struct replay_camera *camera, const struct pair_frame *form, uint32_t crc32,
                       struct hal_camera_frame *frame);
void replay_camera_take_back(struct replay_camera *camera, const struct hal_camera_frame *frame);

#ifdef __cplusplus
}
#endif

#endif
