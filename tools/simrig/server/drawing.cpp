// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "tools/simrig/server/view.hpp"

namespace simrig {

namespace {

using world::Camera;
using world::Vec2;
using world::Vec3;

constexpr double kPanelPx = 1240, kEdgePx = 60, kTitlePx = 46, kLinePx = 20;
constexpr double kBehindMm = 220, kBeyondMm = 120, kBesideMm = 60;
constexpr double kLargeMm = 900;  // larger objects are clipped at the panel's edge
constexpr double kFarthestMm = 20000;
const char *const kColours[] = {"#1f6fb2", "#c2571a"};
const char *const kNames[] = {"left", "right"};

std::string print(const char *format, ...) __attribute__((format(printf, 1, 2)));
std::string print(const char *format, ...) {
    char text[600];
    va_list values;
    va_start(values, format);
    std::vsnprintf(text, sizeof text, format, values);
    va_end(values);
    return text;
}

std::string escaped(const std::string &text) {
    std::string safe;
    for (const char c : text) {
        switch (c) {
            case '<':
                safe += "&lt;";
                break;
            case '>':
                safe += "&gt;";
                break;
            case '&':
                safe += "&amp;";
                break;
            default:
                safe += c;
        }
    }
    return safe;
}

Vec3 ray_of(const Camera &camera, Vec2 pixel) {
    const Vec2 slopes = camera.slopes_of(pixel);
    return camera.world_camera.rotation * Vec3{slopes.x, slopes.y, 1};
}

/// Pixels at the two edges of what a drawing shows.
std::array<Vec2, 2> edge_pixels(Plane plane) {
    const Vec2 last = {world::kArrayColumns - 0.5, world::kArrayRows - 0.5};
    const Vec2 middle = 0.5 * (last - Vec2{0.5, 0.5});
    return plane == Plane::kTop ? std::array<Vec2, 2>{Vec2{-0.5, middle.y}, Vec2{last.x, middle.y}}
                                : std::array<Vec2, 2>{Vec2{middle.x, -0.5}, Vec2{middle.x, last.y}};
}

Vec3 at_depth(const Vec3 &origin, const Vec3 &direction, double z_mm) {
    return origin + (z_mm - origin.z) / direction.z * direction;
}

/// Where the optical axes come closest to each other; false when they are parallel.
bool crossing(const std::array<Camera, 2> &cameras, Vec3 &place) {
    const Vec3 p = cameras[0].world_camera.translation_mm;
    const Vec3 q = cameras[1].world_camera.translation_mm;
    const Vec3 u = ray_of(cameras[0], cameras[0].optics.centre_px);
    const Vec3 v = ray_of(cameras[1], cameras[1].optics.centre_px);
    const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v);
    const double wu = dot(p - q, u), wv = dot(p - q, v), bottom = uu * vv - uv * uv;
    if (bottom < 1e-9 * uu * vv) {
        return false;
    }
    const Vec3 a = p + (uv * wv - vv * wu) / bottom * u, b = q + (uu * wv - uv * wu) / bottom * v;
    place = 0.5 * (a + b);
    return place.z > 0 && place.z < kFarthestMm;
}

struct Range {
    double low = 1e30, high = -1e30;
    void include(double value) {
        low = std::min(low, value);
        high = std::max(high, value);
    }
    double size() const { return high - low; }
};

class Drawing {
  public:
    Drawing(const world::Scene &scene, const world::Rig &rig, const View &view) : scene_(scene) {
        for (size_t side = 0; side < 2; side++) {
            cameras_[side] = world::camera_at(rig.of(world::Side(side)), view.mechanics[side]);
            depth_.include(cameras_[side].world_camera.translation_mm.z - kBehindMm);
        }
        for (const auto &object : scene.objects) {
            depth_.include(object->middle_mm.z + kBeyondMm);
            if (object->reach_mm < kLargeMm) {
                depth_.include(object->middle_mm.z + object->reach_mm + kBeyondMm);
            }
        }
        depth_.high = std::clamp(depth_.high, depth_.low + 500, kFarthestMm);
        scale_ = kPanelPx / depth_.size();
        crosses_ = crossing(cameras_, crossing_mm_);
    }

    std::string whole() {
        panel(Plane::kTop, "From above: x (down) against z (to the right), mm");
        panel(Plane::kSide, "From the side: y (down) against z (to the right), mm");
        legend();
        const double width = kPanelPx + 2 * kEdgePx;
        return print(
                   "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" "
                   "viewBox=\"0 0 %.0f %.0f\" font-family=\"sans-serif\" font-size=\"14\">\n"
                   "<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
                   width, y_ + kEdgePx / 2, width, y_ + kEdgePx / 2) +
               body_ + "</svg>\n";
    }

