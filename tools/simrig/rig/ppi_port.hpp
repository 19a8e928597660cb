// SPDX-License-Identifier: Apache-2.0
/// The Blackfin's parallel port with two frame syncs: takes one frame from the bridge when armed.
#ifndef VERGENCE_SIMRIG_RIG_PPI_PORT_HPP
#define VERGENCE_SIMRIG_RIG_PPI_PORT_HPP

#include <cstdint>
#include <vector>

#include "tools/simrig/rig/wires.hpp"

namespace simrig {

struct PpiFrame {
    uint64_t begin_ps = 0, end_ps = 0;
    uint32_t number = 0;  ///< number of the frame among those that passed the port since the start
    unsigned columns = 0, rows = 0;
    bool short_line = false, short_frame = false, long_frame = false;
    std::vector<uint16_t> pixels;  ///< columns * rows; missing pixels are 0
};

class PpiPort : public PpiListener {
  public:
    explicit PpiPort(Wires &wires) : wires_(wires) { wires.listen_ppi(*this); }

    void on_run(uint64_t time_ps, const uint16_t *data, size_t count,
                const bridge_outputs &now) override;

    /// Arms for the next frame that begins. stop_when_done: calls Wires::stop() at its end.
    void arm(unsigned columns, unsigned rows);
    void cancel();
    bool armed() const { return armed_; }
    bool done() const { return done_; }
    /// The frame, once done().
    PpiFrame take();
    /// Begin of the frame in progress; 0: none.
    uint64_t taking_since_ps() const { return taking_ ? frame_.begin_ps : 0; }

  private:
    void take_pixels(const uint16_t *data, size_t count);
    void end_line();

    Wires &wires_;
    PpiFrame frame_;
    bool armed_ = false, taking_ = false, done_ = false;
    bool frame_valid_ = false, line_valid_ = false;
    unsigned row_ = 0, column_ = 0;
    uint32_t frames_ = 0;
};

}  // namespace simrig

#endif
