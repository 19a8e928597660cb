// SPDX-License-Identifier: Apache-2.0
// The client for hosts, with all formats, the report, evaluation and explanation.
#include "daemon/backends/replay/replay_command.h"
#include "daemon/client/client.h"
#include "daemon/surface/export_command.h"
#include "daemon/surface/reconstruct_command.h"
#include "daemon/surface/result/write.h"
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

const result_writer writers[] = {
    {"disparity.pfm", false, write_pfm, WRITE_PFM_PIXEL_BYTES},
    {"disparity.png", false, write_png_disparity, 0},
    {"depth.png", true, write_png_depth, 0},
    {"reasons.png", false, write_png_reasons, 0},
    {"left_rectified.png", false, write_png_left, 0},
    {"right_rectified.png", false, write_png_right, 0},
    {"points.pcd", false, write_pcd, WRITE_PCD_PIXEL_BYTES},
    {"mesh.ply", false, write_ply, WRITE_PLY_PIXEL_BYTES},
    {"mesh.glb", false, write_glb, 0},
    {"report.html", false, report_write, 0},
    {"result.json", false, write_result, 0},
};

int run_reconstruct(int argc, char **argv) {
    const reconstruct_outputs outputs{writers,
                                      sizeof writers / sizeof writers[0],
                                      evaluate_truth_check,
                                      debug_maker(),
                                      mesh_simplify_make,
                                      mesh_simplify_free};
    const reconstruct_files files{image_formats().first, image_formats().count,
                                  calibration_file_loader};
    return reconstruct_command_run(&files, &outputs, argc, argv);
}

const client_command commands[] = {
    {"reconstruct", "measure a surface from a pair of images", run_reconstruct},
    {"calibrate", "calibrate a stereo pair from pictures of a board", command_calibrate},
    {"calibrate capture", "take the pictures for a calibration at all zooms", command_capture},
    {"board", "make a printable calibration board", command_board},
    {"evaluate", "compare a result with the ground truth", command_evaluate},
    {"info", "explain a calibration, a result or a session", command_info},
    {"export", "write the pairs of a session as pictures", export_command_run},
    {"replay", "play a recording again and compare the pairs", replay_command_run},
    {"simulate", "start a simulated rig, or show what it would see", command_simulate},
};

}  // namespace

int main(int argc, char **argv) {
    return client_main(argc, argv, commands, sizeof commands / sizeof commands[0]);
}
