// SPDX-License-Identifier: Apache-2.0
// The client for hosts, with all formats, the report, evaluation and explanation.
#include "daemon/backends/replay/replay_command.h"
#include "daemon/client/client.h"
#include "daemon/surface/export_command.h"
#include "daemon/surface/reconstruct_command.h"
#include "tools/host/commands/commands.hpp"
#include "tools/host/program/host_program.hpp"
#include "tools/host/recordings/recording_export.hpp"

namespace {

int reconstruct(int argc, char **argv, const adjust_target *target) {
    reconstruct_program program = host_program();
    program.target = target;
    return reconstruct_command_run(&program, argc, argv);
}

int run_reconstruct(int argc, char **argv) {
    return reconstruct(argc, argv, nullptr);
}

int run_measure(int argc, char **argv) {
    return command_measure(argc, argv, reconstruct);
}

int check_measure(int argc, char **argv) {
    return command_measure(argc, argv, nullptr);
}

int run_export(int argc, char **argv) {
    return export_command_run(argc, argv, recording_export);
}

const client_command commands[] = {
    {"measure", "make the surface of a measurement of an instrument", run_measure, check_measure},
    {"reconstruct", "measure a surface from a pair of images", run_reconstruct, nullptr},
    {"calibrate", "calibrate a stereo pair from pictures of a board", command_calibrate, nullptr},
    {"calibrate capture", "take the pictures for a calibration at all zooms", command_capture,
     nullptr},
    {"board", "make a printable calibration board", command_board, nullptr},
    {"evaluate", "compare a result with the ground truth", command_evaluate, nullptr},
    {"info", "explain a calibration, a result or a session", command_info, nullptr},
    {"export", "write the pairs of a session for other programs", run_export, nullptr},
    {"import", "take pairs that another program recorded into a session", command_import, nullptr},
    {"view", "show live in the browser what the cameras see", command_view, nullptr},
    {"replay", "play a recording again and compare the pairs", replay_command_run, nullptr},
    {"simulate", "start a simulated rig, or show what it would see", command_simulate, nullptr},
};

}  // namespace

int main(int argc, char **argv) {
    return client_main(argc, argv, commands, sizeof commands / sizeof commands[0]);
}
