// SPDX-License-Identifier: Apache-2.0
#include "register_map.hpp"

#include <fstream>

namespace hdl {

const nlohmann::json &register_map() {
    static const nlohmann::json map = nlohmann::json::parse(std::ifstream(VERGENCE_REGISTER_MAP));
    return map;
}

std::set<uint8_t> register_indices() {
    std::set<uint8_t> indices;
    for (const auto &reg : register_map().at("registers")) {
        indices.insert(reg.at("index").get<uint8_t>());
    }
    return indices;
}

}  // namespace hdl
