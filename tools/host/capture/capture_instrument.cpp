// SPDX-License-Identifier: Apache-2.0
#include "tools/host/capture/capture_instrument.hpp"

#include <cjson/cJSON.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>

#include "core/error.h"
#include "daemon/client/remote.h"

namespace {

/// Ctrl-C ends the command that runs; no other one starts.
void take_interrupt(remote *self) {
    if (remote_take_signal(self)) {
        remote_interrupt(self);
    }
}

void keep_text(remote *, void *cookie, const char *text) {
    *static_cast<std::string *>(cookie) = text;
}

const cJSON *member(const cJSON *object, const std::string &path) {
    for (size_t at = 0; object != nullptr;) {
        const size_t dot = path.find('.', at);
        object = cJSON_GetObjectItemCaseSensitive(object, path.substr(at, dot - at).c_str());
        if (dot == std::string::npos) {
            return object;
        }
        at = dot + 1;
    }
    return nullptr;
}

}  // namespace

capture_instrument::capture_instrument() : remote_(new remote{}) {
    remote_->line.fd = -1;
    remote_->extra_fd = -1;
}

capture_instrument::~capture_instrument() {
    if (remote_->line.fd >= 0) {
        cJSON_Delete(remote_->answer);
        remote_line_close(&remote_->line);
    }
    if (remote_->extra_fd >= 0) {
        close(remote_->extra_fd);
    }
}

bool capture_instrument::open(const char *address, const char *token, std::string *error) {
    message last_error{};
    remote_->token_path = token;
    int code = address != nullptr ? remote_line_open(&remote_->line, address, &last_error)
                                  : remote_open_default(&remote_->line, &last_error);
    if (code != 0) {
        remote_->line.fd = -1;
        *error = last_error.text;
        return false;
    }
    sigset_t taken;
    sigemptyset(&taken);
    sigaddset(&taken, SIGINT);
    sigaddset(&taken, SIGTERM);
    sigprocmask(SIG_BLOCK, &taken, nullptr);
    remote_->extra_fd = signalfd(-1, &taken, SFD_CLOEXEC | SFD_NONBLOCK);
    remote_->service = take_interrupt;
    std::string rejection;
    code = remote_greet(remote_.get(), keep_text, &rejection, &last_error);
    *error = code < 0 ? last_error.text : rejection;
    return code == 0;
}

bool capture_instrument::run(const std::string &command, std::string *error) {
    message last_error{};
    result_ = nullptr;
    if (interrupted()) {
        *error = "interrupted";
        return false;
    }
    const int code = remote_call(remote_.get(), command.c_str(), &result_, &last_error);
    *error = code == 0 ? "" : last_error.text;
    return code == 0;
}

bool capture_instrument::number(const std::string &path, double *value) const {
    const cJSON *const found = member(result_, path);
    if (!cJSON_IsNumber(found)) {
        return false;
    }
    *value = found->valuedouble;
    return true;
}

bool capture_instrument::text(const std::string &path, std::string *value) const {
    const cJSON *const found = member(result_, path);
    if (!cJSON_IsString(found)) {
        return false;
    }
    *value = found->valuestring;
    return true;
}

bool capture_instrument::setting_text(const std::string &key, std::string *value,
                                      std::string *error) {
    if (!run("config " + key, error)) {
        return false;
    }
    const cJSON *const found = cJSON_GetObjectItemCaseSensitive(result_, key.c_str());
    if (!cJSON_IsString(found)) {
        *error = "invalid answer from vergenced";
        return false;
    }
    *value = found->valuestring;
    return true;
}

bool capture_instrument::setting(const std::string &key, double *value, std::string *error) {
    std::string written;
    if (!setting_text(key, &written, error)) {
        return false;
    }
    char *end = nullptr;
    *value = std::strtod(written.c_str(), &end);
    if (end == written.c_str()) {
        *error = key + " is " + written + ", but the capture needs a number (set it in " +
                 "vergenced.conf)";
        return false;
    }
    return true;
}

bool capture_instrument::fetch(const std::string &name, const std::string &local,
                               std::string *error) {
    message last_error{};
    remote_written written{};
    const int code =
        remote_fetch(remote_.get(), name.c_str(), local.c_str(), &written, &last_error);
    *error = code == 0 ? "" : last_error.text;
    return code == 0;
}

void capture_instrument::discard(const std::string &name) {
    message ignored{};
    result_ = nullptr;
    remote_call(remote_.get(), ("remove " + name).c_str(), &result_, &ignored);
}

bool capture_instrument::interrupted() {
    return remote_interrupted(remote_.get());
}

capture_instrument::answer capture_instrument::ask(std::string *line) {
    line->clear();
    for (;;) {
        pollfd inputs[2] = {{STDIN_FILENO, POLLIN, 0}, {remote_->extra_fd, POLLIN, 0}};
        poll(inputs, 2, -1);
        if (interrupted()) {
            return answer::interrupted;
        }
        char byte = 0;
        if (inputs[0].revents != 0) {
            if (read(STDIN_FILENO, &byte, 1) != 1) {
                return line->empty() ? answer::end : answer::line;
            }
            if (byte == '\n') {
                return answer::line;
            }
            line->push_back(byte);
        }
    }
}
