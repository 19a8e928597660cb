// SPDX-License-Identifier: Apache-2.0
// Pictures by the console's `stream` on a connection of their own; each command on another one, so
// that none waits for a picture. A serial line is the only one, and what it shows is smaller.
#include <cjson/cJSON.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <mutex>
#include <nlohmann/json.hpp>
#include <set>

#include "core/base64.h"
#include "core/error.h"
#include "daemon/client/remote.h"
#include "tools/host/view/view_source.hpp"

std::string view_failed(const std::string &name, const std::string &message) {
    return nlohmann::json{{"ok", false}, {"error", name}, {"message", message}}.dump();
}

namespace {

using nlohmann::json;

/// A connection that is open while it lives.
class connection {
  public:
    connection() {
        remote_.line.fd = -1;
        remote_.extra_fd = -1;
    }
    ~connection() {
        cJSON_Delete(remote_.answer);
        remote_line_close(&remote_.line);
    }
    connection(const connection &) = delete;
    connection &operator=(const connection &) = delete;

    bool open(const std::string &address, const char *token, std::string *error) {
        message last_error{};
        remote_.token_path = token;
        int code = !address.empty() ? remote_line_open(&remote_.line, address.c_str(), &last_error)
                                    : remote_open_default(&remote_.line, &last_error);
        if (code != 0) {
            remote_.line.fd = -1;
            *error = last_error.text;
            return false;
        }
        std::string rejection;
        const auto keep = [](remote *, void *into, const char *text) {
            *static_cast<std::string *>(into) = text;
        };
        code = remote_greet(&remote_, keep, &rejection, &last_error);
        *error = code < 0 ? last_error.text : rejection;
        remote_.json = true;
        return code == 0;
    }

    remote *get() { return &remote_; }
    int fd() const { return remote_.line.fd; }
    bool is_serial() const { return remote_.line.serial; }

  private:
    remote remote_{};
};

class instrument : public view_source {
  public:
    bool open(const char *address, const char *token, std::string *error) {
        address_ = address != nullptr ? address : "";
        token_ = token;
        pictures_ = connect(error);
        if (pictures_ == nullptr) {
            return false;
        }
        serial_ = pictures_->is_serial();
        return true;
    }

    bool next(view_picture *picture, bool calibrated) override;
    void run(const std::string &command,
             const std::function<bool(const std::string &)> &show) override;
    void cancel() override;
    std::string fetch(const std::string &name, const std::string &local,
                      std::string *error) override;
    bool send(const std::string &local, const std::string &name, std::string *error) override;
    std::string name() const override { return address_.empty() ? "vergenced" : address_; }
    bool is_live() const override { return true; }
    void stop() override {
        const std::lock_guard<std::mutex> lock(mutex_);
        stopping_ = true;
        for (const int fd : in_use_) {
            shutdown(fd, SHUT_RDWR);
        }
    }

  private:
    std::unique_ptr<connection> connect(std::string *error) const {
        auto made = std::make_unique<connection>();
        return made->open(address_, token_, error) ? std::move(made) : nullptr;
    }

    /// Registers a descriptor while it is waited for, so that `stop` ends the wait.
    class use {
      public:
        use(instrument *owner, int fd, bool command) : owner_(owner), fd_(fd) {
            const std::lock_guard<std::mutex> lock(owner_->mutex_);
            owner_->in_use_.insert(fd_);
            if (command) {
                owner_->commands_.insert(fd_);
            }
            if (owner_->stopping_) {
                shutdown(fd_, SHUT_RDWR);
            }
        }
        ~use() {
            const std::lock_guard<std::mutex> lock(owner_->mutex_);
            owner_->in_use_.erase(fd_);
            owner_->commands_.erase(fd_);
        }
        use(const use &) = delete;
        use &operator=(const use &) = delete;

      private:
        instrument *owner_;
        int fd_;
    };

    json ask(const std::string &request, std::string *error) const;
    bool take_bytes(const json &result, view_picture *picture) const;

