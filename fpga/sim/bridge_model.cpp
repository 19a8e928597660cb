// SPDX-License-Identifier: Apache-2.0
// Clocks and events around the Verilated bridge. See bridge_model.h.
#include "bridge_model.h"

#include <algorithm>
#include <new>

#include "bridge_coverage.hpp"
#include "bridge_state.hpp"

// Verilator's code calls this when SystemC is not used.
double sc_time_stamp() {
    return 0;
}

namespace {

using namespace bridge;

void settle(bridge_model &model) {
    model.top->eval();
    model.unsettled = false;
    const uint32_t changes = collect(model);
    if ((changes & BRIDGE_EVENT_PPI_CLK) != 0 && model.pins.ppi_clk != 0 &&
        model.on_ppi != nullptr) {
        sample_ppi(model);
    }
    const uint32_t events = changes & model.wanted;
    if (events != 0) {
        model.on_event(model.event_context, model.now_ps, events, &model.outputs);
    }
}

uint8_t pixel_clocks(const bridge_model &model) {
    return static_cast<uint8_t>(model.clocks[0].level | model.clocks[1].level << 1);
}

// The edge counted last is evaluated after all: whole periods change nothing.
void catch_up(bridge_model &model) {
    if (!model.pending) {
        return;
    }
    const unsigned changed = model.top->pix_clk_i ^ pixel_clocks(model);
    model.pending = false;
    if (changed != 0) {
        for (unsigned i = 0; i < BRIDGE_CAMERAS; i++) {
            if ((changed & pixel_clocks(model) & 1u << i) != 0) {
                model.blank[i].count(*model.top->rootp, -1);
            }
        }
        model.top->pix_clk_i = pixel_clocks(model);
        model.top->eval();
        collect(model);
    }
}

void take_inputs(bridge_model &model) {
    catch_up(model);
    apply_inputs(model);
    const bridge_outputs was = model.outputs;
    join_lines(model);
    const bridge_outputs &now = model.outputs;
    uint32_t events = 0;
    if (was.scl != now.scl || was.sda != now.sda) {
        events |= BRIDGE_EVENT_BUS;
    }
    for (unsigned i = 0; i < 2; i++) {
        if (was.branch_scl[i] != now.branch_scl[i] || was.branch_sda[i] != now.branch_sda[i]) {
            events |= BRIDGE_EVENT_BRANCH;
        }
    }
    events &= model.wanted;
    if (events != 0) {
        model.on_event(model.event_context, model.now_ps, events, &model.outputs);
    }
}

void edge_of_control(bridge_model &model, Clock &clock) {
    clock.level = !clock.level;
    const unsigned next_phase = model.idle ? 0 : (model.phase + 1) % BRIDGE_CLOCKS_PER_US;
    if (clock.level) {
        model.phase = next_phase;
    } else {
        model.top->tick_next_i = next_phase == 0;
    }
    model.top->clk_i = clock.level;
    const uint32_t period =
        model.idle ? model.control_period_ps * BRIDGE_CLOCKS_PER_US : model.control_period_ps;
    clock.next_ps += clock.level ? period / 2 : period - period / 2;
}

// A falling edge of the control clock alone that would change nothing is skipped.
bool nothing_falls(bridge_model &model, bool tick_was) {
    return !model.unsettled && model.top->falling_counts_o == 0 &&
           (model.top->tick_next_i != 0) == tick_was && believe_clock_low(*model.top->rootp, 0);
}

// Consequences of an edge of a camera's clock that the bridge has processed.
void edge_of_camera(bridge_model &model, int camera) {
    const int level = model.clocks[camera].level;
    Feed &feed = model.feeds[camera];
    if (feed.used && level != feed.level) {
        return;
    }
    if (feed.next == feed.end && model.on_clock != nullptr) {
        model.on_clock(model.clock_context, model.now_ps, camera, level);
    }
    if (feed.next != feed.end) {
        const uint16_t word = *feed.next++;
        if (word != feed.word) {
            catch_up(model);
            model.blank[camera].forget();
            feed.word = word;
            apply_words(model);
        }
    }
}

// Just after an event: in idle time, clocks up to end_ps that only count are skipped.
void skip_still(bridge_model &model, uint64_t end_ps) {
    Clock &control = model.clocks[BRIDGE_CLOCK_CONTROL];
    const uint64_t period_ps = uint64_t{model.control_period_ps} * BRIDGE_CLOCKS_PER_US;
    const bool rose = control.level && control.next_ps == model.now_ps + period_ps / 2;
    if (!model.idle || !rose || model.stepping || model.unsettled || model.inputs_changed ||
        model.interrupted || model.top->falling_counts_o != 0) {
        return;
    }
    const uint64_t camera_ps = std::min(model.clocks[0].next_ps, model.clocks[1].next_ps);
    const uint64_t last_ps = std::min(end_ps, camera_ps - 1);
    const uint64_t still = model.skip.still(*model.top->rootp, model.resting);
    if (last_ps < model.now_ps + period_ps || still == 0) {
        return;
    }
    const uint64_t max = std::min(still, (last_ps - model.now_ps) / period_ps);
    const unsigned clocks = model.skip.pass(*model.top->rootp, static_cast<unsigned>(max));
    model.now_ps += clocks * period_ps;
    control.next_ps += clocks * period_ps;
}

void turn(Clock &clock) {
    clock.level = !clock.level;
    clock.next_ps += clock.level ? clock.period_ps / 2 : clock.period_ps - clock.period_ps / 2;
}

// Whether this camera's clock is the only running camera clock and its pins are constant.
bool is_blank(const bridge_model &model, int camera) {
    return (word_of(model, camera) & BRIDGE_WORD_LINE) == 0 && !model.stepping &&
           !model.unsettled && model.clocks[1 - camera].next_ps == kNever &&
           model.top->falling_counts_o == 0 && (model.wanted & BRIDGE_EVENT_PPI_CLK) == 0;
}

// The next edge of this clock, alone at its time, counts and does nothing else.
void count_edge(bridge_model &model, int camera) {
    Clock &clock = model.clocks[camera];
    turn(clock);
    model.pending = true;
    model.blank[camera].count(*model.top->rootp, clock.level);
    if (model.blank[camera].drives_ppi(*model.top->rootp)) {
        model.outputs.ppi_clk = clock.level;
        if (clock.level && model.on_ppi != nullptr) {
            sample_ppi(model);
        }
    }
    edge_of_camera(model, camera);
}

// Toggles the clocks of the cameras in `edges`.
void turn_cameras(bridge_model &model, unsigned edges) {
    for (int i = 0; i < BRIDGE_CAMERAS; i++) {
        if ((edges >> i & 1u) != 0) {
            turn(model.clocks[i]);
        }
    }
}

void edges_of_cameras(bridge_model &model, unsigned edges) {
    for (int i = 0; i < BRIDGE_CAMERAS; i++) {
        if ((edges >> i & 1u) != 0) {
            edge_of_camera(model, i);
        }
    }
}

// What the blanks record of a settled time step. `camera` is the only one with an edge, or -1.
void note_in_blanks(bridge_model &model, bool control_turns, int camera) {
    if (control_turns) {
        for (BlankSkip &blank : model.blank) {
            blank.control(*model.top->rootp);
        }
    } else if (camera >= 0 && model.clocks[camera].level && is_blank(model, camera)) {
        model.blank[camera].rose(*model.top->rootp);
    }
}

// Whether an edge of this camera's clock alone is only to be counted.
bool only_counts(bridge_model &model, int camera) {
    return is_blank(model, camera) &&
           model.blank[camera].counts(*model.top->rootp, !model.clocks[camera].level);
}

// The cameras whose clocks have an edge now, a bit each.
unsigned edges_now(const bridge_model &model) {
    return (model.clocks[0].next_ps == model.now_ps ? 1u : 0u) |
           (model.clocks[1].next_ps == model.now_ps ? 2u : 0u);
}

// The camera whose clock alone has an edge; -1: both have.
int only_camera(unsigned edges) {
    return edges == 3 ? -1 : edges == 2 ? 1 : 0;
}

void note_fall(bridge_model &model) {
    for (BlankSkip &blank : model.blank) {
        blank.fell(*model.top->rootp);
    }
}

// Runs one time step at which at least one clock has an edge.
void step(bridge_model &model) {
    Clock &control = model.clocks[BRIDGE_CLOCK_CONTROL];
    const bool control_turns = control.next_ps == model.now_ps;
    const bool tick_was = model.top->tick_next_i != 0;
    const unsigned edges = edges_now(model);
    const int alone = control_turns ? -1 : only_camera(edges);
    if (alone >= 0 && only_counts(model, alone)) {
        count_edge(model, alone);
        return;
    }
    // A change at a rising edge of the control clock, such as of the selected camera, came after
    // the pixel clock's last edge.
    const bool rises = control_turns && !control.level;
    if (edges != 0 || tick_was || rises) {
        catch_up(model);
    }
    if (control_turns) {
        edge_of_control(model, control);
    }
    turn_cameras(model, edges);
    if (edges != 0) {
        model.top->pix_clk_i = pixel_clocks(model);
    } else if (!control.level && nothing_falls(model, tick_was)) {
        note_fall(model);
        return;
    }
    settle(model);
    note_in_blanks(model, control_turns, alone);
    edges_of_cameras(model, edges);
}

uint64_t next_edge(const bridge_model &model) {
    return std::min({model.clocks[0].next_ps, model.clocks[1].next_ps, model.clocks[2].next_ps});
}

}  // namespace

