// SPDX-License-Identifier: Apache-2.0
// The left camera is the input, the right one a good file.
#include <cstdint>

#include "import_property.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    static const import_file right{
        "right",
        "width: 640\nheight: 480\ndistortion_model: plumb_bob\nD: [0, 0, 0, 0, 0]\n"
        "K: [500, 0, 320, 0, 500, 240, 0, 0, 1]\nR: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
        "P: [500, 0, 320, -60, 0, 500, 240, 0, 0, 0, 1, 0]\n"};
    const import_file left{"left", std::string(reinterpret_cast<const char *>(data), size)};
    check_import([&] { return import_ros({left, right}, fuzz_import_options()); });
    return 0;
}
