// SPDX-License-Identifier: Apache-2.0
// Messages for a pair that cannot be rectified.
#include <doctest/doctest.h>

#include <string>

#include "core/error.h"
#include "daemon/surface/reconstruct_summary.h"

namespace {

const reconstruct_caller caller = [] {
    reconstruct_caller named{};
    named.scale = named.smaller = "--scale";
    named.depth = named.search = "--depth";
    return named;
}();

}  // namespace

TEST_CASE("the scale in the message is in the user's terms") {
    calibration rig = {};
    reconstruct_options options = reconstruct_default_options();
    reconstruct_context context{};
    context.calibration = &rig;
    context.options = &options;
    context.caller = &caller;
    message text;
    context.shrink = 1;
    options.rectify.scale = 0.8;
    reconstruct_summary_no_plan(ERROR_TOO_LARGE, &context, &text);
    CHECK(std::string(text.text).find("--scale below 0.8") != std::string::npos);
    context.shrink = 3;
    options.rectify.scale = 3 * 0.25;
    reconstruct_summary_no_plan(ERROR_TOO_LARGE, &context, &text);
    CHECK(std::string(text.text).find("--scale below 0.25") != std::string::npos);
}

TEST_CASE("the message about an empty depth range states the range in use") {
    calibration rig = {};
    rig.depth_near_mm = 7;
    rig.depth_far_mm = 3;
    reconstruct_options options = reconstruct_default_options();
    reconstruct_context context{};
    context.calibration = &rig;
    context.options = &options;
    context.caller = &caller;
    context.shrink = 1;
    message text;
    reconstruct_summary_no_plan(ERROR_DEPTH_RANGE, &context, &text);
    CHECK(std::string(text.text).find("7:3 mm") != std::string::npos);
    options.rectify.depth_near_mm = 9;
    options.rectify.depth_far_mm = 2;
    reconstruct_summary_no_plan(ERROR_DEPTH_RANGE, &context, &text);
    CHECK(std::string(text.text).find("9:2 mm") != std::string::npos);
}
