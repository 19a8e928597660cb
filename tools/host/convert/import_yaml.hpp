// SPDX-License-Identifier: Apache-2.0
/// Shared by the YAML importers.
#ifndef VERGENCE_TOOLS_HOST_CONVERT_IMPORT_YAML_HPP
#define VERGENCE_TOOLS_HOST_CONVERT_IMPORT_YAML_HPP

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

#include "tools/host/convert/import.hpp"

/// The map in `text`, from `file`, which may begin with OpenCV's %YAML:1.0; rejects anything that
/// is not YAML or not a map, naming the expected kind of file ("a camera chain of Kalibr").
YAML::Node import_yaml_map(const import_file &file, const std::string &text,
                           const std::string &what);

/// The text of a scalar; "" for any other node and for a missing one.
std::string import_yaml_word(const YAML::Node &node);

/// The numbers of a list, or a single one. `field` names the node in messages; rejects a missing or
/// other node.
std::vector<double> import_yaml_numbers(const import_file &file, const std::string &field,
                                        const YAML::Node &node);

/// The same, exactly `count` of them.
std::vector<double> import_yaml_numbers(const import_file &file, const std::string &field,
                                        const YAML::Node &node, size_t count);

/// A 4x4 pose: 16 numbers in a list, four rows of four, or either as `data` of a matrix.
import_matrix4 import_yaml_pose(const import_file &file, const std::string &field,
                                const YAML::Node &node);

/// A lens from fx fy cx cy and coefficients in OpenCV's order (`import_distortion`), and from width
/// and height.
lens import_yaml_lens(const import_file &file, const std::string &field,
                      const std::vector<double> &intrinsics, const std::vector<double> &size_px,
                      const std::vector<double> &D);

#endif
