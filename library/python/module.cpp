// SPDX-License-Identifier: Apache-2.0
/// vergence._vergence: libvergence for Python, without policy. Checks of arrays, names and
/// docstrings are in the package's Python files.
#include "library/python/binding.hpp"

namespace {

using namespace binding;

calibration load(const std::string &path, const words &options) {
    vergence_calibration *made = nullptr;
    vergence_error error;
    int code;
    {
        nb::gil_scoped_release release;
        code = vergence_calibration_load(path.c_str(), pointers_of(options).data(), &made, &error);
    }
    check(code, error);
    return {std::unique_ptr<vergence_calibration, calibration_deleter>(made)};
}

calibration parse(const std::string &text) {
    vergence_calibration *made = nullptr;
    vergence_error error;
    check(vergence_calibration_parse(text.data(), text.size(), &made, &error), error);
    return {std::unique_ptr<vergence_calibration, calibration_deleter>(made)};
}

calibration calibrate(const words &line, const nb::object &progress) {
    vergence_calibration *made = nullptr;
    vergence_error error;
    const std::vector<const char *> all = pointers_of(line);
    const int code = watcher(progress).run([&](const vergence_observer *observer) {
        return vergence_calibrate(all.data(), observer, &made, &error);
    });
    check(code, error);
    return {std::unique_ptr<vergence_calibration, calibration_deleter>(made)};
}

size_t count_coefficients(vergence_lens lens) {
    switch (lens) {
        case VERGENCE_EQUIDISTANT:
            return 4;
        case VERGENCE_RATIONAL:
            return 8;
        default:
            return 5;
    }
}

nb::dict camera_of(const calibration &one, int side) {
    vergence_camera camera;
    vergence_calibration_camera(one.owner.get(), side, &camera);
    const double M[] = {camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1};
    nb::dict values;
    values["size"] = nb::make_tuple(camera.width_px, camera.height_px);
    values["M"] = copied(M, 3, 3);
    values["D"] = copied(camera.coefficients, count_coefficients(camera.lens), 1);
    values["fisheye"] = camera.lens == VERGENCE_EQUIDISTANT;
    return values;
}

nb::tuple pose_of(const calibration &one) {
    double R[9], t_mm[3];
    vergence_calibration_pose(one.owner.get(), R, t_mm);
    return nb::make_tuple(copied(R, 3, 3), copied(t_mm, 3, 1));
}

nb::tuple rectified_of(const calibration &one) {
    vergence_rectified values;
    vergence_error error;
    check(vergence_calibration_rectify(one.owner.get(), &values, &error), error);
    return nb::make_tuple(copied(values.R1, 3, 3), copied(values.R2, 3, 3), copied(values.P1, 3, 4),
                          copied(values.P2, 3, 4));
}

void save_calibration(const calibration &one, const std::string &path) {
    vergence_error error;
    check(vergence_calibration_save(one.owner.get(), path.c_str(), &error), error);
}

void export_calibration(const calibration &one, const std::string &format,
                        const std::string &directory) {
    vergence_error error;
    check(vergence_calibration_export(one.owner.get(), format.c_str(), directory.c_str(), &error),
          error);
}

/// A contiguous image of height x width or height x width x 3.
template <class Array>
vergence_image image_of(const Array &array, int layout, int bits, const std::string &name) {
    const auto height = static_cast<int>(array.shape(0)), width = static_cast<int>(array.shape(1));
    const auto bytes = static_cast<ptrdiff_t>(array.itemsize());
    return {array.data(),
            static_cast<ptrdiff_t>(array.size()) / height * bytes,
            width,
            height,
            static_cast<int>(bytes),
            bits,
            static_cast<vergence_layout>(layout),
            name.c_str()};
}

template <class Array>
result reconstruct(const Array &left, const Array &right, const words &names, int layout, int bits,
                   const calibration *rig, const words &options, const nb::object &progress) {
    const vergence_image images[] = {image_of(left, layout, bits, names.at(0)),
                                     image_of(right, layout, bits, names.at(1))};
    vergence_result *made = nullptr;
    vergence_error error;
    const std::vector<const char *> all = pointers_of(options);
    const int code = watcher(progress).run([&](const vergence_observer *observer) {
        return vergence_reconstruct(&images[0], &images[1],
                                    rig != nullptr ? rig->owner.get() : nullptr, all.data(),
                                    observer, &made, &error);
    });
    check(code, error);
    return {std::unique_ptr<vergence_result, result_deleter>(made)};
}

result reconstruct_files(const std::string &left, const std::optional<std::string> &right,
                         const calibration *rig, const words &options, const nb::object &progress) {
    vergence_result *made = nullptr;
    vergence_error error;
    const std::vector<const char *> all = pointers_of(options);
    const int code = watcher(progress).run([&](const vergence_observer *observer) {
        return vergence_reconstruct_files(left.c_str(), right ? right->c_str() : nullptr,
                                          rig != nullptr ? rig->owner.get() : nullptr, all.data(),
                                          observer, &made, &error);
    });
    check(code, error);
    return {std::unique_ptr<vergence_result, result_deleter>(made)};
}

std::pair<int, int> size_of(const result &one) {
    int width_px, height_px;
    vergence_result_size(one.owner.get(), &width_px, &height_px);
    return {width_px, height_px};
}

nb::object map_of(nb::handle self, int map) {
    const auto &one = nb::cast<const result &>(self);
    const auto [width, height] = size_of(one);
    const auto w = static_cast<size_t>(width), h = static_cast<size_t>(height);
    const void *data = nullptr;
    vergence_error error;
    int code;
    {
        nb::gil_scoped_release release;
        code = vergence_result_map(one.owner.get(), static_cast<vergence_map>(map), &data, &error);
    }
    check(code, error);
    if (map <= VERGENCE_SIGMA_MM) {
        return array_of(static_cast<const float *>(data), {h, w}, self);
    }
    const auto *bytes = static_cast<const uint8_t *>(data);
    return map == VERGENCE_REASON ? array_of(bytes, {h, w}, self)
                                  : array_of(bytes, {h, w, 3}, self);
}

nb::dict surface_of(nb::handle self) {
    const auto &one = nb::cast<const result &>(self);
    vergence_surface surface;
    vergence_error error;
    int code;
    {
        nb::gil_scoped_release release;
        code = vergence_result_surface(one.owner.get(), &surface, &error);
    }
    check(code, error);
    nb::dict arrays;
    arrays["points_mm"] = array_of(surface.position_mm, {surface.points, 3}, self);
    arrays["normals"] = array_of(surface.normal, {surface.points, 3}, self);
    arrays["colours"] = array_of(surface.colour, {surface.points, 3}, self);
    arrays["sigma_mm"] = array_of(surface.sigma_mm, {surface.points}, self);
    arrays["pixels"] = array_of(surface.pixel, {surface.points}, self);
    arrays["triangles"] = array_of(&surface.triangle[0][0], {surface.triangles, 3}, self);
    return arrays;
}

void write_files(result *one, const std::string &directory, const words &options,
                 const nb::object &progress) {
    vergence_error error;
    const std::vector<const char *> all = pointers_of(options);
    const int code = watcher(progress).run([&](const vergence_observer *observer) {
        return vergence_result_write(one->owner.get(), directory.c_str(), all.data(), observer,
                                     &error);
    });
    check(code, error);
}

using value = std::tuple<double, double, double>;

value value_of(const vergence_value &from) {
    return {from.value, from.sigma, from.sigma_common};
}

value depth(const result &one, double x_px, double y_px) {
    vergence_value found;
    vergence_error error;
    check(vergence_result_depth(one.owner.get(), x_px, y_px, &found, &error), error);
    return value_of(found);
}

value distance(const result &one, const place &from, const place &to) {
    const double from_px[] = {from.first, from.second}, to_px[] = {to.first, to.second};
    vergence_value found;
    vergence_error error;
    check(vergence_result_distance(one.owner.get(), from_px, to_px, &found, &error), error);
    return value_of(found);
}

nb::tuple vector_of(const double v[3]) {
    return nb::make_tuple(v[0], v[1], v[2]);
}

/// Runs a fit without the GIL; `mask` has the size of the maps.
template <class Found>
Found fit_of(const result &one, const std::optional<mask_array> &mask,
             int (*fit)(const vergence_result *, const uint8_t *, Found *, vergence_error *)) {
    Found found;
    vergence_error error;
    int code;
    {
        nb::gil_scoped_release release;
        code = fit(one.owner.get(), mask ? mask->data() : nullptr, &found, &error);
    }
    check(code, error);
    return found;
}

nb::dict plane(const result &one, const std::optional<mask_array> &mask) {
    const auto found = fit_of<vergence_plane>(one, mask, vergence_result_plane);
    nb::dict values;
    values["normal"] = vector_of(found.normal);
    values["centre_mm"] = vector_of(found.centre_mm);
    values["distance_mm"] = value_of(found.distance_mm);
    values["tilt_deg"] = value_of(found.tilt_deg);
    values["normal_sigma_deg"] = found.normal_sigma_deg;
    values["rms_mm"] = found.rms_mm;
    values["points"] = found.points;
    values["used"] = found.used;
    return values;
}

nb::dict cylinder(const result &one, const std::optional<mask_array> &mask) {
    const auto found = fit_of<vergence_cylinder>(one, mask, vergence_result_cylinder);
    nb::dict values;
    values["axis"] = vector_of(found.axis);
    values["centre_mm"] = vector_of(found.centre_mm);
    values["radius_mm"] = value_of(found.radius_mm);
    values["axis_sigma_deg"] = found.axis_sigma_deg;
    values["length_mm"] = found.length_mm;
    values["rms_mm"] = found.rms_mm;
    values["points"] = found.points;
    values["used"] = found.used;
    return values;
}

nb::dict score_of(const vergence_score &from) {
    nb::dict score;
    score["pixels"] = from.pixels;
    const char *const names[] = {"bad_0_5_percent", "bad_1_percent", "bad_2_percent",
                                 "bad_4_percent"};
    for (int i = 0; i < 4; i++) {
        score[names[i]] = from.bad_percent[i];
    }
    score["average_px"] = from.average_px;
    score["rms_px"] = from.rms_px;
    return score;
}

nb::dict evaluate(const map_array &disparity, const map_array &truth,
                  const std::optional<mask_array> &mask) {
    vergence_evaluation found;
    vergence_error error;
    int code;
    {
        nb::gil_scoped_release release;
        code = vergence_evaluate(disparity.data(), truth.data(), mask ? mask->data() : nullptr,
                                 static_cast<int>(truth.shape(1)), static_cast<int>(truth.shape(0)),
                                 &found, &error);
    }
    check(code, error);
    nb::dict values;
    values["filled_all"] = score_of(found.filled_all);
    values["measured_all"] = score_of(found.measured_all);
    values["measured_all"]["density_percent"] = found.density_all_percent;
    if (mask) {
        values["filled_visible"] = score_of(found.filled_visible);
        values["measured_visible"] = score_of(found.measured_visible);
        values["measured_visible"]["density_percent"] = found.density_visible_percent;
    }
    return values;
}

nb::tuple load_truth(const std::string &path, const std::optional<std::string> &mask_path,
                     double scale) {
    int width_px, height_px;
    float *truth = nullptr;
    uint8_t *mask = nullptr;
    vergence_error error;
    check(vergence_truth_load(path.c_str(), mask_path ? mask_path->c_str() : nullptr, scale,
                              &width_px, &height_px, &truth, &mask, &error),
          error);
    const auto w = static_cast<size_t>(width_px), h = static_cast<size_t>(height_px);
    const nb::object truth_array = array_of<float>(
        truth, {h, w}, nb::capsule(truth, [](void *p) noexcept { vergence_free(p); }));
    if (mask == nullptr) {
        return nb::make_tuple(truth_array, nb::none());
    }
    return nb::make_tuple(truth_array,
                          array_of<uint8_t>(mask, {h, w}, nb::capsule(mask, [](void *p) noexcept {
                                                vergence_free(p);
                                            })));
}

std::vector<std::string> reason_texts() {
    std::vector<std::string> texts;
    for (int i = 0; vergence_reason_text(i) != nullptr; i++) {
        texts.emplace_back(vergence_reason_text(i));
    }
    return texts;
}

}  // namespace