bridge_model *bridge_model_create(uint32_t seed) {
    auto *model = new (std::nothrow) bridge_model;
    if (model == nullptr) {
        return nullptr;
    }
    model->context.randSeed(static_cast<int>(seed >> 1 | 1u));
    // Every flip-flop has an asynchronous reset, which the board activates at power-up. Verilator
    // evaluates such a reset at its edge only: starting from zeros, all of them see one.
    model->context.randReset(0);
    model->top = std::make_unique<Vbridge_sim>(&model->context, "");
    // They are zero now, and so is the padding between them from here on, for digests.
    Vbridge_sim___024root *root = model->top->rootp;
    auto *registers = reinterpret_cast<unsigned char *>(root) + sizeof(VerilatedModule);
    std::fill(registers,
              reinterpret_cast<unsigned char *>(const_cast<Vbridge_sim__Syms **>(&root->vlSymsp)),
              static_cast<unsigned char>(0));
    bridge_inputs &in = model->inputs;
    in.reset = 1;
    in.scl = in.sda = 1;
    in.branch_scl[0] = in.branch_scl[1] = in.branch_sda[0] = in.branch_sda[1] = 1;
    Clock &control = model->clocks[BRIDGE_CLOCK_CONTROL];
    control.period_ps = BRIDGE_CONTROL_PERIOD_PS;
    control.level = true;  // the first edge is a falling one, the first rising one ends a period
    control.next_ps = BRIDGE_CONTROL_PERIOD_PS / 2;
    Vbridge_sim &top = *model->top;
    top.clk_i = 1;
    top.pix_clk_i = 0;
    top.tick_next_i = 0;
    join_lines(*model);
    top.rst_i = 0;
    top.eval();
    take_inputs(*model);
    top.eval();
    join_lines(*model);
    top.eval();
    // All groups differ from this, so that the outputs are read once.
    model->pins = {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFFFF, 0xFFFF};
    collect(*model);
    return model;
}

