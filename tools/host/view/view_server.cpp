// SPDX-License-Identifier: Apache-2.0
#include "tools/host/view/view_server.hpp"

#include <civetweb.h>
#include <sys/random.h>

#include <atomic>
#include <cstring>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "daemon/base/monotonic.h"
#include "tools/host/formats/colormap.hpp"
#include "tools/host/view/view_board.hpp"
#include "tools/host/view/view_depth.hpp"
#include "tools/host/view/view_feed.hpp"
#include "tools/host/view/view_jpeg.hpp"
#include "tools/host/view/view_results.hpp"
#include "tools/host/view/view_source.hpp"

namespace {

using nlohmann::json;

constexpr std::chrono::milliseconds patience(5000);
constexpr std::size_t body_max_bytes = 8192;

std::string random_token() {
    unsigned char bytes[16];
    std::string text;
    if (getrandom(bytes, sizeof bytes, 0) != static_cast<ssize_t>(sizeof bytes)) {
        return "";
    }
    for (const unsigned char byte : bytes) {
        constexpr char digits[] = "0123456789abcdef";
        text += {digits[byte >> 4], digits[byte & 15]};
    }
    return text;
}

/// Compares in a time that does not depend on where they differ.
bool is_same(const std::string &one, const std::string &other) {
    unsigned differs = one.size() != other.size();
    for (std::size_t i = 0; i < one.size() && i < other.size(); i++) {
        differs |= static_cast<unsigned char>(one[i]) ^ static_cast<unsigned char>(other[i]);
    }
    return differs == 0;
}

void answer(mg_connection *client, const char *status, const char *type, const std::string &body,
            const std::string &headers = "") {
    mg_printf(client,
              "HTTP/1.1 %s\r\nContent-Type: %s\r\nContent-Length: %zu\r\nCache-Control: "
              "no-store\r\nReferrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\n"
              "X-Frame-Options: DENY\r\nCross-Origin-Resource-Policy: same-origin\r\n%s\r\n",
              status, type, body.size(), headers.c_str());
    mg_write(client, body.data(), body.size());
}

void refuse(mg_connection *client, const char *status, const std::string &why) {
    answer(client, status, "text/plain; charset=utf-8", why + "\n");
}

double number_of(const char *query, const char *name) {
    char value[32] = "";
    if (query == nullptr || mg_get_var(query, std::strlen(query), name, value, sizeof value) <= 0) {
        return 0;
    }
    const double number = std::strtod(value, nullptr);
    return number > 0 && number < 1e15 ? number : 0;
}

std::string body_of(mg_connection *client) {
    std::string body(body_max_bytes, '\0');
    std::size_t length = 0;
    for (int bytes = 1; bytes > 0 && length < body.size();) {
        bytes = mg_read(client, &body[length], body.size() - length);
        length += bytes > 0 ? static_cast<std::size_t>(bytes) : 0;
    }
    body.resize(length);
    return body;
}

}  // namespace

struct view_server::state {
    view_source *source = nullptr;
    view_settings settings;
    std::string token, host, address;
    std::unique_ptr<view_feed<view_picture>> pictures;
    std::unique_ptr<view_feed<view_depth>> depths;
    view_depth_maker maker;  ///< of the thread of `depths`, as the next two
    view_depth_request measured;
    std::uint64_t measured_picture = 0;
    std::atomic<std::uint64_t> depth_asked_us{0};  ///< pictures need a calibration for a while
    std::mutex mutex;
    view_depth_request asked;  ///< for the depths to come
    std::mutex one_surface;    ///< one at a time
    mg_context *server = nullptr;

    std::shared_ptr<view_picture> take();
    std::shared_ptr<view_depth> measure();
    bool admits(mg_connection *client, const mg_request_info *request, std::string *path) const;
    void serve(mg_connection *client, const mg_request_info *request, const std::string &path);
    void post(mg_connection *client, const std::string &path);
    void send_picture(mg_connection *client, std::uint64_t after);
    void send_depth(mg_connection *client, const char *query, std::uint64_t after);
    void send_board(mg_connection *client, const char *query, std::uint64_t after);
    void send_result(mg_connection *client, const std::string &path);
    void run_command(mg_connection *client, const std::string &line) const;
    std::string facts() const;
};

std::shared_ptr<view_picture> view_server::state::take() {
    auto picture = std::make_shared<view_picture>();
    constexpr std::uint64_t recent_us = 10000000;  // a page asks again within `patience`
    if (source->next(picture.get(), monotonic_now_us() - depth_asked_us < recent_us)) {
        picture->taken_us = monotonic_now_us();
        if (!view_jpeg_make(picture.get())) {
            picture->error = "out of memory for a picture";
        }
        return picture;
    }
    return picture->error.empty() ? nullptr : picture;
}

