// SPDX-License-Identifier: Apache-2.0
// YAML, XML and JSON: the first byte of the text selects the format.
#include <cstdint>

#include "import_property.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    const import_file file{"file", std::string(reinterpret_cast<const char *>(data), size)};
    check_import([&] { return import_opencv({file}, fuzz_import_options()); });
    return 0;
}
