// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdio>
#include <string>

#include "daemon/base/json.h"
#include "daemon/cli/options.h"
#include "daemon/files/input_file.h"
#include "tools/host/commands/commands.hpp"
#include "tools/host/evaluate/evaluate.hpp"
#include "tools/host/formats/pfm.hpp"

namespace {

struct request {
    const char *truth_path;
    const char *mask_path;
    double truth_scale;
    bool round;
    bool json;
};

const command_argument options[] = {
    text_option(
        "ground-truth", offsetof(request, truth_path), "FILE",
        "True disparities of the left view, in the size of the result: PFM (inf where unknown), "
        "16-bit PNG as KITTI has it (256 = 1 px, 0 unknown) or 8-bit PNG (0 unknown; needs "
        "--ground-truth-scale). Required."),
    number_option("ground-truth-scale", COMMAND_NUMBER, offsetof(request, truth_scale), "S",
                  "PNG values per pixel of disparity, e.g. 1 or 4.", 1e-3, 65535),
    text_option(
        "mask", offsetof(request, mask_path), "FILE",
        "PNG of the same size: 255 seen by both cameras, 128 occluded in the right one, 0 unknown. "
        "Without it occlusion is not known, and only the figures for all pixels are given."),
    flag_option(
        "round", offsetof(request, round),
        "Round the disparities to whole pixels first: fair if the truth is in whole pixels."),
    flag_option("json", offsetof(request, json), "Print JSON."),
};

const option_page page = {
    "vergence evaluate",
    "DIR",
    "compare a result with the ground truth",
    "Reads DIR/disparity.pfm (or DIR itself when it is a PFM file) and prints how far it is from "
    "the truth. bad-t is the share of pixels whose disparity is off by more than t px.\n"
    "\"filled\" counts every pixel: a rejected one gets the smaller of the nearest measured "
    "disparities to its left and right in its row (the only one at the borders, 0 in an empty "
    "row), so that rejecting pixels gains nothing. \"measured\" counts the pixels that have a "
    "value of their own, and the density is their share of the known ones.",
    "vergence evaluate out --ground-truth disp0.pfm --mask mask0nocc.png\n"
    "vergence evaluate out --ground-truth aloeGT.png --ground-truth-scale 1",
    options,
    sizeof options / sizeof options[0],
    1,
    1,
};

int refuse(int code, const std::string &text) {
    std::fprintf(stderr, "vergence evaluate: %s\n", text.c_str());
    return code;
}

/// One row of the table, one object of the JSON.
struct named_score {
    const char *text, *json_name;
    const evaluate_score *score;
    const double *density_percent;  // NULL where every pixel has a value
};

void print_table(const named_score *rows, std::size_t count) {
    std::printf("%-28s %9s %8s %7s %7s %7s %7s %9s %9s\n", "", "pixels", "density", "bad-0.5",
                "bad-1", "bad-2", "bad-4", "average", "rms");
    for (std::size_t i = 0; i < count; i++) {
        const evaluate_score &s = *rows[i].score;
        std::printf("%-28s %9zu %6.2f %% %7.2f %7.2f %7.2f %7.2f %6.3f px %6.3f px\n", rows[i].text,
                    s.pixels, rows[i].density_percent != nullptr ? *rows[i].density_percent : 100.0,
                    s.bad_percent[0], s.bad_percent[1], s.bad_percent[2], s.bad_percent[3],
                    s.average_px, s.rms_px);
    }
}

void print_json(const named_score *rows, std::size_t count, const request &asked) {
    struct json out;
    json_begin(&out, stdout);
    json_open_object(&out, nullptr);
    json_text(&out, "ground_truth", asked.truth_path);
    json_text(&out, "mask", asked.mask_path);
    json_bool(&out, "rounded", asked.round);
    for (std::size_t i = 0; i < count; i++) {
        const evaluate_score &s = *rows[i].score;
        json_open_object(&out, rows[i].json_name);
        json_integer(&out, "pixels", static_cast<std::int64_t>(s.pixels));
        json_real(&out, "density_percent",
                  rows[i].density_percent != nullptr ? *rows[i].density_percent : 100.0, 6);
        static const char *const names[EVALUATE_THRESHOLDS] = {"bad_0_5_percent", "bad_1_percent",
                                                               "bad_2_percent", "bad_4_percent"};
        for (int k = 0; k < EVALUATE_THRESHOLDS; k++) {
            json_real(&out, names[k], s.bad_percent[k], 6);
        }
        json_real(&out, "average_px", s.average_px, 6);
        json_real(&out, "rms_px", s.rms_px, 6);
        json_close_object(&out);
    }
    json_close_object(&out);
    json_end(&out);
}

void print_result(const evaluate_result &result, const request &asked) {
    const named_score rows[] = {
        {"filled, all known", "filled_all", &result.filled_all, nullptr},
        {"measured, all known", "measured_all", &result.saved_all, &result.density_all_percent},
        {"filled, not occluded", "filled_visible", &result.filled_visible, nullptr},
        {"measured, not occluded", "measured_visible", &result.kept_visible,
         &result.density_visible_percent},
    };
    const std::size_t count = asked.mask_path != nullptr ? 4 : 2;
    if (asked.json) {
        print_json(rows, count, asked);
    } else {
        print_table(rows, count);
    }
}

}  // namespace

int command_evaluate(int argc, char **argv) {
    request asked{};
    const char *operand = nullptr;
    int operand_count = 0;
    const int parsed = options_parse(&page, argc, argv, &asked, &operand, &operand_count);
    if (parsed != OPTIONS_CONTINUE) {
        return parsed;
    }
    if (asked.truth_path == nullptr) {
        return refuse(CLIENT_USAGE, "--ground-truth FILE is missing; see vergence evaluate --help");
    }

    std::string path = operand, message;
    if (input_file_is_directory(path.c_str())) {
        path += "/disparity.pfm";
    }
    pfm_image disparity;
    evaluate_truth truth;
    if (!pfm_read(path, &disparity, &message) ||
        !evaluate_truth_load(asked.truth_path, asked.mask_path != nullptr ? asked.mask_path : "",
                             asked.truth_scale, &truth, &message)) {
        return refuse(CLIENT_BAD_INPUT, message);
    }
    if (truth.width_px != disparity.width_px || truth.height_px != disparity.height_px) {
        return refuse(CLIENT_BAD_INPUT,
                      std::string(asked.truth_path) + ": the ground truth is " +
                          std::to_string(truth.width_px) + "x" + std::to_string(truth.height_px) +
                          ", the result " + std::to_string(disparity.width_px) + "x" +
                          std::to_string(disparity.height_px) + " (sizes must be equal)");
    }

    evaluate_input input;
    input.width_px = disparity.width_px;
    input.height_px = disparity.height_px;
    input.disparity_px = disparity.values.data();
    input.truth_px = truth.disparity_px.data();
    input.mask = truth.mask.empty() ? nullptr : truth.mask.data();
    input.round_disparity = asked.round;
    const evaluate_result result = evaluate_disparity(input);
    if (result.filled_all.pixels == 0) {
        return refuse(CLIENT_BAD_INPUT,
                      std::string(asked.truth_path) + ": the ground truth has no known pixel");
    }
    print_result(result, asked);
    return CLIENT_OK;
}