void bridge_model_destroy(bridge_model *model) {
    if (model != nullptr) {
        model->top->final();
        add_coverage(*model->top);
        delete model;
    }
}

void bridge_model_begin_at(bridge_model *model, uint64_t time_ps) {
    model->now_ps += time_ps;
    model->clocks[BRIDGE_CLOCK_CONTROL].next_ps += time_ps;
}

void bridge_model_set_inputs(bridge_model *model, const bridge_inputs *inputs) {
    model->inputs = *inputs;
    model->inputs_changed = true;
}

void bridge_model_get_inputs(const bridge_model *model, bridge_inputs *inputs) {
    *inputs = model->inputs;
}

void bridge_model_get_outputs(const bridge_model *model, bridge_outputs *outputs) {
    *outputs = model->outputs;
}

void bridge_model_set_clock(bridge_model *model, int clock, uint32_t period_ps) {
    Clock &which = model->clocks[clock];
    if (clock == BRIDGE_CLOCK_CONTROL) {
        model->control_period_ps = period_ps;
        return;
    }
    if (period_ps == 0) {
        which.next_ps = kNever;
    } else if (which.next_ps == kNever) {
        which.next_ps = model->now_ps + period_ps / 2;
    }
    which.period_ps = period_ps;
}

void bridge_model_set_idle(bridge_model *model, int idle) {
    if (model->idle == (idle != 0)) {
        return;
    }
    // Up to just after the rising edge with a tick.
    const Clock &control = model->clocks[BRIDGE_CLOCK_CONTROL];
    while (model->phase != 0 || !control.level) {
        bridge_model_advance(model, next_edge(*model) - model->now_ps);
    }
    Clock &changed = model->clocks[BRIDGE_CLOCK_CONTROL];
    const uint32_t old_period =
        model->idle ? model->control_period_ps * BRIDGE_CLOCKS_PER_US : model->control_period_ps;
    const uint64_t rise = changed.next_ps - old_period / 2;
    model->idle = idle != 0;
    const uint32_t period =
        model->idle ? model->control_period_ps * BRIDGE_CLOCKS_PER_US : model->control_period_ps;
    changed.next_ps = rise + period / 2;
}

