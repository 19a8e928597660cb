// SPDX-License-Identifier: Apache-2.0
/// Reads files of OpenCV's FileStorage in its three formats (YAML, XML, JSON) without OpenCV, whose
/// parser crashes on some damaged files, and arrays that numpy saved. Keeps only the top level, and
/// of it only entries with numbers.
#ifndef VERGENCE_TOOLS_HOST_CONVERT_IMPORT_STORAGE_HPP
#define VERGENCE_TOOLS_HOST_CONVERT_IMPORT_STORAGE_HPP

#include <string>
#include <vector>

#include "tools/host/convert/import.hpp"

enum class import_storage_kind { number, list, matrix, other };

struct import_storage_entry {
    std::string name;
    import_storage_kind kind = import_storage_kind::other;
    int rows = 0, columns = 0, channels = 1;  // size of a matrix
    std::vector<double> numbers;              // one, the list's, or the matrix's row by row
    std::string unread;                       // what an array of kind other is, where it is known
};

/// All entries in the order of the file. Throws `import_failure` for a damaged file. A word in the
/// place of a number becomes a NaN.
std::vector<import_storage_entry> import_storage_read(const import_file &file);

#endif
