// SPDX-License-Identifier: Apache-2.0
/// Reads the arrays that numpy.savez or savez_compressed wrote: a zip of files in numpy's format.
/// Source: APPNOTE.TXT of PKWARE, numpy.lib.format.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_NUMPY_ARCHIVE_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_NUMPY_ARCHIVE_HPP

#include <string>
#include <vector>

struct numpy_array {
    std::string name;
    std::string type;             // numpy's name of the type: <f8, |u1, |O
    std::vector<long> shape;      // empty: a single number
    std::vector<double> numbers;  // row by row; empty for an array of anything but real numbers
};

/// Whether the bytes begin as a zip does, or as a single array of numpy.
bool numpy_archive_matches(const std::string &bytes);
bool numpy_array_matches(const std::string &bytes);

/// All arrays of an archive, in its order. On failure false and the reason, one line. Members other
/// than arrays are skipped. Arrays above 4096 numbers have no numbers: a calibration has none.
bool numpy_archive_read(const std::string &bytes, std::vector<numpy_array> *arrays,
                        std::string *reason);

#endif