NB_MODULE(_vergence, m) {
    m.attr("version") = vergence_version();
    m.attr("build") = vergence_build();
    m.attr("reasons") = nb::tuple(nb::cast(reason_texts()));
    nb::class_<calibration>(m, "Calibration")
        .def_prop_ro("text",
                     [](const calibration &c) { return vergence_calibration_text(c.owner.get()); })
        .def_prop_ro(
            "format",
            [](const calibration &c) { return vergence_calibration_format(c.owner.get()); })
        .def_prop_ro(
            "good",
            [](const calibration &c) { return vergence_calibration_is_good(c.owner.get()) != 0; })
        .def_prop_ro(
            "verdict",
            [](const calibration &c) { return vergence_calibration_verdict(c.owner.get()); })
        .def_prop_ro("json",
                     [](const calibration &c) { return vergence_calibration_json(c.owner.get()); })
        .def_prop_ro(
            "notes",
            [](const calibration &c) { return notes_of(c.owner.get(), vergence_calibration_note); })
        .def("camera", camera_of)
        .def("pose", pose_of)
        .def("rectified", rectified_of)
        .def("save", save_calibration)
        .def("export", export_calibration);
    nb::class_<result>(m, "Result")
        .def_prop_ro("size", size_of)
        .def_prop_ro("json", [](const result &r) { return vergence_result_json(r.owner.get()); })
        .def_prop_ro("metric",
                     [](const result &r) { return vergence_result_is_metric(r.owner.get()) != 0; })
        .def_prop_ro("common_sigma_mm",
                     [](const result &r) { return vergence_result_common_sigma_mm(r.owner.get()); })
        .def_prop_ro("notes",
                     [](const result &r) { return notes_of(r.owner.get(), vergence_result_note); })
        .def_prop_ro("calibration",
                     [](const result &r) {
                         vergence_calibration *made = nullptr;
                         vergence_error error;
                         check(vergence_result_calibration(r.owner.get(), &made, &error), error);
                         return calibration{
                             std::unique_ptr<vergence_calibration, calibration_deleter>(made)};
                     })
        .def("map", [](nb::handle_t<result> self, int map) { return map_of(self, map); })
        .def("surface", [](nb::handle_t<result> self) { return surface_of(self); })
        .def("write", write_files, "directory"_a, "options"_a, "progress"_a.none())
        .def("depth", depth)
        .def("distance", distance)
        .def("plane", plane, "mask"_a.none())
        .def("cylinder", cylinder, "mask"_a.none());
    binding::bind_pairs(m);
    m.def("load", load);
    m.def("parse", parse);
    m.def("calibrate", calibrate, "words"_a, "progress"_a.none());
    m.def("reconstruct", reconstruct<grey_image>, "left"_a, "right"_a, "names"_a, "layout"_a,
          "bits"_a, "calibration"_a.none(), "options"_a, "progress"_a.none());
    m.def("reconstruct", reconstruct<deep_image>, "left"_a, "right"_a, "names"_a, "layout"_a,
          "bits"_a, "calibration"_a.none(), "options"_a, "progress"_a.none());
    m.def("reconstruct_files", reconstruct_files, "left"_a, "right"_a.none(),
          "calibration"_a.none(), "options"_a, "progress"_a.none());
    m.def("evaluate", evaluate, "disparity"_a, "truth"_a, "mask"_a.none());
    m.def("load_truth", load_truth, "path"_a, "mask"_a.none(), "scale"_a);
}
