// SPDX-License-Identifier: Apache-2.0
#include "tools/host/program/host_program.hpp"

#include "tools/host/convert/calibration_file.hpp"
#include "tools/host/debug/debug.hpp"
#include "tools/host/evaluate/evaluate.hpp"
#include "tools/host/formats/image_formats.hpp"
#include "tools/host/formats/write_png.hpp"
#include "tools/host/mesh/mesh_simplify.hpp"
#include "tools/host/mesh/write_glb.hpp"
#include "tools/host/report/report.hpp"

reconstruct_program host_program() {
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
    program.writers[RESULT_COMPACT] = compact_write;
    program.writers[RESULT_RESULT_JSON] = write_result;
    program.check_truth = evaluate_truth_check;
    program.make_mesh = mesh_simplify_make;
    program.free_mesh = mesh_simplify_free;
    debug_offer(&program);
    return program;
}
