/* SPDX-License-Identifier: Apache-2.0 */
/* The FPGA bridge's own Verilog, run by a computer: the only model of the bridge that there is.
 *
 * Time stands still but for bridge_model_advance(), and counts picoseconds from creation. The same
 * calls with the same seed give the same events, whatever the machine. One model belongs to one
 * thread at a time; two models know nothing of each other.
 *
 * Lines of I2C: the inputs say what everybody but the bridge does (0 pulls the line low, 1 lets it
 * go); the model joins the bridge's own pull, and the outputs say what the wire then is.
 */
#ifndef VERGENCE_FPGA_SIM_BRIDGE_MODEL_H
#define VERGENCE_FPGA_SIM_BRIDGE_MODEL_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct bridge_model bridge_model;

enum { BRIDGE_LEFT = 0, BRIDGE_RIGHT = 1, BRIDGE_CAMERAS = 2, BRIDGE_SERVOS = 2 };

/* Clocks that the model makes; a camera's has the camera's number. */
enum { BRIDGE_CLOCK_LEFT = 0, BRIDGE_CLOCK_RIGHT = 1, BRIDGE_CLOCK_CONTROL = 2, BRIDGE_CLOCKS = 3 };

/* Periods of the control clock in a microsecond, and its period at 25 MHz. */
enum { BRIDGE_CLOCKS_PER_US = 25, BRIDGE_CONTROL_PERIOD_PS = 40000 };

/* What the world drives. Levels: 0 or 1. */
typedef struct {
    uint8_t reset;                      /* the board's reset, active high, at any time */
    uint8_t scl, sda;                   /* the DSP's bus */
    uint8_t scl_noise, sda_noise;       /* 1: the bridge reads the wire wrongly, as in a spike */
    uint8_t branch_scl[BRIDGE_CAMERAS]; /* the sensors' ends of their branches */
    uint8_t branch_sda[BRIDGE_CAMERAS];
    uint8_t frame_valid[BRIDGE_CAMERAS];
    uint8_t line_valid[BRIDGE_CAMERAS];
    uint16_t pixel[BRIDGE_CAMERAS]; /* 10 bits */
} bridge_inputs;

/* What the wires are. */
typedef struct {
    uint8_t scl, sda;
    uint8_t branch_scl[BRIDGE_CAMERAS];
    uint8_t branch_sda[BRIDGE_CAMERAS];
    uint8_t servo[BRIDGE_SERVOS];
    uint8_t irq;
    uint8_t ppi_clk;
    uint8_t ppi_fs1;   /* line valid */
    uint8_t ppi_fs2;   /* frame valid */
    uint8_t ppi_fs3;   /* always low */
    uint16_t ppi_data; /* 10 bits */
    uint8_t sensor_reset_n[BRIDGE_CAMERAS];
    uint8_t sensor_standby[BRIDGE_CAMERAS];
    uint8_t sensor_oe[BRIDGE_CAMERAS];
    uint8_t sensor_extclk_enable[BRIDGE_CAMERAS];
    uint8_t trigger[BRIDGE_CAMERAS];
} bridge_outputs;

/* Groups of outputs, for the event callback. */
enum {
    BRIDGE_EVENT_BUS = 1u,      /* scl, sda */
    BRIDGE_EVENT_BRANCH = 2u,   /* branch_scl, branch_sda */
    BRIDGE_EVENT_SERVO = 4u,    /* servo */
    BRIDGE_EVENT_IRQ = 8u,      /* irq */
    BRIDGE_EVENT_PPI_CLK = 16u, /* ppi_clk */
    BRIDGE_EVENT_PPI = 32u,     /* the other pins of the PPI */
    BRIDGE_EVENT_SENSOR = 64u   /* sensor_*, trigger */
};

/* Called as soon as a pin of a wanted group has changed. events: which groups; now: the wires now.
 * It may read the model and set inputs: those take effect at the next event of any clock, at the
 * latest when the running advance ends. It must not advance the model. */
typedef void (*bridge_event_callback)(void *context, uint64_t time_ps, uint32_t events,
                                      const bridge_outputs *now);

/* Called just after an edge of a camera's clock was seen by the bridge, so that what it drives then
 * has one more edge to settle, as the pins of a sensor do. Same rules. */
typedef void (*bridge_clock_callback)(void *context, uint64_t time_ps, int camera, int level);

/* Called at a rising edge of the PPI's clock at which a frame sync is not what it was at the edge
 * before, and when samples have gathered: a run of samples with the same syncs has ended. data:
 * those of the run since the last call, without the present one, which begins the next run and has
 * the syncs `now`. data is the model's and good for this call. Same rules as above. */
