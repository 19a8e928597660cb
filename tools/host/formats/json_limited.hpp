// SPDX-License-Identifier: Apache-2.0
/// JSON of strangers: what is done with a document is recursive, so its depth is limited while it
/// is read.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_JSON_LIMITED_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_JSON_LIMITED_HPP

#include <nlohmann/json.hpp>
#include <utility>

/// Discarded where the input (text or stream) is not JSON; `*too_deep`: it is nested deeper than
/// this.
template <class Input>
nlohmann::ordered_json json_limited(Input &&input, int depth_max, bool *too_deep) {
    *too_deep = false;
    const auto watch_depth = [depth_max, too_deep](int depth, nlohmann::ordered_json::parse_event_t,
                                                   nlohmann::ordered_json &) {
        *too_deep = *too_deep || depth > depth_max;
        return !*too_deep;
    };
    return nlohmann::ordered_json::parse(std::forward<Input>(input), watch_depth, false);
}

#endif
