// SPDX-License-Identifier: Apache-2.0
/// What a view leaves behind: surfaces of captured pairs with their reports, and fetched files.
#ifndef VERGENCE_TOOLS_HOST_VIEW_VIEW_RESULTS_HPP
#define VERGENCE_TOOLS_HOST_VIEW_VIEW_RESULTS_HPP

#include <string>
#include <vector>

class view_source;

struct view_settings {
    std::string title;        ///< of the page
    int port = 0;             ///< 0: any
    std::string out;          ///< directory of what is fetched and made; created when needed
    std::string calibration;  ///< for surfaces; "": that of the session
    double near_mm = 0, far_mm = 0;
};

/// Creates the directory for results and its missing parents. False with one sentence.
bool view_results_make_folder(const std::string &path, std::string *error);

/// Makes the surface of a session of an instrument, or of the pair of this number of a recorded
/// one, by `vergence reconstruct`. Returns the answer for the page: JSON with the path of the
/// report, or an error.
std::string view_surface_make(view_source *source, const view_settings &settings,
                              const std::string &session);

/// Fetches a session of the instrument into the directory for results. Returns its path, or "" with
/// one sentence.
std::string view_result_fetch(view_source *source, const view_settings &settings,
                              const std::string &name, std::string *error);

/// Runs this program with the words after the first. Returns its exit code; `*command` is the line,
/// and `*said` the last line that it printed.
int view_result_run(std::vector<std::string> words, std::string *command, std::string *said);

struct view_result {
    std::string content;
    const char *type = "";
    bool ours = false;  ///< made by this program, scripts included
};

/// Reads "out/NAME", the report of a surface or a calibration, or "file/NAME", a file of the
/// instrument. False with one sentence.
bool view_result_read(view_source *source, const view_settings &settings, const std::string &path,
                      view_result *result, std::string *error);

#endif
