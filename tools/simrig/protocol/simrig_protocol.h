/* SPDX-License-Identifier: Apache-2.0 */
/* The protocol of the simulated rig: how a program that drives the real rig (daemon, emulated
 * board, test) drives this one. C11, no dependencies; all numbers are little endian.
 *
 * A connection carries messages in both directions, each of a header and a body:
 *
 *   offset 0  u32  length of the body, at most SIMRIG_BODY_MAX
 *          4  u16  type (enum simrig_type); a reply has that of its request | SIMRIG_REPLY
 *          6  u16  tag, chosen by the client; the reply carries the same
 *          8       body
 *
 * The client sends a request, the rig answers it with one reply, in order. A reply's body begins
 * with i32 status (enum simrig_status); if that is not SIMRIG_OK, a text follows that says what is
 * wrong, in one line without a line end. The first request is SIMRIG_HELLO. A body has exactly the
 * bytes that its type requires. After a refused greeting, and after a message that is too long, the
 * rig sends the reason and closes the connection. A client that closes its sending side counts as
 * disconnected.
 *
 * Time. Virtual time advances by requests only: SIMRIG_ADVANCE advances it, an I2C transfer takes
 * as long as on the wire, and everything else takes no time. Wall time follows the clock of the
 * machine, and SIMRIG_ADVANCE waits. Times are microseconds since the rig's start.
 *
 * The version counts changes of meaning; a new type of request does not change it (a simrig without
 * that type replies SIMRIG_BAD_REQUEST).
 *
 * One client at a time is the board (SIMRIG_ROLE_BOARD) and has the buses; others are for control.
 * When the board's connection ends, its lines are released: the buses are free, outputs go to their
 * level at reset, an armed frame is cancelled.
 */
#ifndef VERGENCE_SIMRIG_PROTOCOL_H
#define VERGENCE_SIMRIG_PROTOCOL_H

#include <stdint.h>

enum {
    SIMRIG_MAGIC = 0x47495256, /* "VRIG" */
    SIMRIG_VERSION = 1,
    SIMRIG_HEADER_BYTES = 8,
    SIMRIG_BODY_MAX = 1 << 24,
    SIMRIG_REPLY = 0x8000,
    SIMRIG_NAME_MAX = 64,
    SIMRIG_I2C_MESSAGES_MAX = 42, /* limit of Linux's I2C_RDWR */
    SIMRIG_I2C_BYTES_MAX = 8192,
    SIMRIG_SERIAL_BYTES_MAX = 4096,
    SIMRIG_CONTROL_BYTES_MAX = 4096
};

enum simrig_status {
    SIMRIG_OK = 0,
    SIMRIG_BAD_REQUEST = -1, /* the message does not fit its type */
    SIMRIG_BAD_VERSION = -2, /* another version of the protocol, or no greeting */
    SIMRIG_BUSY = -3,        /* another client is the board */
    SIMRIG_NOT_ALLOWED = -4, /* not for this role */
    SIMRIG_I2C_NACK_ADDRESS = -5,
    SIMRIG_I2C_NACK_DATA = -6,
    SIMRIG_I2C_ARBITRATION = -7, /* SDA was low where the master released it */
    SIMRIG_I2C_TIMEOUT = -8,     /* SCL held for more than 25 ms */
    SIMRIG_I2C_STUCK = -9,       /* a line low before START, or SDA still low after STOP */
    SIMRIG_DEADLINE = -10,       /* no frame until the deadline */
    SIMRIG_NO_FRAME_ARMED = -11,
    SIMRIG_FAILED = -12 /* the command failed; the text says why */
};

enum simrig_role { SIMRIG_ROLE_BOARD = 0, SIMRIG_ROLE_CONTROL = 1 };

/* Requests. "->": the body of the reply, after the status. */
enum simrig_type {
    /* u32 magic, u16 version, u16 role, text name of the client
     * -> u16 version, u16 wall (1: wall time), text name of the rig */
    SIMRIG_HELLO = 1,
    /* - -> u64 now_us */
    SIMRIG_TIME = 2,
    /* u64 until_us, u32 wake (SIMRIG_WAKE_*): advances time until then, or until an event of
     * `wake`: an edge not yet returned by SIMRIG_GPIO_GET, bytes to read, a complete armed frame.
     * A day at most -> u64 now_us, u32 woken_by */
    SIMRIG_ADVANCE = 3,

