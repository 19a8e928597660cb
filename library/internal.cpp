// SPDX-License-Identifier: Apache-2.0
#include "library/internal.hpp"

#include <algorithm>
#include <cstdio>

#include "daemon/base/message.h"
#include "daemon/base/process.h"

const char *vergence_version(void) {
    return version_text();
}

const char *vergence_build(void) {
    return version_build_id();
}

const char *vergence_error_name(int code) {
    return error_name(code);
}

int library_fail(vergence_error *error, int code, const std::string &text) {
    if (error != nullptr) {
        message line{};
        message_set(&line, code, "%s", text.c_str());
        error->code = code;
        std::snprintf(error->text, sizeof error->text, "%s", line.text);
    }
    return code;
}

void library_words::add(const char *const *options) {
    for (; options != nullptr && *options != nullptr; options++) {
        words_.push_back(*options);
    }
}

char **library_words::values() {
    values_.clear();
    for (std::string &word : words_) {
        values_.push_back(word.data());
    }
    values_.push_back(nullptr);
    return values_.data();
}

void library_watch::expect(const double *work, int stages) {
    before_.assign(1, 0);
    for (int i = 0; i < stages; i++) {
        before_.push_back(before_.back() + work[i]);
    }
}

void library_watch::show(int stage, const char *what, int done, int total) const {
    if (observer_ == nullptr || observer_->progress == nullptr) {
        return;
    }
    const auto at = static_cast<size_t>(stage);
    double share = 0;
    if (at + 1 < before_.size() && before_.back() > 0) {
        const double part = total > 0 ? std::min(1.0, static_cast<double>(done) / total) : 0;
        share = (before_[at] + part * (before_[at + 1] - before_[at])) / before_.back();
    }
    observer_->progress(observer_->self, what, share);
}
