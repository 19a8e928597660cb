// SPDX-License-Identifier: Apache-2.0
/// The pairs of many sessions for Python, see python/vergence/_batch.py.
#include "library/python/binding.hpp"

namespace {

using namespace binding;

struct pairs_deleter {
    void operator()(vergence_pairs *one) const { vergence_pairs_free(one); }
};

struct pairs {
    std::unique_ptr<vergence_pairs, pairs_deleter> owner;
};

pairs list_pairs(const words &paths, const std::string &directory, const calibration *rig,
                 const words &options) {
    vergence_pairs *made = nullptr;
    vergence_error error;
    const std::vector<const char *> all = pointers_of(paths), line = pointers_of(options);
    int code;
    {
        nb::gil_scoped_release release;
        code = vergence_pairs_list(all.data(), directory.c_str(),
                                   rig != nullptr ? rig->owner.get() : nullptr, line.data(), &made,
                                   &error);
    }
    check(code, error);
    return {std::unique_ptr<vergence_pairs, pairs_deleter>(made)};
}

nb::dict pair_of(const pairs &all, size_t number) {
    vergence_pair one;
    if (number >= vergence_pairs_count(all.owner.get())) {
        throw nb::index_error();
    }
    vergence_pairs_get(all.owner.get(), number, &one);
    nb::dict values;
    values["session"] = one.session;
    values["pair"] = one.number;
    values["name"] = one.name;
    values["done"] = one.done != 0;
    values["kept"] = one.kept != 0;
    values["error"] = one.error != nullptr ? nb::object(nb::str(one.error)) : nb::none();
    values["points"] = one.points;
    values["notes"] = one.notes;
    values["depth_mm"] = one.depth_mm;
    values["sigma_mm"] = one.sigma_mm;
    values["seconds"] = one.seconds;
    return values;
}

void set_pair(const pairs &all, size_t number, const std::optional<std::string> &why, size_t points,
              int notes, double depth_mm, double sigma_mm, double seconds) {
    vergence_error error;
    vergence_pair one = {};
    one.done = why ? 0 : 1;
    one.error = why ? why->c_str() : nullptr;
    one.points = points;
    one.notes = notes;
    one.depth_mm = depth_mm;
    one.sigma_mm = sigma_mm;
    one.seconds = seconds;
    check(vergence_pairs_set(all.owner.get(), number, &one, &error), error);
}

void store_pair(const pairs &all, size_t number,
                const std::vector<std::pair<std::string, nb::bytes>> &files) {
    vergence_error error;
    std::vector<vergence_file> each;
    for (const auto &[name, data] : files) {
        each.push_back({name.c_str(), data.c_str(), data.size()});
    }
    check(vergence_pairs_store(all.owner.get(), number, each.data(), each.size(), &error), error);
}

}  // namespace

void binding::bind_pairs(nb::module_ &m) {
    nb::class_<pairs>(m, "Pairs")
        .def("__len__", [](const pairs &all) { return vergence_pairs_count(all.owner.get()); })
        .def("get", pair_of)
        .def("set", set_pair, "number"_a, "error"_a.none(), "points"_a, "notes"_a, "depth_mm"_a,
             "sigma_mm"_a, "seconds"_a)
        .def("store", store_pair);
    m.def("list_pairs", list_pairs, "paths"_a, "directory"_a, "calibration"_a.none(), "options"_a);
}
