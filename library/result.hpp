// SPDX-License-Identifier: Apache-2.0
/// A result of libvergence: the job and what was made of it on demand.
#ifndef VERGENCE_LIBRARY_RESULT_HPP
#define VERGENCE_LIBRARY_RESULT_HPP

#include <memory>
#include <mutex>
#include <vector>

#include "daemon/surface/reconstruct_job.h"
#include "daemon/surface/reconstruct_session.h"
#include "library/internal.hpp"

/// The arrays of struct vergence_surface that the result does not have in that form.
struct surface_arrays {
    bool made = false;
    std::vector<float> position_mm, normal, sigma_mm;
    std::vector<uint8_t> colour;
};

struct vergence_result {
    vergence_result() = default;
    vergence_result(const vergence_result &) = delete;
    vergence_result &operator=(const vergence_result &) = delete;
    ~vergence_result();

    library_words words{"reconstruct"}, write_words{"reconstruct"};
    reconstruct_request request{};  // points into the words
    reconstruct_program program{};
    reconstruct_caller caller{};
    reconstruct_source source{};
    std::unique_ptr<reconstruct_session> session;
    reconstruct_job job{};
    bool ran = false;
    std::string json;
    // Only during a call:
    const vergence_image *image[2] = {nullptr, nullptr};
    library_watch *watch = nullptr;

    mutable std::mutex making;  // guards what is below
    mutable std::vector<float> floats[VERGENCE_SIGMA_MM + 1];
    mutable std::vector<uint8_t> bytes[VERGENCE_RIGHT_RGB - VERGENCE_REASON + 1];
    mutable surface_arrays surface;
};

extern const char *const library_no_lengths;

#endif