  private:
    Range across(Plane plane) const {
        Range range;
        for (const Camera &camera : cameras_) {
            const Vec3 pupil = camera.world_camera.translation_mm;
            range.include(flattened(plane, pupil).y - 80);
            range.include(flattened(plane, pupil).y + 80);
            for (const Vec2 pixel : edge_pixels(plane)) {
                range.include(
                    flattened(plane, at_depth(pupil, ray_of(camera, pixel), depth_.high)).y);
            }
        }
        for (const auto &object : scene_.objects) {
            if (object->reach_mm < kLargeMm) {
                for (const Outline &outline : outlines_of(*object, plane)) {
                    for (const Vec2 point : outline) {
                        range.include(point.y);
                    }
                }
            }
        }
        return {range.low - kBesideMm, range.high + kBesideMm};
    }

    Vec2 px(Vec2 place_mm) const {
        return {kEdgePx + scale_ * (place_mm.x - depth_.low),
                top_ + scale_ * (place_mm.y - across_.low)};
    }
    Vec2 px(const Vec3 &place_mm) const { return px(flattened(plane_, place_mm)); }

    void line(Vec2 from, Vec2 to, const char *style) {
        body_ += print("<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" %s/>\n", from.x,
                       from.y, to.x, to.y, style);
    }
    void text(Vec2 at, const char *style, const std::string &what) {
        body_ += print("<text x=\"%.1f\" y=\"%.1f\" %s>", at.x, at.y, style) + escaped(what) +
                 "</text>\n";
    }
    void polygon(const Outline &points_px, const std::string &style) {
        body_ += "<polygon points=\"";
        for (const Vec2 point : points_px) {
            body_ += print("%.1f,%.1f ", point.x, point.y);
        }
        body_ += "\" " + style + "/>\n";
    }

    void panel(Plane plane, const char *title) {
        plane_ = plane;
        across_ = across(plane);
        top_ = y_ + kTitlePx;
        const double height = scale_ * across_.size();
        const char *const clip = plane == Plane::kTop ? "top" : "side";
        text({kEdgePx, top_ - 14}, "font-size=\"18\" font-weight=\"bold\"", title);
        const std::string frame =
            print("<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"", kEdgePx, top_,
                  kPanelPx, height);
        body_ += print("<clipPath id=\"%s\">", clip) + frame + "/></clipPath>\n" +
                 print("<g clip-path=\"url(#%s)\">\n", clip);
        objects(true);
        fields();
        objects(false);
        for (size_t side = 0; side < 2; side++) {
            camera(side);
        }
        if (plane == Plane::kTop) {
            baseline();
        }
        marks();
        body_ += "</g>\n" + frame + " fill=\"none\" stroke=\"#888\"/>\n";
        ticks(height);
        y_ = top_ + height + 2 * kLinePx;
    }

    void fields() {
        for (size_t side = 0; side < 2; side++) {
            const Vec3 pupil = cameras_[side].world_camera.translation_mm;
            Outline field = {px(pupil)};
            for (const Vec2 pixel : edge_pixels(plane_)) {
                field.push_back(px(at_depth(pupil, ray_of(cameras_[side], pixel), depth_.high)));
            }
            polygon(field, print("fill=\"%s\" fill-opacity=\"0.10\" stroke=\"%s\" "
                                 "stroke-opacity=\"0.6\"",
                                 kColours[side], kColours[side]));
        }
    }

    void objects(bool large) {
        std::vector<const world::Object *> order;
        for (const auto &object : scene_.objects) {
            if ((object->reach_mm >= kLargeMm) == large) {
                order.push_back(object.get());
            }
        }
        std::stable_sort(order.begin(), order.end(),
                         [](const auto *a, const auto *b) { return a->reach_mm > b->reach_mm; });
        for (const world::Object *object : order) {
            const char *const style =
                object->solid ? "fill=\"#b9c4b0\" stroke=\"#55624a\" stroke-width=\"0.7\""
                              : "fill=\"#d8d2c6\" fill-opacity=\"0.6\" stroke=\"#6b6455\" "
                                "stroke-width=\"2\"";
            for (const Outline &outline : outlines_of(*object, plane_)) {
                Outline points;
                for (const Vec2 point : outline) {
                    points.push_back(px(point));
                }
                polygon(points, style);
            }
        }
    }

    void camera(size_t side) {
        const Camera &camera = cameras_[side];
        const Vec3 pupil = camera.world_camera.translation_mm;
        const Vec3 axis = ray_of(camera, camera.optics.centre_px);
        line(px(pupil), px(at_depth(pupil, axis, depth_.high)),
             print("stroke=\"%s\" stroke-dasharray=\"9 4 2 4\"", kColours[side]).c_str());
        // Lens and body behind the pupil.
        const world::Mat3 &turn = camera.world_camera.rotation;
        for (const double part : {0.0, 1.0}) {
            const double half_mm = part == 0 ? 24 : 34, near_mm = -70 * part;
            Outline box;
            for (const Vec2 corner : {Vec2{near_mm, -1}, Vec2{near_mm, 1}, Vec2{near_mm - 70, 1},
                                      Vec2{near_mm - 70, -1}}) {
                const double aside = half_mm * corner.y;
                const Vec3 local =
                    plane_ == Plane::kTop ? Vec3{aside, 0, corner.x} : Vec3{0, aside, corner.x};
                box.push_back(px(pupil + turn * local));
            }
            polygon(box, print("fill=\"#fff\" stroke=\"%s\" stroke-width=\"1.5\"", kColours[side]));
        }
    }

