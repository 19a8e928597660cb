// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <map>

#include "tools/simrig/scene/scene.hpp"
#include "tools/simrig/world/document.hpp"

namespace world {
namespace {

// Truth numbers objects in a byte, in which 0 means none.
constexpr std::size_t kMaxObjects = 255;
constexpr std::size_t kLongestName = 64;

Colour colour_of(const Entry &entry, double low, double high) {
    const Vec3 v = entry.vector();
    for (const double c : {v.x, v.y, v.z}) {
        if (c < low || c > high) {
            entry.fail("a colour's channels must lie between " + std::to_string(low) + " and " +
                       std::to_string(high));
        }
    }
    return {{v.x, v.y, v.z}};
}

Mat3 turn_of(const Vec3 &degrees) {
    return rotation_about({0, 0, 1}, radians(degrees.z)) *
           rotation_about({0, 1, 0}, radians(degrees.y)) *
           rotation_about({1, 0, 0}, radians(degrees.x));
}

const std::map<std::string, MaterialKind> kKinds = {
    {"plaster", MaterialKind::kPlaster}, {"wood", MaterialKind::kWood},
    {"painted", MaterialKind::kPainted}, {"clay", MaterialKind::kClay},
    {"plastic", MaterialKind::kPlastic}, {"board", MaterialKind::kBoard},
    {"paper", MaterialKind::kPaper}};

Board read_board(const Entry &entry) {
    entry.allow({"columns", "rows", "square_mm", "marker_mm"});
    Board board;
    board.columns = entry.at("columns").whole(2, 200);
    board.rows = entry.at("rows").whole(2, 200);
    board.square_mm = entry.number("square_mm", 0.1, 10000);
    board.marker_mm = entry.number("marker_mm", 0, board.square_mm, 0);
    if (board.marker_mm > 0 && board.columns * board.rows / 2 > 50) {
        entry.fail("too many markers (at most 50, one per white square)");
    }
    return board;
}

void read_image(const Entry &entry, Material &material) {
    material.image = entry.at("image").text();
    if (material.image.empty() || material.image.find('/') != std::string::npos) {
        entry.at("image").fail("not the name of a file beside the scene");
    }
    material.image_size_mm = entry.at("image_size_mm").pair();
    for (const double side : {material.image_size_mm.x, material.image_size_mm.y}) {
        if (side < 20 || side > 2000) {
            entry.at("image_size_mm").fail("an image must be 20 to 2000 mm wide and high");
        }
    }
}

Material read_material(const Entry &entry) {
    entry.allow({"kind", "colours", "contrast", "gloss", "gloss_blur_deg", "board", "image",
                 "image_size_mm", "plank_mm", "brightness"});
    const std::string kind = entry.at("kind").text();
    if (kKinds.count(kind) == 0) {
        entry.at("kind").fail("unknown material '" + kind + "'");
    }
    Material material;
    material.kind = kKinds.at(kind);
    for (const Entry &colour : entry.at("colours").items()) {
        material.tones.push_back(colour_of(colour, 0, 1));
    }
    const bool is_board = material.kind == MaterialKind::kBoard;
    if (material.tones.size() < (is_board ? 2U : 1U)) {
        entry.at("colours").fail(is_board ? "a board must have two colours, paper and ink"
                                          : "a material must have a colour");
    }
    material.contrast = entry.number("contrast", 0, 5, 1);
    material.gloss = entry.number("gloss", 0, 1, 0);
    material.gloss_blur_rad = radians(entry.number("gloss_blur_deg", 0.05, 60, 6));
    material.plank_mm = entry.number("plank_mm", 5, 10000, 120);
    if (entry.has("brightness")) {
        if (material.kind != MaterialKind::kPaper) {
            entry.at("brightness").fail("only paper can shine");
        }
        const double times = entry.number("brightness", 0, 1e5);
        for (Colour &tone : material.tones) {
            for (double &channel : tone.channel) {
                channel *= times;
            }
        }
    }
    if (is_board) {
        material.board = read_board(entry.at("board"));
    }
    if (material.kind == MaterialKind::kPainted) {
        read_image(entry, material);
    }
    return material;
}

Part read_can(const Entry &e) {
    Part part;
    e.allow({"centre_mm", "radius_mm", "height_mm", "axis", "rounding_mm", "tone"});
    part.kind = PartKind::kCan;
    part.a = e.at("centre_mm").vector();
    part.r = e.number("radius_mm", 0.1, 1000);
    part.s = 0.5 * e.number("height_mm", 0.1, 2000);
    const std::string axis = e.has("axis") ? e.at("axis").text() : "y";
    if (axis != "x" && axis != "y" && axis != "z") {
        e.at("axis").fail("an axis must be x, y or z");
    }
    part.axis = axis[0] - 'x';
    part.rounding = e.number("rounding_mm", 0, std::min(part.r, part.s), 0);
    return part;
}

Part read_shell(const Entry &e) {
    Part part;
    e.allow({"radius_mm", "height_mm", "wall_mm", "floor_mm", "rounding_mm", "tone"});
    part.kind = PartKind::kShell;
    part.r = e.number("radius_mm", 1, 1000);
    part.s = e.number("height_mm", 1, 2000);
    part.wall = e.number("wall_mm", 0.5, part.r);
    part.floor = e.number("floor_mm", 0.5, part.s);
    part.rounding = e.number("rounding_mm", 0, 0.5 * std::min(part.wall, part.floor), 0);
    return part;
}

Part read_arc(const Entry &e) {
    Part part;
    e.allow({"centre_mm", "radius_mm", "half_angle_deg", "half_section_mm", "rounding_mm", "tone"});
    part.kind = PartKind::kArc;
    part.a = e.at("centre_mm").vector();
    part.r = e.number("radius_mm", 1, 1000);
    part.s = radians(e.number("half_angle_deg", 1, 180));
    const Vec2 half = e.at("half_section_mm").pair();
    part.b = {half.x, half.y, 0};
    part.rounding = e.number("rounding_mm", 0, std::min(half.x, half.y), 0);
    return part;
}

Part read_part(const Entry &entry) {
    const std::string kind = entry.only_key();
    const Entry e = entry.at(kind);
    Part part;
    if (kind == "ball") {
        e.allow({"centre_mm", "radius_mm", "tone"});
        part.a = e.at("centre_mm").vector();
        part.r = e.number("radius_mm", 0.1, 1000);
    } else if (kind == "limb") {
        e.allow({"from_mm", "to_mm", "radius_from_mm", "radius_to_mm", "tone"});
        part.kind = PartKind::kLimb;
        part.a = e.at("from_mm").vector();
        part.b = e.at("to_mm").vector();
        part.r = e.number("radius_from_mm", 0.1, 1000);
        part.s = e.number("radius_to_mm", 0.1, 1000);
        if (length(part.b - part.a) <= std::fabs(part.r - part.s)) {
            e.fail("one end of the limb lies inside the other");
        }
    } else if (kind == "box") {
        e.allow({"centre_mm", "size_mm", "rounding_mm", "tone"});
        part.kind = PartKind::kBox;
        part.a = e.at("centre_mm").vector();
        part.b = 0.5 * e.at("size_mm").vector();
        part.rounding = e.number("rounding_mm", 0, std::min({part.b.x, part.b.y, part.b.z}), 0);
    } else if (kind == "can") {
        part = read_can(e);
    } else if (kind == "shell") {
        part = read_shell(e);
    } else if (kind == "arc") {
        part = read_arc(e);
    } else {
        entry.fail("unknown part '" + kind + "'");
    }
    part.tone = e.has("tone") ? e.at("tone").whole(0, 31) : 0;
    return part;
}

void read_solid(const Entry &entry, Object &object) {
    entry.allow({"name", "material", "position_mm", "turn_deg", "blend_mm", "parts"});
    std::vector<Part> parts;
    for (const Entry &part : entry.at("parts").items()) {
        parts.push_back(read_part(part));
        if (static_cast<std::size_t>(parts.back().tone) >= object.material.tones.size()) {
            part.fail("the material has too few colours for this tone");
        }
    }
    if (parts.empty() || parts.size() > kMaxParts) {
        entry.at("parts").fail("a solid must have 1 to 32 parts");
    }
    object.solid = std::make_unique<Solid>(parts, entry.number("blend_mm", 0, 100, 0));
    object.middle_mm = object.world_object * (0.5 * (object.solid->low() + object.solid->high()));
    object.reach_mm = 0.5 * length(object.solid->high() - object.solid->low());
}

void read_sheet(const Entry &entry, Object &object) {
    entry.allow({"name", "material", "position_mm", "turn_deg", "size_mm", "bend_radius_mm"});
    object.sheet.half_mm = 0.5 * entry.at("size_mm").pair();
    if (!(object.sheet.half_mm.x > 0 && object.sheet.half_mm.y > 0)) {
        entry.at("size_mm").fail("sizes must be positive");
    }
    if (entry.has("bend_radius_mm")) {
        const double radius = entry.at("bend_radius_mm").number();
        if (std::fabs(radius) < 2 * object.sheet.half_mm.x) {
            entry.at("bend_radius_mm").fail("bend radius too small for the sheet's width");
        }
        object.sheet.bend_per_mm = 1 / radius;
    }
    object.sheet.prepare();
    object.middle_mm = object.world_object.translation_mm;
    object.reach_mm = 1.1 * length(object.sheet.half_mm);
}

AreaLight read_light(const Entry &entry, const Pose &room) {
    entry.allow({"centre_mm", "half_u_mm", "half_v_mm", "luminance", "panes"});
    AreaLight light;
    light.centre_mm = room * entry.at("centre_mm").vector();
    light.half_u_mm = room.rotation * entry.at("half_u_mm").vector();
    light.half_v_mm = room.rotation * entry.at("half_v_mm").vector();
    if (length(cross(light.half_u_mm, light.half_v_mm)) < 1) {
        entry.fail("a light must have an area");
    }
    light.luminance = colour_of(entry.at("luminance"), 0.001, 1e6);
    light.panes = entry.has("panes") ? entry.at("panes").pair() : Vec2{1, 1};
    return light;
}

// Names are words of one-line commands and quoted in YAML.
std::string read_name(const Entry &entry) {
    const std::string name = entry.text();
    const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
        return c > 0x20 && c != 0x7F && c != '"' && c != '\\';
    });
    if (!plain || name.empty() || name.size() > kLongestName) {
        entry.fail("a name must have 1 to 64 characters, without spaces, quotes and backslashes");
    }
    return name;
}

