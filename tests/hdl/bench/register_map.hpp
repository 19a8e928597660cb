// SPDX-License-Identifier: Apache-2.0
/// The register map's test vectors (fpga/generated/bridge_registers.json).
#ifndef VERGENCE_TESTS_HDL_BENCH_REGISTER_MAP_HPP
#define VERGENCE_TESTS_HDL_BENCH_REGISTER_MAP_HPP

#include <cstdint>
#include <nlohmann/json.hpp>
#include <set>

namespace hdl {

/// The file, parsed once.
const nlohmann::json &register_map();
std::set<uint8_t> register_indices();

}  // namespace hdl

#endif
