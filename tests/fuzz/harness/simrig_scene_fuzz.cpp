// SPDX-License-Identifier: Apache-2.0
// The text of a scene file is accepted or refused in one line that begins with file and line; all
// accepted values are within the limits that the renderer relies on. Images, noise and light are
// not loaded: they are slow and not part of reading.
#include <cmath>
#include <cstdint>
#include <cstring>
#include <set>
#include <string>

#include "fuzz_check.hpp"
#include "tools/simrig/scene/scene.hpp"
#include "tools/simrig/world/document.hpp"

namespace {

using namespace world;

bool finite(const Vec3 &v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

bool finite(const Pose &pose) {
    return finite(pose.translation_mm) && finite(pose.rotation * Vec3{1, 1, 1});
}

void check(const Object &object, int id) {
    FUZZ_CHECK(object.id == id && !object.name.empty() && object.name.size() <= 64);
    FUZZ_CHECK(object.name.find_first_of("\" \\\n") == std::string::npos);
    FUZZ_CHECK(finite(object.world_object) && finite(object.object_world));
    FUZZ_CHECK(finite(object.middle_mm));
    FUZZ_CHECK(std::isfinite(object.reach_mm) && object.reach_mm > 0);
    FUZZ_CHECK(!object.material.tones.empty());
    for (const Colour &tone : object.material.tones) {
        for (const double channel : tone.channel) {
            FUZZ_CHECK(channel >= 0 && channel <= 1);
        }
    }
    const bool painted = object.material.kind == MaterialKind::kPainted;
    FUZZ_CHECK(painted == !object.material.image.empty());
    if (object.solid == nullptr) {
        FUZZ_CHECK(object.sheet.half_mm.x > 0 && object.sheet.half_mm.y > 0);
        FUZZ_CHECK(std::isfinite(object.sheet.bend_per_mm));
    } else {
        FUZZ_CHECK(finite(object.solid->low()) && finite(object.solid->high()));
        FUZZ_CHECK(!std::isnan(object.solid->distance({0, 0, 0}, object.solid->every_part())));
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    try {
        const Scene scene =
            parse_scene("f", std::string(reinterpret_cast<const char *>(data), size));
        std::set<std::string> names;
        FUZZ_CHECK(scene.objects.size() <= 255 && scene.lights.size() <= 2);
        for (const auto &object : scene.objects) {
            check(*object, static_cast<int>(names.size()) + 1);
            FUZZ_CHECK(names.insert(object->name).second);
        }
        for (const AreaLight &light : scene.lights) {
            FUZZ_CHECK(finite(light.centre_mm) && finite(light.half_u_mm) &&
                       finite(light.half_v_mm));
            FUZZ_CHECK(light.luminance.channel[0] > 0);
        }
        FUZZ_CHECK(finite(scene.up) && scene.bounce_lux >= 0);
    } catch (const BadFile &why) {
        const char *what = why.what();
        FUZZ_CHECK(std::strncmp(what, "f:", 2) == 0 && std::strchr(what, '\n') == nullptr);
        FUZZ_CHECK(what[2] >= '1' && what[2] <= '9');
    }
    return 0;
}
