// SPDX-License-Identifier: Apache-2.0
/// The live view's page and what it asks for, over HTTP on 127.0.0.1.
///
/// Everything is below /TOKEN/, which no other page or user knows; requests for another host or
/// from another page's origin are refused, too.
///
///   GET  /TOKEN/                the page
///   GET  /TOKEN/picture?after=N the first picture with a number beyond N, as JPEG; what is known
///   of
///                               it in the header X-Vergence. 204: none for now; 503 with a
///                               sentence
///   GET  /TOKEN/depth?after=N&near=MM&far=MM&refined=1    the same for depths: see view_depth.hpp
///   GET  /TOKEN/board?columns=N&rows=N&after=N  the board in the picture: see view_board.hpp
///   POST /TOKEN/calibrate       calibrates from views of it
///   POST /TOKEN/command         runs the line in the body: its answer, lines of JSON
///   POST /TOKEN/cancel          cancels what runs
///   POST /TOKEN/reconstruct     makes the surface of the session in the body: {"report": PATH}
///   GET  /TOKEN/file/NAME       a file of the instrument
///   GET  /TOKEN/out/NAME        the report of a surface
#ifndef VERGENCE_TOOLS_HOST_VIEW_VIEW_SERVER_HPP
#define VERGENCE_TOOLS_HOST_VIEW_VIEW_SERVER_HPP

#include <memory>
#include <string>

struct view_settings;
class view_source;

class view_server {
  public:
    view_server();
    ~view_server();
    view_server(const view_server &) = delete;
    view_server &operator=(const view_server &) = delete;

    /// Serves until it is destroyed. False with one sentence.
    bool start(view_source *source, const view_settings &settings, std::string *error);
    /// Of the page, with the token.
    const std::string &address() const;

  private:
    struct state;
    std::unique_ptr<state> state_;
};

/// The page. `facts`: JSON of the source, for its script.
std::string view_page_make(const std::string &title, const std::string &facts);

#endif
