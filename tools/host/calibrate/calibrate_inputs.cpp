// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/calibrate_inputs.hpp"

#include <dirent.h>
#include <glob.h>
#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <memory>

#include "core/error.h"
#include "daemon/files/input_file.h"
#include "daemon/session/session_pairs.h"
#include "tools/host/formats/image_formats.hpp"
#include "tools/host/formats/whole_file.hpp"

namespace {

const size_t list_limit_bytes = 4u << 20;
const char *const formats_read = "PNG, JPEG, PGM, TIFF";

std::string lower(std::string text) {
    for (char &c : text) {
        c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    return text;
}

/// In lower case, without the dot; "" without one.
std::string extension_of(const std::string &path) {
    const size_t slash = path.rfind('/'), dot = path.rfind('.');
    const bool has = dot != std::string::npos && (slash == std::string::npos || dot > slash);
    return has ? lower(path.substr(dot + 1)) : "";
}

bool has_word(const std::string &words, const std::string &word) {
    return !word.empty() && (" " + words + " ").find(" " + word + " ") != std::string::npos;
}

bool is_picture_name(const std::string &path) {
    const image_format_list formats = image_formats();
    const std::string extension = extension_of(path);
    return std::any_of(formats.first, formats.first + formats.count, [&](const image_format &one) {
        return has_word(one.extensions, extension);
    });
}

/// Picture formats that cannot be read. (A file without such a name is not a picture.)
bool is_foreign_picture_name(const std::string &path) {
    return has_word("bmp webp gif heic heif avif jp2 jxl exr dng cr2 cr3 nef arw raf rw2 orf",
                    extension_of(path));
}

bool is_list_name(const std::string &path) {
    return has_word("txt lst list xml yml yaml", extension_of(path));
}

std::string joined(const std::string &folder, const std::string &name) {
    if (folder.empty() || name.front() == '/') {
        return name;
    }
    return folder + (folder.back() == '/' ? "" : "/") + name;
}

/// Names in a folder, sorted, without hidden ones.
std::vector<std::string> names_in(const std::string &folder) {
    std::vector<std::string> names;
    DIR *stream = opendir(folder.c_str());
    if (stream == nullptr) {
        return names;
    }
    while (const dirent *entry = readdir(stream)) {
        if (entry->d_name[0] != '.') {
            names.emplace_back(entry->d_name);
        }
    }
    closedir(stream);
    std::sort(names.begin(), names.end());
    return names;
}

class expander {
  public:
    expander(bool frames_may_miss, calibrate_names *names, std::string *error)
        : frames_may_miss_(frames_may_miss), names_(names), error_(error) {}

    bool operand(const std::string &path) {
        struct stat status;
        const bool exists = stat(path.c_str(), &status) == 0;
        const int error_number = errno;
        if (exists && S_ISDIR(status.st_mode)) {
            return folder(path);
        }
        if (!exists && path.find_first_of("*?[") != std::string::npos) {
            return pattern(path);
        }
        const size_t colon = path.rfind(':');
        if (!exists && colon != std::string::npos &&
            session_pairs_here(path.substr(0, colon).c_str())) {
            return pair(path.substr(0, colon), path.substr(colon + 1));
        }
        if (!exists) {
            return fail(path + ": " + std::strerror(error_number));
        }
        if (is_list_name(path)) {
            return list(path);
        }
        add(path, false);
        group_++;
        return true;
    }

  private:
    bool fail(const std::string &text) {
        *error_ = text;
        return false;
    }

    void add(const std::string &path, bool spread) {
        names_->pictures.push_back({path, group_, spread});
    }

    /// Adds the pictures of one folder as a group; returns how many.
    size_t pictures_of(const std::string &path) {
        size_t count = 0;
        for (const std::string &name : names_in(path)) {
            const std::string file = joined(path, name);
            if (input_file_is_directory(file.c_str())) {
                continue;
            }
            if (is_picture_name(name)) {
                add(file, true);
                count++;
            } else if (is_foreign_picture_name(name)) {
                foreign_.push_back(file);
            }
        }
        group_ += count > 0;
        return count;
    }

    bool session(const std::string &path) {
        message last_error{};
        names_->sessions++;
        const auto add_shot = [](void *self, const session_pair_files *files) {
            calibrate_names *names = static_cast<calibrate_names *>(self);
            names->shots.push_back({{files->path[0], files->path[1]},
                                    files->mosaic,
                                    std::make_shared<calibration_match_state>(files->state),
                                    {files->missing[0], files->missing[1]},
                                    names->sessions,
                                    files->number,
                                    files->board_position,
                                    files->pan_visit,
                                    files->focused_on_board,
                                    files->corner_noise});
        };
        return session_pairs_read(path.c_str(), frames_may_miss_, add_shot, names_, &last_error) >
                   0 ||
               fail(last_error.text);
    }

    /// One pair of a session.
    bool pair(const std::string &path, const std::string &number) {
        const size_t before = names_->shots.size();
        if (!session(path)) {
            return false;
        }
        auto &shots = names_->shots;
        shots.erase(std::remove_if(shots.begin() + long(before), shots.end(),
                                   [&number](const calibrate_shot &shot) {
                                       return std::to_string(shot.number) != number;
                                   }),
                    shots.end());
        return shots.size() > before || fail(path + ": no pair " + number + " in this session");
    }

    bool folder(const std::string &path) {
        if (session_pairs_here(path.c_str())) {
            return session(path);
        }
        size_t count = pictures_of(path);
        for (const std::string &name : count > 0 ? std::vector<std::string>() : names_in(path)) {
            const std::string inner = joined(path, name);
            if (session_pairs_here(inner.c_str())) {
                if (!session(inner)) {
                    return false;
                }
                count++;
            } else {
                count += input_file_is_directory(inner.c_str()) ? pictures_of(inner) : 0;
            }
        }
        if (count == 0) {
            return fail(path + ": no pictures in the folder (" + formats_read + ")" +
                        (foreign_.empty() ? "" : "; " + foreign_text()));
        }
        if (!foreign_.empty()) {
            names_->notes.push_back(foreign_text());
            foreign_.clear();
        }
        return true;
    }

    /// What is reported about pictures in a folder that cannot be read.
    std::string foreign_text() const {
        const size_t more = foreign_.size() - 1;
        const std::string others = more > 0 ? " and " + std::to_string(more) + " more" : "";
        return foreign_[0] + others + (more > 0 ? " are" : " is") +
               " left out: unsupported format (supported: " + formats_read + ")";
    }

    bool pattern(const std::string &path) {
        glob_t found{};
        const int code = glob(path.c_str(), GLOB_BRACE, nullptr, &found);
        const std::unique_ptr<glob_t, void (*)(glob_t *)> owner(&found, globfree);
        if (code != 0 || found.gl_pathc == 0) {
            return fail(path + ": no such file");
        }
        for (size_t i = 0; i < found.gl_pathc; i++) {
            if (session_pairs_here(found.gl_pathv[i])) {
                if (!session(found.gl_pathv[i])) {
                    return false;
                }
            } else if (!input_file_is_directory(found.gl_pathv[i])) {
                add(found.gl_pathv[i], true);
            }
        }
        group_++;
        return true;
    }

    bool list(const std::string &path) {
        std::string text, why;
        if (whole_file_read(path, list_limit_bytes, "a list of pictures", &text, &why) !=
            ERROR_OK) {
            return fail(why);
        }
        const size_t slash = path.rfind('/');
        folder_ = slash == std::string::npos ? "" : path.substr(0, slash + 1);
        const size_t before = names_->pictures.size() + names_->shots.size();
        const std::string extension = extension_of(path);
        if (extension == "xml" || extension == "yml" || extension == "yaml") {
            storage_list(text);
        } else {
            text_list(text);
        }
        group_++;
        return names_->pictures.size() + names_->shots.size() > before ||
               fail(path + ": no pictures in the list");
    }

    /// Whether `c` ends a word that began with `quote` (0: without one).
    static bool ends_word(char c, char quote) {
        return quote != 0 ? c == quote : std::strchr(" \t\r\n,[]<>\"'", c) != nullptr;
    }

    /// Words that name pictures, in quotes or between blanks and the delimiters of XML and YAML.
    std::vector<std::string> picture_words(const std::string &text) const {
        std::vector<std::string> words;
        std::string word;
        char quote = 0;
        bool in_tag = false;
        const auto end_word = [&] {
            if (is_picture_name(word)) {
                words.push_back(word);
            }
            word.clear();
        };
        for (const char c : text + " ") {
            const bool ends = ends_word(c, quote);
            if (in_tag || ends) {
                in_tag = quote == 0 && (in_tag ? c != '>' : c == '<');
                quote = !in_tag && ends && quote == 0 && (c == '"' || c == '\'') ? c : '\0';
                end_word();
            } else {
                word += c;
            }
        }
        return words;
    }

    void storage_list(const std::string &text) {
        for (const std::string &word : picture_words(text)) {
            add(joined(folder_, word), true);
        }
    }

    void text_list(const std::string &text) {
        for (size_t at = 0; at < text.size();) {
            const size_t end = std::min(text.find('\n', at), text.size());
            const std::string line = text.substr(at, end - at);
            at = end + 1;
            const size_t first = line.find_first_not_of(" \t\r");
            if (first == std::string::npos || line[first] == '#') {
                continue;
            }
            const std::vector<std::string> words = picture_words(line);
            if (words.size() == 2) {
                names_->shots.push_back(
                    {{joined(folder_, words[0]), joined(folder_, words[1])}, false, nullptr});
            } else if (words.size() == 1) {
                add(joined(folder_, words[0]), true);
            } else {
                names_->notes.push_back("the list's line \"" + line.substr(first, 60) +
                                        "\" is left out (expected one or two names of pictures)");
            }
        }
    }

    bool frames_may_miss_;
    calibrate_names *names_;
    std::string *error_;
    std::string folder_;                // folder that contains the list
    std::vector<std::string> foreign_;  // unreadable pictures in the folder
    size_t group_ = 0;
};

}  // namespace

bool calibrate_names_expand(const std::vector<std::string> &operands, bool frames_may_miss,
                            calibrate_names *names, std::string *error) {
    expander expand(frames_may_miss, names, error);
    return std::all_of(operands.begin(), operands.end(),
                       [&](const std::string &one) { return expand.operand(one); });
}