std::shared_ptr<view_depth> view_server::state::measure() {
    view_depth_request now;
    {
        const std::lock_guard<std::mutex> lock(mutex);
        now = asked;
    }
    // Of a session the same picture counts again when something else is asked of it.
    const bool changed = now.near_mm != measured.near_mm || now.far_mm != measured.far_mm ||
                         now.refined != measured.refined;
    const auto picture = pictures->newer(changed && !source->is_live() ? 0 : measured_picture,
                                         std::chrono::milliseconds(1000));
    const bool asked_for =
        picture != nullptr &&
        (!picture->error.empty() || !picture->without.empty() || !picture->calibration.empty());
    if (!asked_for) {
        return nullptr;
    }
    measured_picture = picture->number;
    measured = now;
    return maker.make(*picture, now);
}

/// Whether the request may be answered: for this host, from this page or from none, with the token.
/// Sets the path below it.
bool view_server::state::admits(mg_connection *client, const mg_request_info *request,
                                std::string *path) const {
    const char *const named = mg_get_header(client, "Host");
    const char *const origin = mg_get_header(client, "Origin");
    const std::string local = "localhost" + host.substr(host.find(':'));
    if (named == nullptr || (named != host && named != local)) {
        refuse(client, "403 Forbidden", "this server is for http://" + host + " only");
        return false;
    }
    if (origin != nullptr && origin != "http://" + host && origin != "http://" + local) {
        refuse(client, "403 Forbidden", "requests of other pages are refused");
        return false;
    }
    const std::string whole = request->local_uri;
    const std::size_t end = whole.find('/', 1);
    if (end == std::string::npos || !is_same(whole.substr(1, end - 1), token)) {
        refuse(client, "403 Forbidden",
               "no such page: use the address that \"vergence view\" printed");
        return false;
    }
    *path = whole.substr(end + 1);
    return true;
}

void view_server::state::send_picture(mg_connection *client, std::uint64_t after) {
    const auto picture = pictures->newer(after, patience);
    if (picture == nullptr) {
        answer(client, "204 No Content", "text/plain", "");
        return;
    }
    json about = json::parse(picture->facts, nullptr, false);
    about["number"] = picture->number;
    about["age_ms"] = static_cast<double>(monotonic_now_us() - picture->taken_us) / 1e3;
    if (!picture->error.empty()) {
        answer(client, "503 Service Unavailable", "text/plain; charset=utf-8", picture->error,
               "X-Vergence: " + about.dump(-1, ' ', true) + "\r\n");
        return;
    }
    answer(client, "200 OK", "image/jpeg", std::string(picture->jpeg.begin(), picture->jpeg.end()),
           "X-Vergence: " + about.dump(-1, ' ', true) + "\r\n");
}

void view_server::state::send_depth(mg_connection *client, const char *query, std::uint64_t after) {
    depth_asked_us = monotonic_now_us();
    {
        const std::lock_guard<std::mutex> lock(mutex);
        const double near_mm = number_of(query, "near");
        const double far_mm = number_of(query, "far");
        const bool stated = near_mm > 0 && far_mm > near_mm;
        asked.near_mm = stated ? near_mm : settings.near_mm;
        asked.far_mm = stated ? far_mm : settings.far_mm;
        asked.refined = number_of(query, "refined") > 0;
    }
    const auto depth = depths->newer(after, patience);
    if (depth == nullptr) {
        answer(client, "204 No Content", "text/plain", "");
        return;
    }
    const std::string number = "X-Vergence: {\"number\":" + std::to_string(depth->number) + "}\r\n";
    if (!depth->error.empty()) {
        answer(client, "503 Service Unavailable", "text/plain; charset=utf-8", depth->error,
               number);
        return;
    }
    answer(client, "200 OK", "application/octet-stream", depth->bytes, number);
}

/// The answer as it comes, so that the page sees progress.
void view_server::state::run_command(mg_connection *client, const std::string &line) const {
    mg_printf(client,
              "HTTP/1.1 200 OK\r\nContent-Type: application/x-ndjson\r\nTransfer-Encoding: "
              "chunked\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\r\n");
    source->run(line, [client](const std::string &answer_line) {
        const std::string whole = answer_line + "\n";
        return mg_send_chunk(client, whole.data(), static_cast<unsigned>(whole.size())) > 0;
    });
    mg_send_chunk(client, "", 0);
}

void view_server::state::send_board(mg_connection *client, const char *query, std::uint64_t after) {
    const int columns = static_cast<int>(number_of(query, "columns"));
    const int rows = static_cast<int>(number_of(query, "rows"));
    constexpr int corners_max = 255;
    if (columns < 2 || rows < 2 || columns > corners_max || rows > corners_max) {
        refuse(client, "400 Bad Request", "a board has 2x2 to 255x255 inner corners, as in 9x6");
        return;
    }
    const auto picture = pictures->newer(after, patience);
    if (picture == nullptr || !picture->error.empty()) {
        answer(client, "204 No Content", "text/plain", "");
        return;
    }
    answer(client, "200 OK", "application/json", view_board_find(*picture, columns, rows),
           "X-Vergence: {\"number\":" + std::to_string(picture->number) + "}\r\n");
}

