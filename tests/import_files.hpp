// SPDX-License-Identifier: Apache-2.0
/// Files that the tests of the importers write and load, and the published samples.
#ifndef VERGENCE_TESTS_IMPORT_FILES_HPP
#define VERGENCE_TESTS_IMPORT_FILES_HPP

#include <doctest/doctest.h>

#include <string>

#include "core/error.h"
#include "scratch.hpp"
#include "tools/host/convert/calibration_file.hpp"

namespace import_files {

using folder = scratch;

struct loaded {
    int code;
    calibration value;
    calibration_file_report report;
    std::string message;
};

inline loaded load(const std::string &path, const import_options &options = {}) {
    loaded result{};
    result.code =
        calibration_file_load(path, options, &result.value, &result.report, &result.message);
    return result;
}

inline std::string replace(std::string text, const std::string &from, const std::string &to) {
    const size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    return text.replace(at, from.size(), to);
}

/// Refused with this code, in one line that names the file and all of `words`.
inline void check_refused(const std::string &path, const import_options &options, int code,
                          std::initializer_list<const char *> words) {
    const loaded result = load(path, options);
    INFO("message: ", result.message);
    CHECK(result.code == code);
    CHECK(result.message.find('\n') == std::string::npos);
    CHECK(result.message.find(path.substr(0, path.find(','))) == 0);
    for (const char *word : words) {
        INFO("word: ", std::string(word));
        CHECK(result.message.find(word) != std::string::npos);
    }
}

inline const char *const middlebury =
    "cam0=[3997.684 0 1176.728; 0 3997.684 1011.728; 0 0 1]\n"
    "cam1=[3997.684 0 1307.839; 0 3997.684 1011.728; 0 0 1]\n"
    "doffs=131.111\nbaseline=193.001\nwidth=2964\nheight=1988\nndisp=280\nisint=0\nvmin=31\n"
    "vmax=257\ndyavg=0.918\ndymax=1.516\n";

inline const char *const kitti_raw =
    "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.950000e-02\n"
    "S_00: 1.392000e+03 5.120000e+02\n"
    "K_00: 9.842439e+02 0.000000e+00 6.900000e+02 0.000000e+00 9.808141e+02 2.331966e+02 "
    "0.000000e+00 0.000000e+00 1.000000e+00\n"
    "D_00: -3.728755e-01 2.037299e-01 2.219027e-03 1.383707e-03 -7.233722e-02\n"
    "R_00: 1.000000e+00 0.000000e+00 0.000000e+00 0.000000e+00 1.000000e+00 0.000000e+00 "
    "0.000000e+00 0.000000e+00 1.000000e+00\n"
    "T_00: 2.573699e-16 -1.059758e-16 1.614870e-16\n"
    "S_01: 1.392000e+03 5.120000e+02\n"
    "K_01: 9.895267e+02 0.000000e+00 7.020000e+02 0.000000e+00 9.878386e+02 2.455590e+02 "
    "0.000000e+00 0.000000e+00 1.000000e+00\n"
    "D_01: -3.644661e-01 1.790019e-01 1.148107e-03 -6.298563e-04 -5.314062e-02\n"
    "R_01: 9.993513e-01 1.860866e-02 -3.083487e-02 -1.887662e-02 9.997863e-01 -8.421873e-03 "
    "3.067156e-02 8.998467e-03 9.994890e-01\n"
    "T_01: -5.370000e-01 4.822061e-03 -1.252488e-02\n"
    "S_02: 1.392000e+03 5.120000e+02\n"
    "K_02: 9.597910e+02 0.000000e+00 6.960217e+02 0.000000e+00 9.569251e+02 2.241806e+02 "
    "0.000000e+00 0.000000e+00 1.000000e+00\n"
    "D_02: -3.691481e-01 1.968681e-01 1.353473e-03 5.677587e-04 -6.770705e-02\n"
    "R_02: 9.999758e-01 -5.267463e-03 -4.552439e-03 5.251945e-03 9.999804e-01 -3.413835e-03 "
    "4.570332e-03 3.389843e-03 9.999838e-01\n"
    "T_02: 5.956621e-02 2.900141e-04 2.577209e-03\n"
    "S_rect_02: 1.242000e+03 3.750000e+02\n"
    "R_rect_02: 9.998817e-01 1.511453e-02 -2.841595e-03 -1.511724e-02 9.998853e-01 -9.338510e-04 "
    "2.827154e-03 9.766976e-04 9.999955e-01\n"
    "P_rect_02: 7.215377e+02 0.000000e+00 6.095593e+02 4.485728e+01 0.000000e+00 7.215377e+02 "
    "1.728540e+02 2.163791e-01 0.000000e+00 0.000000e+00 1.000000e+00 2.745884e-03\n"
    "S_03: 1.392000e+03 5.120000e+02\n"
    "K_03: 9.037596e+02 0.000000e+00 6.957519e+02 0.000000e+00 9.019653e+02 2.242509e+02 "
    "0.000000e+00 0.000000e+00 1.000000e+00\n"
    "D_03: -3.639558e-01 1.788651e-01 6.029694e-04 -3.922424e-04 -5.382460e-02\n"
    "R_03: 9.995599e-01 1.699522e-02 -2.431313e-02 -1.704422e-02 9.998531e-01 -1.809756e-03 "
    "2.427880e-02 2.223358e-03 9.997028e-01\n"
    "T_03: -4.731050e-01 5.551470e-03 -5.250882e-03\n"
    "S_rect_03: 1.242000e+03 3.750000e+02\n"
    "R_rect_03: 9.998321e-01 -7.193136e-03 1.685599e-02 7.232804e-03 9.999712e-01 -2.293585e-03 "
    "-1.683901e-02 2.415116e-03 9.998553e-01\n"
    "P_rect_03: 7.215377e+02 0.000000e+00 6.095593e+02 -3.395242e+02 0.000000e+00 7.215377e+02 "
    "1.728540e+02 2.199936e+00 0.000000e+00 0.000000e+00 1.000000e+00 2.729905e-03\n";

inline const char *const kitti_odometry =
    "P0: 7.188560e+02 0.000000e+00 6.071928e+02 0.000000e+00 0.000000e+00 7.188560e+02 "
    "1.852157e+02 0.000000e+00 0.000000e+00 0.000000e+00 1.000000e+00 0.000000e+00\n"
    "P1: 7.188560e+02 0.000000e+00 6.071928e+02 -3.861448e+02 0.000000e+00 7.188560e+02 "
    "1.852157e+02 0.000000e+00 0.000000e+00 0.000000e+00 1.000000e+00 0.000000e+00\n"
    "P2: 7.188560e+02 0.000000e+00 6.071928e+02 4.538225e+01 0.000000e+00 7.188560e+02 "
    "1.852157e+02 -1.130887e-01 0.000000e+00 0.000000e+00 1.000000e+00 3.779761e-03\n"
    "P3: 7.188560e+02 0.000000e+00 6.071928e+02 -3.372877e+02 0.000000e+00 7.188560e+02 "
    "1.852157e+02 2.369057e+00 0.000000e+00 0.000000e+00 1.000000e+00 4.915215e-03\n";

}  // namespace import_files

#endif