    void baseline() {
        const Vec3 a = cameras_[0].world_camera.translation_mm;
        const Vec3 b = cameras_[1].world_camera.translation_mm;
        line(px(a), px(b), "stroke=\"#333\" stroke-width=\"1\"");
        text(px(0.5 * (a + b)) + Vec2{6, 5}, "", print("pupils %.1f mm apart", length(b - a)));
    }

    void marks() {
        if (crosses_) {
            const Vec2 at = px(crossing_mm_);
            body_ += print("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"4\" fill=\"#c00\"/>\n", at.x, at.y);
            text(at + Vec2{-8, -10}, "text-anchor=\"end\" fill=\"#c00\"",
                 print("%.0f mm", crossing_distance_mm()));
        }
        for (const auto &object : scene_.objects) {
            Vec2 at = px(object->middle_mm);
            at.y = std::clamp(at.y, top_ + 12, top_ + scale_ * across_.size() - 12);
            body_ += print(
                "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"9\" fill=\"#fff\" "
                "stroke=\"#333\"/>\n",
                at.x, at.y);
            text(at + Vec2{0, 4.5}, "text-anchor=\"middle\" font-size=\"12\"",
                 std::to_string(object->id));
        }
    }

    void ticks(double height) {
        const int step = depth_.size() > 6000 ? 1000 : 200;
        for (int z = step * int(std::ceil(depth_.low / step)); z <= depth_.high; z += step) {
            const Vec2 at = {px(Vec2{double(z), 0}).x, top_ + height};
            line(at, at + Vec2{0, 6}, "stroke=\"#888\"");
            text(at + Vec2{0, 20}, "text-anchor=\"middle\" font-size=\"12\"", std::to_string(z));
        }
        for (int y = step * int(std::ceil(across_.low / step)); y <= across_.high; y += step) {
            const Vec2 at = {kEdgePx, px(Vec2{0, double(y)}).y};
            line(at, at - Vec2{6, 0}, "stroke=\"#888\"");
            text(at + Vec2{-9, 4}, "text-anchor=\"end\" font-size=\"12\"", std::to_string(y));
        }
    }

    void legend_line(const std::string &what, const char *style = "") {
        y_ += kLinePx;
        text({kEdgePx, y_}, style, what);
    }

    void legend() {
        const Vec3 pupils[] = {cameras_[0].world_camera.translation_mm,
                               cameras_[1].world_camera.translation_mm};
        for (size_t side = 0; side < 2; side++) {
            const world::Optics &lens = cameras_[side].optics;
            const double distance_mm = lens.focus_distance_mm;
            legend_line(
                print("%s camera: focal length %.2f mm (%.0f px), f/%.1f, field %.1f x "
                      "%.1f degrees, sharp at %s",
                      kNames[side], lens.focal_length_mm, lens.focal_px, lens.f_number,
                      field_deg(side, Plane::kTop), field_deg(side, Plane::kSide),
                      distance_mm < world::kInfinityMm ? print("%.0f mm", distance_mm).c_str()
                                                       : "infinity"),
                print("fill=\"%s\"", kColours[side]).c_str());
        }
        legend_line(crosses_ ? print("The optical axes cross %.0f mm from the left camera (red).",
                                     crossing_distance_mm())
                             : "The optical axes do not cross.");
        for (const auto &object : scene_.objects) {
            legend_line(std::to_string(object->id) + "  " + object->name +
                        print(": middle %.0f mm from the left camera, %.0f mm from the right one",
                              length(object->middle_mm - pupils[0]),
                              length(object->middle_mm - pupils[1])));
        }
    }

    double crossing_distance_mm() const {
        return length(crossing_mm_ - cameras_[0].world_camera.translation_mm);
    }

    double field_deg(size_t side, Plane plane) const {
        const auto pixels = edge_pixels(plane);
        const Vec3 a = ray_of(cameras_[side], pixels[0]), b = ray_of(cameras_[side], pixels[1]);
        return std::acos(dot(a, b) / (length(a) * length(b))) / world::radians(1);
    }

    const world::Scene &scene_;
    std::array<Camera, 2> cameras_;
    Vec3 crossing_mm_;
    bool crosses_ = false;
    Range depth_, across_;
    Plane plane_ = Plane::kTop;
    double scale_ = 1, top_ = 0, y_ = 0;
    std::string body_;
};

}  // namespace

std::string rig_drawing(const world::Scene &scene, const world::Rig &rig, const View &view) {
    return Drawing(scene, rig, view).whole();
}

}  // namespace simrig