void name_once(const Entry &entry, const Scene &scene, const std::string &name) {
    for (const auto &object : scene.objects) {
        if (object->name == name) {
            entry.fail("duplicate object '" + name + "'");
        }
    }
}

std::unique_ptr<Object> read_object(const Entry &entry, const Pose &room,
                                    const std::map<std::string, Entry> &materials, int id) {
    const std::string kind = entry.only_key();
    if (kind != "sheet" && kind != "solid") {
        entry.fail("unknown object '" + kind + "'");
    }
    const Entry e = entry.at(kind);
    auto object = std::make_unique<Object>();
    object->id = id;
    object->name = read_name(e.at("name"));
    const std::string material = e.at("material").text();
    const auto found = materials.find(material);
    if (found == materials.end()) {
        e.at("material").fail("unknown material '" + material + "'");
    }
    object->material = read_material(found->second);
    object->world_object =
        room * Pose{turn_of(e.vector("turn_deg", {})), e.at("position_mm").vector()};
    object->object_world = inverse(object->world_object);
    const bool flat_only = object->material.kind == MaterialKind::kPlaster ||
                           object->material.kind == MaterialKind::kWood ||
                           object->material.kind == MaterialKind::kBoard ||
                           object->material.kind == MaterialKind::kPaper;
    if (flat_only != (kind == "sheet") && object->material.kind != MaterialKind::kPainted) {
        e.at("material").fail("this material cannot be used for a " + kind);
    }
    kind == "sheet" ? read_sheet(e, *object) : read_solid(e, *object);
    return object;
}

