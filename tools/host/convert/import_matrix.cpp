// SPDX-License-Identifier: Apache-2.0
/// K.txt, as FoundationStereo's demo reads it: the camera matrix of a rectified pair in nine
/// numbers, row by row, and below it the baseline in m. Both cameras have the same matrix.
#include <sstream>

#include "core/error.h"
#include "tools/host/convert/import.hpp"

namespace {

const size_t matrix_numbers = 9;

/// The text in one line.
std::string joined(const std::string &text) {
    std::istringstream words(text);
    std::string word, line;
    while (words >> word) {
        line += word + " ";
    }
    return line;
}

}  // namespace

bool import_matrix_matches(const std::string &text) {
    std::istringstream words(text);
    std::vector<double> numbers;
    double value;
    while (words >> value && numbers.size() <= matrix_numbers) {
        numbers.push_back(value);
    }
    // fx 0 cx, 0 fy cy, 0 0 1: no other list of numbers looks like this.
    return numbers.size() >= matrix_numbers && numbers[3] == 0 && numbers[6] == 0 &&
           numbers[7] == 0 && numbers[8] == 1;
}

import_pair import_matrix(const import_file &file, const import_options &options) {
    import_pair pair;
    pair.format = "K.txt";
    pair.tag = "matrix";
    const std::string line = joined(file.text);
    const std::vector<double> all = import_numbers(
        file, "nine numbers of a camera matrix and the baseline", line, matrix_numbers + 1);
    const double baseline_mm = all[matrix_numbers] * import_unit_mm(options, metre_mm, &pair);
    if (!(baseline_mm > 0)) {
        import_fail(ERROR_BASELINE, file, "the last number, the baseline, must be above 0");
    }
    import_camera_matrix(file, "the camera matrix", all, &pair.value.left);
    pair.value.right = pair.value.left;
    import_stated_size(file, "this K.txt", options, &pair);
    pair.value.rectified = true;
    pair.value.translation_right_left_mm[0] = -baseline_mm;
    pair.assumed.push_back("images are the rectified ones, and both cameras have the same matrix");
    return pair;
}
