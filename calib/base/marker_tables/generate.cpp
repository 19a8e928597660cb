// SPDX-License-Identifier: Apache-2.0
// Writes the marker dictionaries of OpenCV's aruco module as a C++ table at build time, so that
// released programs do not need OpenCV. Usage: generate OUTPUT.
#include <cstdint>
#include <cstdio>
#include <opencv2/aruco.hpp>

namespace {

struct source {
    const char *name;
    int id;
};

const source sources[] = {
    {"4x4_50", cv::aruco::DICT_4X4_50},
    {"4x4_100", cv::aruco::DICT_4X4_100},
    {"4x4_250", cv::aruco::DICT_4X4_250},
    {"4x4_1000", cv::aruco::DICT_4X4_1000},
    {"5x5_50", cv::aruco::DICT_5X5_50},
    {"5x5_100", cv::aruco::DICT_5X5_100},
    {"5x5_250", cv::aruco::DICT_5X5_250},
    {"5x5_1000", cv::aruco::DICT_5X5_1000},
    {"6x6_50", cv::aruco::DICT_6X6_50},
    {"6x6_100", cv::aruco::DICT_6X6_100},
    {"6x6_250", cv::aruco::DICT_6X6_250},
    {"6x6_1000", cv::aruco::DICT_6X6_1000},
    {"7x7_50", cv::aruco::DICT_7X7_50},
    {"7x7_100", cv::aruco::DICT_7X7_100},
    {"7x7_250", cv::aruco::DICT_7X7_250},
    {"7x7_1000", cv::aruco::DICT_7X7_1000},
    {"aruco_original", cv::aruco::DICT_ARUCO_ORIGINAL},
    {"apriltag_16h5", cv::aruco::DICT_APRILTAG_16h5},
    {"apriltag_25h9", cv::aruco::DICT_APRILTAG_25h9},
    {"apriltag_36h10", cv::aruco::DICT_APRILTAG_36h10},
    {"apriltag_36h11", cv::aruco::DICT_APRILTAG_36h11},
};

uint64_t code_of(const cv::aruco::Dictionary &dictionary, int marker) {
    const cv::Mat bits = cv::aruco::Dictionary::getBitsFromByteList(
        dictionary.bytesList.rowRange(marker, marker + 1), dictionary.markerSize);
    uint64_t code = 0;
    for (int row = 0; row < bits.rows; row++) {
        for (int column = 0; column < bits.cols; column++) {
            code = code << 1 | bits.at<uint8_t>(row, column);
        }
    }
    return code;
}

}  // namespace

int main(int argc, char **argv) {
    FILE *out = argc == 2 ? std::fopen(argv[1], "w") : nullptr;
    if (out == nullptr) {
        std::fprintf(stderr, "usage: generate OUTPUT\n");
        return 2;
    }
    std::fprintf(out,
                 "// Generated from OpenCV's aruco module (Apache-2.0).\n"
                 "#include \"calib/base/marker.hpp\"\n\nnamespace calib {\n\nnamespace {\n\n");
    for (size_t i = 0; i < std::size(sources); i++) {
        const auto dictionary = cv::aruco::getPredefinedDictionary(sources[i].id);
        std::fprintf(out, "const uint64_t codes_%zu[] = {", i);
        for (int marker = 0; marker < dictionary->bytesList.rows; marker++) {
            std::fprintf(out, "%s0x%llxULL,", marker % 6 == 0 ? "\n    " : " ",
                         static_cast<unsigned long long>(code_of(*dictionary, marker)));
        }
        std::fprintf(out, "\n};\n");
    }
    std::fprintf(out, "\nconst marker_dictionary dictionaries[] = {\n");
    for (size_t i = 0; i < std::size(sources); i++) {
        const auto dictionary = cv::aruco::getPredefinedDictionary(sources[i].id);
        std::fprintf(out, "    {\"%s\", %d, %d, %d, codes_%zu},\n", sources[i].name,
                     dictionary->markerSize, dictionary->bytesList.rows,
                     dictionary->maxCorrectionBits, i);
    }
    std::fprintf(out,
                 "};\n\n}  // namespace\n\nmarker_dictionary_list marker_dictionaries() {\n"
                 "    return {dictionaries, sizeof dictionaries / sizeof *dictionaries};\n"
                 "}\n\n}  // namespace calib\n");
    return std::fclose(out) == 0 ? 0 : 1;
}