Scene read_scene(const Entry &file) {
    file.allow(
        {"room", "lights", "ambient", "floor_ambient", "bounce_lux", "materials", "objects"});
    const Entry frame = file.at("room");
    frame.allow({"origin_mm", "tilt_deg"});
    const Pose room = {rotation_about({1, 0, 0}, radians(frame.number("tilt_deg", -90, 90))),
                       frame.at("origin_mm").vector()};
    Scene scene;
    scene.up = room.rotation * Vec3{0, -1, 0};
    scene.ambient = colour_of(file.at("ambient"), 0, 1e6);
    scene.floor_ambient = colour_of(file.at("floor_ambient"), 0, 1e6);
    scene.bounce_lux = file.number("bounce_lux", 0, 1e6);
    for (const Entry &light : file.at("lights").items()) {
        scene.lights.push_back(read_light(light, room));
    }
    if (scene.lights.size() > 2) {
        file.at("lights").fail("too many lights (at most 2)");
    }
    std::map<std::string, Entry> materials;
    for (const Entry &material : file.at("materials").items()) {
        const std::string name = material.only_key();
        materials.emplace(name, material.at(name));
    }
    const std::vector<Entry> objects = file.at("objects").items();
    if (objects.size() > kMaxObjects) {
        file.at("objects").fail("too many objects (at most 255)");
    }
    for (const Entry &object : objects) {
        auto read =
            read_object(object, room, materials, static_cast<int>(scene.objects.size()) + 1);
        name_once(object, scene, read->name);
        scene.objects.push_back(std::move(read));
    }
    return scene;
}

}  // namespace

Scene parse_scene(const std::string &name, const std::string &text) {
    return read_scene(Entry::of_text(name, text));
}

Scene load_scene(const std::string &path) {
    return load_scene(path, Entry::contents(path));
}

Scene load_scene(const std::string &path, const std::string &text) {
    Scene scene = parse_scene(path, text);
    for (const auto &object : scene.objects) {
        Material &material = object->material;
        if (!material.image.empty()) {
            const auto image = std::filesystem::path(path).replace_filename(material.image);
            material.raster = Raster(image.string(), material.image_size_mm);
        }
        prepare(material, object->id);
    }
    light_scene(scene);
    return scene;
}

}  // namespace world
