// SPDX-License-Identifier: Apache-2.0
/// Commands that only the host's `vergence` has. Each takes the arguments starting with its own
/// name and returns an exit code of daemon/client/client.h.
#ifndef VERGENCE_TOOLS_HOST_COMMANDS_COMMANDS_HPP
#define VERGENCE_TOOLS_HOST_COMMANDS_COMMANDS_HPP

#include "tools/host/calibrate/option_rows.hpp"

/// `vergence board`: a calibration board as a PDF.
int command_board(int argc, char **argv);

/// `vergence calibrate`: a stereo pair from pictures of a board.
int command_calibrate(int argc, char **argv);

/// `vergence calibrate capture`: the pictures for a calibration at all zooms.
int command_capture(int argc, char **argv);

/// `vergence evaluate`: how far a result is from the ground truth.
int command_evaluate(int argc, char **argv);

/// `vergence import`: a recording of another program as a session.
int command_import(int argc, char **argv);

/// `vergence info`: explains a calibration, a result or a session.
int command_info(int argc, char **argv);

/// `vergence measure`: the surface of a session that an instrument's `measure` took, by
/// `vergence reconstruct`, which is passed. `target`: a thing of known size in the pictures, as in
/// struct reconstruct_adjust_scene; NULL: none. Without it only checks the options: then
/// OPTIONS_CONTINUE, if they are right.
struct adjust_target;
int command_measure(int argc, char **argv,
                    int (*reconstruct)(int argc, char **argv, const adjust_target *target));

/// `vergence view`: what the cameras see, live in the browser.
int command_view(int argc, char **argv);

/// `vergence simulate`: executes the simulated rig, if it was built.
int command_simulate(int argc, char **argv);

#endif
