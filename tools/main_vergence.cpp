// SPDX-License-Identifier: Apache-2.0
// The client for hosts, with all formats, the report, evaluation and explanation.
#include "daemon/backends/replay/replay_command.h"
#include "daemon/client/client.h"
#include "daemon/surface/export_command.h"
#include "daemon/surface/reconstruct_command.h"
#include "tools/host/commands/commands.hpp"
#include "tools/host/convert/calibration_file.hpp"
#include "tools/host/debug/debug.hpp"
#include "tools/host/evaluate/evaluate.hpp"
#include "tools/host/formats/image_formats.hpp"
#include "tools/host/formats/write_png.hpp"
#include "tools/host/mesh/mesh_simplify.hpp"
#include "tools/host/mesh/write_glb.hpp"
#include "tools/host/report/report.hpp"

namespace {

int reconstruct(int argc, char **argv, const adjust_target *target) {
    reconstruct_program program{};
    program.formats = image_formats().first;
    program.format_count = image_formats().count;
    program.load_calibration = calibration_file_loader;
    program.writers[RESULT_DISPARITY_PFM] = write_pfm;
    program.writers[RESULT_DISPARITY_PNG] = write_png_disparity;
    program.writers[RESULT_DEPTH_PNG] = write_png_depth;
    program.writers[RESULT_REASONS_PNG] = write_png_reasons;
    program.writers[RESULT_LEFT_PNG] = write_png_left;
    program.writers[RESULT_RIGHT_PNG] = write_png_right;
    program.writers[RESULT_POINTS_PCD] = write_pcd;
    program.writers[RESULT_MESH_PLY] = write_ply;
    program.writers[RESULT_MESH_GLB] = write_glb;
    program.writers[RESULT_REPORT_HTML] = report_write;
    program.writers[RESULT_RESULT_JSON] = write_result;
    program.check_truth = evaluate_truth_check;
    program.make_mesh = mesh_simplify_make;
    program.free_mesh = mesh_simplify_free;
    program.target = target;
    debug_offer(&program);
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

const client_command commands[] = {
    {"measure", "make the surface of a measurement of an instrument", run_measure, check_measure},
    {"reconstruct", "measure a surface from a pair of images", run_reconstruct, nullptr},
    {"calibrate", "calibrate a stereo pair from pictures of a board", command_calibrate, nullptr},
    {"calibrate capture", "take the pictures for a calibration at all zooms", command_capture,
     nullptr},
    {"board", "make a printable calibration board", command_board, nullptr},
    {"evaluate", "compare a result with the ground truth", command_evaluate, nullptr},
    {"info", "explain a calibration, a result or a session", command_info, nullptr},
    {"export", "write the pairs of a session as pictures", export_command_run, nullptr},
    {"view", "show live in the browser what the cameras see", command_view, nullptr},
    {"replay", "play a recording again and compare the pairs", replay_command_run, nullptr},
    {"simulate", "start a simulated rig, or show what it would see", command_simulate, nullptr},
};

}  // namespace

int main(int argc, char **argv) {
    return client_main(argc, argv, commands, sizeof commands / sizeof commands[0]);
}
