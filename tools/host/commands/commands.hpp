// SPDX-License-Identifier: Apache-2.0
/// Commands that only the host's `vergence` has. Each takes the arguments starting with its own
/// name and returns an exit code of daemon/client/client.h.
#ifndef VERGENCE_TOOLS_HOST_COMMANDS_COMMANDS_HPP
#define VERGENCE_TOOLS_HOST_COMMANDS_COMMANDS_HPP

/// `vergence board`: a calibration board as a PDF.
int command_board(int argc, char **argv);

/// `vergence calibrate`: a stereo pair from pictures of a board.
int command_calibrate(int argc, char **argv);

/// `vergence evaluate`: how far a result is from the ground truth.
int command_evaluate(int argc, char **argv);

/// `vergence info`: explains a calibration, a result or a session.
int command_info(int argc, char **argv);

/// `vergence simulate`: executes the simulated rig, if it was built.
int command_simulate(int argc, char **argv);

#endif