typedef void (*bridge_ppi_callback)(void *context, uint64_t time_ps, const uint16_t *data,
                                    size_t count, const bridge_outputs *now);

/* A word of a camera's pins: 10 bits of data, and these. */
enum { BRIDGE_WORD_LINE = 1u << 10, BRIDGE_WORD_FRAME = 1u << 11 };

/* A model just after power-up: reset is active, clocks stand (but for the control clock's 25 MHz),
 * lines are let go. Synchronisers take a random extra clock now and then, by the seed. NULL: out of
 * memory. The caller destroys it. */
bridge_model *bridge_model_create(uint32_t seed);
void bridge_model_destroy(bridge_model *model);
/* Before anything else: the model's time begins there, not at 0; nothing has passed for the bridge.
 */
void bridge_model_begin_at(bridge_model *model, uint64_t time_ps);

/* What the world drives from now on. inputs is copied. */
void bridge_model_set_inputs(bridge_model *model, const bridge_inputs *inputs);
void bridge_model_get_inputs(const bridge_model *model, bridge_inputs *inputs);

/* The wires, as of the last event. */
void bridge_model_get_outputs(const bridge_model *model, bridge_outputs *outputs);

/* Period of a clock; 0 stops it where it is. A clock that was stopped starts with a half period.
 * The control clock cannot be stopped. */
void bridge_model_set_clock(bridge_model *model, int clock, uint32_t period_ps);

/* Idle: one period of the control clock takes a microsecond, and every one carries the tick. Timers
 * run as they would, 25 times cheaper and more; nothing may move on a bus of I2C meanwhile, and a
 * servo edge comes at the next whole microsecond. Takes effect at a tick: this advances to it (less
 * than 1 us). */
void bridge_model_set_idle(bridge_model *model, int idle);

/* In idle time a period that only counts is not evaluated, but added, with the same outcome; see
 * idle_skip.hpp. So are edges of a camera's clock between its lines; see blank_skip.hpp. Stepping:
 * every one is evaluated, from now on. For tests. */
void bridge_model_set_stepping(bridge_model *model, int stepping);
/* Rest: idle time in which cameras' clocks that are alive need not be shown. The bridge's watch
 * over them is kept as it is while its ticks of 50 us are added; all else runs as in idle time. It
 * may begin when that watch has just seen the clocks of `alive` (a sum of 1 << camera) and has lost
 * the others, and whoever ends it shows those clocks again before 145 us have passed. Not when
 * every clock is evaluated. */
int bridge_model_may_rest(const bridge_model *model, unsigned alive);
void bridge_model_set_resting(bridge_model *model, int resting);

/* A number of all registers and wires: two models with the same past have the same. */
uint64_t bridge_model_digest(const bridge_model *model);

/* Lets so much time pass. */
void bridge_model_advance(bridge_model *model, uint64_t duration_ps);

/* For callbacks: the running advance ends at this event; bridge_model_time_ps() tells when that
 * was. */
void bridge_model_interrupt(bridge_model *model);

uint64_t bridge_model_time_ps(const bridge_model *model);

/* Who hears of what; NULL: nobody. events is a sum of BRIDGE_EVENT_*. */
void bridge_model_on_event(bridge_model *model, uint32_t events, bridge_event_callback callback,
                           void *context);
void bridge_model_on_clock(bridge_model *model, bridge_clock_callback callback, void *context);

void bridge_model_on_ppi(bridge_model *model, bridge_ppi_callback callback, void *context);

/* Words that a camera shows one after the other, each just after an edge of its clock to `level`,
 * as a clock callback would set them, but without one for every edge: the callback is called at
 * such an edge only when no word is left, and may give the next ones, of which the first is taken
 * at that very edge. words stay the caller's and are not copied: they stand still until the last
 * is taken. Words that are left from before are dropped. From the first call on, the camera's part
 * of bridge_model_set_inputs() does not count any more. */
void bridge_model_feed(bridge_model *model, int camera, const uint16_t *words, size_t count,
                       int level);
/* The camera shows this word from now on, whatever its clock does. */
void bridge_model_show(bridge_model *model, int camera, uint16_t word);

/* The cameras whose frames could go to the PPI next, as a sum of 1 << camera: what the core has
 * selected, and what it is changing to. Not a pin: for a world that need not make pictures that
 * nobody sees. */
unsigned bridge_model_watched(const bridge_model *model);

#ifdef __cplusplus
}
#endif

#endif