void view_server::state::send_result(mg_connection *client, const std::string &path) {
    view_result result;
    std::string error;
    if (!view_result_read(source, settings, path, &result, &error)) {
        refuse(client, "404 Not Found", error);
        return;
    }
    // A file may come from anywhere; the report's scripts are ours.
    answer(client, "200 OK", result.type, result.content,
           result.ours ? "" : "Content-Security-Policy: sandbox\r\n");
}

void view_server::state::post(mg_connection *client, const std::string &path) {
    const std::string body = body_of(client);
    if (path == "command") {
        run_command(client, body);
    } else if (path == "cancel") {
        source->cancel();
        answer(client, "204 No Content", "text/plain", "");
    } else if (path == "reconstruct") {
        const std::lock_guard<std::mutex> alone(one_surface);
        answer(client, "200 OK", "application/json", view_surface_make(source, settings, body));
    } else if (path == "calibrate") {
        const std::lock_guard<std::mutex> alone(one_surface);
        answer(client, "200 OK", "application/json", view_board_calibrate(source, settings, body));
    } else {
        refuse(client, "404 Not Found", "no such page");
    }
}

void view_server::state::serve(mg_connection *client, const mg_request_info *request,
                               const std::string &path) {
    const bool posted = std::strcmp(request->request_method, "POST") == 0;
    auto after = static_cast<std::uint64_t>(number_of(request->query_string, "after"));
    if (after == 0 && source->is_live()) {
        // The newest one may be old: none is made while no page asks.
        after = path == "depth" ? depths->count() : pictures->count();
    }
    if (posted) {
        post(client, path);
    } else if (std::strcmp(request->request_method, "GET") != 0) {
        refuse(client, "405 Method Not Allowed", "GET or POST");
    } else if (path.empty()) {
        answer(client, "200 OK", "text/html; charset=utf-8",
               view_page_make(settings.title, facts()));
    } else if (path == "picture") {
        send_picture(client, after);
    } else if (path == "depth") {
        send_depth(client, request->query_string, after);
    } else if (path == "board") {
        send_board(client, request->query_string, after);
    } else if (path.compare(0, 4, "out/") == 0 || path.compare(0, 5, "file/") == 0) {
        send_result(client, path);
    } else {
        refuse(client, "404 Not Found", "no such page");
    }
}

std::string view_server::state::facts() const {
    json colours = json::array();
    for (const colormap_rgb &colour : colormap_sequential()) {
        colours.push_back(colour);
    }
    std::string text = json{
        {"live", source->is_live()},
        {"name", source->name()},
        {"near", settings.near_mm},
        {"far", settings.far_mm},
        {"colours",
         colours}}.dump(-1, ' ', true);
    for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos;) {
        text.replace(at, 1, "\\u003c");  // it stands inside a <script> element
    }
    return text;
}

view_server::view_server() : state_(new state) {}

view_server::~view_server() {
    state_->source->stop();
    if (state_->pictures != nullptr) {
        state_->depths->stop();
        state_->pictures->stop();
    }
    if (state_->server != nullptr) {
        mg_stop(state_->server);
    }
    state_->depths.reset();
    state_->pictures.reset();
}

const std::string &view_server::address() const {
    return state_->address;
}

bool view_server::start(view_source *source, const view_settings &settings, std::string *error) {
    state &self = *state_;
    self.source = source;
    self.settings = settings;
    self.token = random_token();
    self.pictures = std::make_unique<view_feed<view_picture>>([&self] { return self.take(); });
    self.depths = std::make_unique<view_feed<view_depth>>([&self] { return self.measure(); });
    const std::string port = "127.0.0.1:" + std::to_string(settings.port);
    const char *options[] = {"listening_ports",
                             port.c_str(),
                             "num_threads",
                             "16",
                             "enable_keep_alive",
                             "yes",
                             "keep_alive_timeout_ms",
                             "5000",
                             "tcp_nodelay",
                             "1",
                             "enable_directory_listing",
                             "no",
                             nullptr};
    mg_callbacks callbacks{};
    callbacks.begin_request = [](mg_connection *client) {
        const mg_request_info *const request = mg_get_request_info(client);
        auto *const server = static_cast<state *>(request->user_data);
        // On a stack of the default size: the library's threads have 100 kB, less than a file
        // takes.
        std::thread([&] {
            std::string path;
            if (server->admits(client, request, &path)) {
                server->serve(client, request, path);
            }
        }).join();
        return 200;
    };
    callbacks.log_message = [](const mg_connection *, const char *) { return 1; };
    self.server = self.token.empty() ? nullptr : mg_start(&callbacks, &self, options);
    mg_server_port ports[1];
    if (self.server == nullptr || mg_get_server_ports(self.server, 1, ports) != 1) {
        *error = settings.port != 0 ? "port " + std::to_string(settings.port) +
                                          " is in use (leave out --port: any free one is taken)"
                                    : "cannot listen on 127.0.0.1";
        return false;
    }
    self.host = "127.0.0.1:" + std::to_string(ports[0].port);
    self.address = "http://" + self.host + "/" + self.token + "/";
    return true;
}
