// SPDX-License-Identifier: Apache-2.0
/// What the bindings share: errors, progress and Ctrl-C, arrays.
#ifndef VERGENCE_LIBRARY_PYTHON_BINDING_HPP
#define VERGENCE_LIBRARY_PYTHON_BINDING_HPP

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <memory>

#include "library/vergence.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace binding {

using words = std::vector<std::string>;
using place = std::pair<double, double>;
using grey_image = nb::ndarray<const uint8_t, nb::c_contig, nb::device::cpu>;
using deep_image = nb::ndarray<const uint16_t, nb::c_contig, nb::device::cpu>;
using mask_array = nb::ndarray<const uint8_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using map_array = nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

/// Raises the exception of the package for an error of the library.
inline void check(int code, const vergence_error &error) {
    if (code != 0) {
        nb::module_::import_("vergence._errors")
            .attr("fail")(vergence_error_name(code), nb::str(error.text));
    }
}

/// NULL-terminated words.
inline std::vector<const char *> pointers_of(const words &all) {
    std::vector<const char *> pointers;
    for (const std::string &word : all) {
        pointers.push_back(word.c_str());
    }
    pointers.push_back(nullptr);
    return pointers;
}

/// During a call without the GIL: shows progress, and ends the call after Ctrl-C or an exception of
/// the callback, which is raised again afterwards.
class watcher {
  public:
    explicit watcher(const nb::object &progress) : progress_(progress) {}

    template <class Call>
    int run(const Call &call) {
        const vergence_observer observer = {progress_.is_none() ? nullptr : show, stop, this};
        int code;
        {
            nb::gil_scoped_release release;
            code = call(&observer);
        }
        if (failed_) {
            throw nb::python_error(std::move(*failed_));
        }
        return code;
    }

  private:
    static void show(void *self, const char *stage, double share) {
        auto *one = static_cast<watcher *>(self);
        nb::gil_scoped_acquire acquire;
        try {
            if (!one->failed_) {
                one->progress_(stage, share);
            }
        } catch (nb::python_error &failure) {
            one->failed_ = std::make_unique<nb::python_error>(std::move(failure));
        }
    }

    static int stop(void *self) {
        auto *one = static_cast<watcher *>(self);
        nb::gil_scoped_acquire acquire;
        if (!one->failed_ && PyErr_CheckSignals() != 0) {
            one->failed_ = std::make_unique<nb::python_error>();
        }
        return one->failed_ ? 1 : 0;
    }

    nb::object progress_;
    std::unique_ptr<nb::python_error> failed_;
};

struct calibration_deleter {
    void operator()(vergence_calibration *one) const { vergence_calibration_free(one); }
};
struct result_deleter {
    void operator()(vergence_result *one) const { vergence_result_free(one); }
};

struct calibration {
    std::unique_ptr<vergence_calibration, calibration_deleter> owner;
};

struct result {
    std::unique_ptr<vergence_result, result_deleter> owner;
};

/// pairs.cpp: adds the table of many pairs to the module.
void bind_pairs(nb::module_ &m);

template <class Object, class Note>
std::vector<std::string> notes_of(const Object *object, const Note &note) {
    std::vector<std::string> all;
    for (const char *text = note(object, 0); text != nullptr; text = note(object, all.size())) {
        all.emplace_back(text);
    }
    return all;
}

/// An array of our own memory, or of `owner`'s.
template <class Value>
nb::object array_of(const Value *data, std::initializer_list<size_t> shape, nb::handle owner) {
    return nb::cast(nb::ndarray<nb::numpy, const Value>(data, shape.size(), shape.begin(), owner));
}

template <class Value>
nb::object copied(const Value *data, size_t rows, size_t columns) {
    auto *copy = new Value[rows * columns];
    std::copy_n(data, rows * columns, copy);
    const nb::capsule owner(copy, [](void *p) noexcept { delete[] static_cast<Value *>(p); });
    const size_t shape[] = {rows, columns};
    return nb::cast(nb::ndarray<nb::numpy, Value>(copy, columns == 1 ? 1 : 2, shape, owner));
}

}  // namespace binding

#endif