int bridge_model_may_rest(const bridge_model *model, unsigned alive) {
    return model->idle && !model->stepping && may_rest(*model->top->rootp, alive) ? 1 : 0;
}

void bridge_model_set_resting(bridge_model *model, int resting) {
    model->resting = resting != 0;
}

void bridge_model_set_stepping(bridge_model *model, int stepping) {
    model->stepping = stepping != 0;
}

uint64_t bridge_model_digest(const bridge_model *model) {
    const Vbridge_sim___024root &root = *model->top->rootp;
    const auto *bytes = reinterpret_cast<const unsigned char *>(&root);
    const auto *end = reinterpret_cast<const unsigned char *>(&root.vlSymsp);
    uint64_t digest = 0xCBF29CE484222325u;  // FNV-1a
    for (const unsigned char *at = bytes + sizeof(VerilatedModule); at != end; at++) {
        digest = (digest ^ *at) * 0x100000001B3u;
    }
    return digest;
}

void bridge_model_advance(bridge_model *model, uint64_t duration_ps) {
    const uint64_t end_ps = model->now_ps + duration_ps;
    model->interrupted = false;
    if (model->inputs_changed) {
        take_inputs(*model);
    }
    while (!model->interrupted) {
        const uint64_t next_ps = next_edge(*model);
        if (next_ps > end_ps) {
            break;
        }
        model->now_ps = next_ps;
        step(*model);
        if (model->inputs_changed) {
            take_inputs(*model);
        }
        skip_still(*model, end_ps);
    }
    if (!model->interrupted) {
        model->now_ps = end_ps;
    }
    catch_up(*model);
    if (model->unsettled) {  // a reset acts without a clock
        settle(*model);
    }
}

void bridge_model_interrupt(bridge_model *model) {
    model->interrupted = true;
}

uint64_t bridge_model_time_ps(const bridge_model *model) {
    return model->now_ps;
}

void bridge_model_on_event(bridge_model *model, uint32_t events, bridge_event_callback callback,
                           void *context) {
    model->wanted = callback == nullptr ? 0 : events;
    model->on_event = callback;
    model->event_context = context;
}

void bridge_model_on_clock(bridge_model *model, bridge_clock_callback callback, void *context) {
    model->on_clock = callback;
    model->clock_context = context;
}

void bridge_model_on_ppi(bridge_model *model, bridge_ppi_callback callback, void *context) {
    model->on_ppi = callback;
    model->ppi_context = context;
    model->run_count = 0;
    model->run_syncs = model->pins.ppi >> 10 & kSyncs;
}

void bridge_model_feed(bridge_model *model, int camera, const uint16_t *words, size_t count,
                       int level) {
    Feed &feed = model->feeds[camera];
    if (!feed.used) {
        feed.word = static_cast<uint16_t>(word_of(*model, camera));
        feed.used = true;
    }
    feed.next = words;
    feed.end = count == 0 ? words : words + count;
    feed.level = level != 0;
}

void bridge_model_show(bridge_model *model, int camera, uint16_t word) {
    model->feeds[camera].used = true;
    model->feeds[camera].word = word;
    model->inputs_changed = true;
}

unsigned bridge_model_watched(const bridge_model *model) {
    return model->top->watched_o;
}