    /* ---- board only */
    /* u32 speed_hz, u16 count, then for each message: u8 address (7 bits), u8 flags
     * (SIMRIG_I2C_READ), u16 length, and for a write its bytes. One transfer: START, messages with
     * repeated STARTs, STOP; a second at most on the wire. -> u16 count of whole messages, u16
     * bytes acknowledged or read of the one that failed, then the bytes of all reads in order
     * (zeros after a failure). Also with a status from SIMRIG_I2C_NACK_ADDRESS to SIMRIG_I2C_STUCK,
     * in place of the text. */
    SIMRIG_I2C = 16,
    /* u32 levels (SIMRIG_OUT_*) -> - */
    SIMRIG_GPIO_SET = 17,
    /* - -> u32 levels (SIMRIG_IN_*), u32 count, then for each edge since the last call:
     * u64 time_us, u8 bit number of the line, u8 level */
    SIMRIG_GPIO_GET = 18,
    /* u16 columns, u16 rows: the port waits for the next whole frame; line lengths other than
     * that are errors of the frame -> - */
    SIMRIG_FRAME_ARM = 19,
    /* u64 deadline_us: advances time until the frame is complete -> u64 begin_us, u64 end_us,
     * u32 number of frames since the start, u16 columns, u16 rows, u32 faults (SIMRIG_FRAME_*),
     * columns * rows u16 */
    SIMRIG_FRAME_WAIT = 20,
    SIMRIG_FRAME_CANCEL = 21, /* - -> - */
    SIMRIG_SERIAL_WRITE = 22, /* bytes -> - */
    SIMRIG_SERIAL_READ = 23,  /* - -> the bytes received */

    /* ---- board and control */
    /* text: a command of the control side, see simrig --help-control; SIMRIG_CONTROL_BYTES_MAX
     * at most -> text */
    SIMRIG_CONTROL = 32,
    /* u8 camera (0 left, 1 right): the truth of its last frame that was taken -> u16 columns,
     * u16 rows, u32 length of the text, text (YAML: the camera as it was, and the scene's objects
     * by name), columns * rows f32 depth along the camera's axis in mm, 0 where nothing is seen */
    SIMRIG_TRUTH = 33,
    /* u8 camera, u8 layers (SIMRIG_LAYER_*, one at least), u16 first row, u16 rows: these
     * rows of the same truth -> u16 columns, u16 rows, then each requested layer in the order of
     * the bits, rows * columns of what SIMRIG_LAYER_* says. Rows are those of the frame; a reply
     * longer than SIMRIG_BODY_MAX is refused */
    SIMRIG_TRUTH_ROWS = 34
};

enum { SIMRIG_I2C_READ = 1 };
enum { SIMRIG_WAKE_GPIO = 1, SIMRIG_WAKE_SERIAL = 2, SIMRIG_WAKE_FRAME = 4 };
enum {
    SIMRIG_LAYER_DEPTH = 1,  /* f32, as of SIMRIG_TRUTH */
    SIMRIG_LAYER_NORMAL = 2, /* three f32: unit normal of the surface, towards the camera and in
                                its frame (x right, y down, z forward); zeros where nothing is */
    SIMRIG_LAYER_OBJECT = 4  /* u8: which of the scene's objects, counted from 1 in the order of
                                its file; 0 where nothing is */
};
/* Lines from the board to the bridge. */
enum { SIMRIG_OUT_BRIDGE_RESET = 1 };
/* Lines from the bridge to the board. */
enum { SIMRIG_IN_IRQ = 1 };
enum {
    SIMRIG_FRAME_SHORT_LINE = 1, /* a line ended early or late */
    SIMRIG_FRAME_SHORT = 2,      /* fewer rows than armed */
    SIMRIG_FRAME_LONG = 4        /* more rows: those beyond are lost */
};

#endif