    std::string address_;
    const char *token_ = nullptr;
    bool serial_ = false;
    std::unique_ptr<connection> pictures_;  ///< over a serial line, of commands too
    std::mutex line_;                       ///< one user of the serial line, and of files
    std::mutex mutex_;
    std::set<int> in_use_, commands_;
    bool stopping_ = false;
};

/// The answer to a request for a picture; null with an error if there is none.
json instrument::ask(const std::string &request, std::string *error) const {
    remote *const line = pictures_->get();
    if (serial_) {
        message last_error{};
        const cJSON *result = nullptr;
        if (remote_call(line, request.c_str(), &result, &last_error) != 0) {
            *error = last_error.text;
            return nullptr;
        }
        char *const text = cJSON_PrintUnformatted(result);
        json found = json::parse(text, nullptr, false);
        cJSON_free(text);
        return found;
    }
    const std::string whole = "@json,binary " + request + "\n";
    char *text = nullptr;
    if (!remote_line_send(&line->line, whole.data(), whole.size()) ||
        remote_receive(line, REMOTE_FOREVER_MS, &text) != 0) {
        *error = "connection lost (is vergenced running?)";
        return nullptr;
    }
    const json answer = json::parse(text, nullptr, false);
    if (answer.is_discarded() || !answer.value("ok", false)) {
        *error = answer.is_discarded()
                     ? "invalid answer from vergenced"
                     : answer.value("error", "") + ": " + answer.value("message", "");
        return nullptr;
    }
    return answer.value("result", json());
}

bool instrument::take_bytes(const json &result, view_picture *picture) const {
    const std::size_t bytes = result.value("bytes", std::size_t{0});
    const std::size_t text = result.value("calibration_bytes", std::size_t{0});
    const std::size_t pixels = static_cast<std::size_t>(picture->width_px) *
                               static_cast<std::size_t>(picture->height_px * picture->channels);
    constexpr std::size_t bytes_max = 64 << 20;
    if (pixels == 0 || bytes != pixels + text || bytes > bytes_max) {
        return false;
    }
    picture->pixels.resize(bytes);
    if (serial_) {
        const std::string data = result.value("data", "");
        return base64_decode(data.c_str(), picture->pixels.data(), bytes) ==
               static_cast<long>(bytes);
    }
    return remote_receive_bytes(pictures_->get(), picture->pixels.data(), bytes);
}

bool instrument::next(view_picture *picture, bool calibrated) {
    const std::unique_lock<std::mutex> alone =
        serial_ ? std::unique_lock<std::mutex>(line_) : std::unique_lock<std::mutex>();
    if (pictures_ == nullptr) {
        pictures_ = connect(&picture->error);
        if (pictures_ == nullptr) {
            return false;
        }
    }
    bool lost = false;
    {
        const use used(this, pictures_->fd(), false);
        const json result = ask(std::string("stream") + (serial_ ? " side=160 colour=no" : "") +
                                    (calibrated ? " calibration=yes" : ""),
                                &picture->error);
        if (result.is_object()) {
            picture->width_px = result.value("width", 0);
            picture->height_px = result.value("height", 0);
            picture->channels = result.value("channels", 1);
            lost = !take_bytes(result, picture);
            json facts = result;
            facts.erase("data");
            picture->facts = facts.dump();
            const std::size_t text = result.value("calibration_bytes", std::size_t{0});
            if (!lost) {
                const auto begin = picture->pixels.end() - static_cast<std::ptrdiff_t>(text);
                picture->calibration.assign(begin, picture->pixels.end());
                picture->without = result.value("calibration_missing", "");
                picture->pixels.resize(picture->pixels.size() - text);
            }
        }
        lost = lost || picture->error.compare(0, 10, "connection") == 0;
    }
    if (lost) {
        pictures_.reset();
        picture->error = "connection lost (is vergenced running?)";
    }
    return picture->error.empty();
}

void instrument::run(const std::string &command,
                     const std::function<bool(const std::string &)> &show) {
    std::string error;
    const std::unique_lock<std::mutex> alone =
        serial_ ? std::unique_lock<std::mutex>(line_) : std::unique_lock<std::mutex>();
    const std::unique_ptr<connection> own = serial_ ? nullptr : connect(&error);
    connection *const line = serial_ ? pictures_.get() : own.get();
    if (line == nullptr) {
        show(view_failed("DEVICE", error));
        return;
    }
    const use used(this, line->fd(), true);
    struct context {
        const std::function<bool(const std::string &)> *show;
        bool answered = false;
        bool cancelled = false;
    } whole{&show};
    const auto pass = [](remote *self, void *cookie, const char *text) {
        auto *const to = static_cast<context *>(cookie);
        to->answered = true;
        if (!(*to->show)(text) && !to->cancelled) {
            to->cancelled = true;
            remote_line_send(&self->line, "\3", 1);
        }
    };
    message last_error{};
    if (remote_ask(line->get(), command.c_str(), pass, &whole, &last_error) < 0) {
        show(view_failed("DEVICE", last_error.text));
    }
}

void instrument::cancel() {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const int fd : commands_) {
        const ssize_t sent = write(fd, "\3", 1);
        static_cast<void>(sent);  // the command has just ended
    }
}

std::string instrument::fetch(const std::string &name, const std::string &local,
                              std::string *error) {
    const std::lock_guard<std::mutex> alone(line_);
    const std::unique_ptr<connection> own = serial_ ? nullptr : connect(error);
    connection *const line = serial_ ? pictures_.get() : own.get();
    if (line == nullptr) {
        return "";
    }
    const use used(this, line->fd(), false);
    message last_error{};
    const auto written = std::make_unique<remote_written>();
    const std::string path = local + "/" + name;
    if (remote_fetch(line->get(), name.c_str(), path.c_str(), written.get(), &last_error) != 0) {
        *error = last_error.text;
        return "";
    }
    return path;
}

bool instrument::send(const std::string &local, const std::string &name, std::string *error) {
    const std::lock_guard<std::mutex> alone(line_);
    const std::unique_ptr<connection> own = serial_ ? nullptr : connect(error);
    connection *const line = serial_ ? pictures_.get() : own.get();
    char quoted[REMOTE_REQUEST_BYTES];
    if (line == nullptr || !remote_quote(local.c_str(), quoted)) {
        return false;
    }
    const use used(this, line->fd(), false);
    message last_error{};
    int code = 0;
    const std::string command = "send " + std::string(quoted) + " " + name;
    const auto ignore = [](remote *, void *, const char *) {};
    if (remote_files(line->get(), command.c_str(), ignore, nullptr, &code, &last_error) != 1 ||
        code != 0) {
        *error = last_error.text;
        return false;
    }
    return true;
}

}  // namespace

std::unique_ptr<view_source> view_instrument_open(const char *address, const char *token,
                                                  std::string *error) {
    auto made = std::make_unique<instrument>();
    return made->open(address, token, error) ? std::move(made) : nullptr;
}
