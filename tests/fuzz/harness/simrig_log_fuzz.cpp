// SPDX-License-Identifier: Apache-2.0
// The simulated rig's log is refused in one line, or holds entries that are all in the file.
#include <cstdint>
#include <stdexcept>
#include <string>

#include "fuzz_check.hpp"
#include "tools/simrig/wire/log.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    using namespace simrig;
    try {
        const Log log = parse_log("x.log", Body(data, data + size));
        std::size_t bytes = 37 + log.head.rig.size() + log.head.scene.size();
        FUZZ_CHECK(log.head.begin_s <= kLatestBeginS);
        for (const LogEntry &entry : log.entries) {
            FUZZ_CHECK(entry.happened >= Happened::kAnswered &&
                       entry.happened <= Happened::kReleased);
            FUZZ_CHECK(entry.role <= SIMRIG_ROLE_CONTROL);
            bytes += 16 + entry.body.size();
        }
        FUZZ_CHECK(bytes == size);
    } catch (const std::runtime_error &error) {
        const std::string line = error.what();
        FUZZ_CHECK(line.rfind("x.log ", 0) == 0 && line.find('\n') == std::string::npos);
    }
    return 0;
}
