// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_maps.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace fs = std::filesystem;

namespace {

const char *type_of(float /*value*/) {
    return "<f4";
}
const char *type_of(std::uint8_t /*value*/) {
    return "|u1";
}

// Format: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html, version 1.0.
template <typename value_type>
void write(const fs::path &path, const cv::Size &size, const std::vector<value_type> &values) {
    if (values.empty()) {
        return;
    }
    std::string header = std::string("{'descr': '") + type_of(value_type{}) +
                         "', 'fortran_order': False, 'shape': (" + std::to_string(size.height) +
                         ", " + std::to_string(size.width) + "), }";
    constexpr std::size_t begin = 10, whole = 128;
    header.resize(whole - begin - 1, ' ');
    std::ofstream file(path, std::ios::binary);
    file << std::string("\x93NUMPY\x01\x00", 8) << static_cast<char>(whole - begin) << '\0'
         << header << '\n';
    file.write(reinterpret_cast<const char *>(values.data()),
               static_cast<std::streamsize>(values.size() * sizeof values[0]));
    if (!file.flush()) {
        throw std::runtime_error(path.string() + ": cannot be written");
    }
}

std::vector<std::uint8_t> grey_of(const cv::Mat &image) {
    return {image.begin<std::uint8_t>(), image.end<std::uint8_t>()};
}

}  // namespace

void bench_write_maps(const std::string &folder, const bench_pair &pair,
                      const std::vector<bench_outcome> &outcomes) {
    const fs::path out = fs::path(folder) / pair.name;
    std::error_code error;
    fs::create_directories(out, error);
    if (error) {
        throw std::runtime_error(out.string() + ": cannot be made: " + error.message());
    }
    const cv::Size size = pair.left.size();
    write(out / "left.npy", size, grey_of(pair.left));
    write(out / "right.npy", size, grey_of(pair.right));
    write(out / "truth.npy", size, pair.truth_px);
    write(out / "mask.npy", size, pair.mask);
    write(out / "region.npy", size, pair.region);
    for (const bench_outcome &one : outcomes) {
        std::string name = one.method;
        std::replace(name.begin(), name.end(), ' ', '_');
        write(out / (name + ".npy"), size, one.disparity_px);
        write(out / (name + ".guess.npy"), size, one.planes.guess_px);
        write(out / (name + ".reason.npy"), size, one.planes.reason);
        write(out / (name + ".confidence.npy"), size, one.planes.confidence);
        write(out / (name + ".sigma.npy"), size, one.planes.sigma_px);
    }
}
