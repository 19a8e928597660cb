// SPDX-License-Identifier: Apache-2.0
#include "calib/base/corner_cache.hpp"

#include <algorithm>
#include <cmath>
#include <istream>
#include <limits>
#include <locale>
#include <ostream>
#include <sstream>

#include "core/invariant.h"

namespace calib {

namespace {

constexpr double foreign_sigma_px = 0.1;  // level 0 of a file that states none
constexpr double highest_level = 30;      // mrcal shifts 1 by this many bits
// No detector is outside this range; weights far outside it make the solution worthless.
constexpr double smallest_sigma_px = 1e-6, largest_sigma_px = 1e3;
const char overexposed_comment[] = "## overexposed white squares, and their share:";
const char white_first_comment[] = "## layout of OpenCV before 4.6, white first:";
const char layout_open_comment[] = "## layout not seen in this view:";
const char sigma_comment[] = "## a corner of level 0 has a standard deviation of";

bool can_be_named(const std::string &name) {
    return !name.empty() && name[0] != '#' && name.find_first_of(" \t\r\n") == std::string::npos;
}

double min_sigma_px(const std::vector<cached_view> &views) {
    double min = std::numeric_limits<double>::infinity();
    for (const cached_view &cached : views) {
        for (const corner &c : cached.view.corners) {
            min = c.sigma_px > 0 ? std::min(min, c.sigma_px) : min;
        }
    }
    return std::isfinite(min) ? min : foreign_sigma_px;
}

void write_view(std::ostream &out, const board &board, const cached_view &cached, double sigma_px) {
    if (cached.view.corners.empty()) {
        out << cached.filename << " - - -\n";
        return;
    }
    if (cached.view.clipped > 0) {
        out << overexposed_comment << ' ' << cached.filename << ' ' << cached.view.clipped << '\n';
    }
    if (cached.view.white_first) {
        out << white_first_comment << ' ' << cached.filename << '\n';
    }
    if (cached.view.layout_open) {
        out << layout_open_comment << ' ' << cached.filename << '\n';
    }
    auto next = cached.view.corners.begin();
    for (int index = 0; index < board.corner_count(); index++) {
        if (next == cached.view.corners.end() || next->index != index) {
            out << cached.filename << " - - -\n";
            continue;
        }
        const double level = next->sigma_px > 0 ? std::log2(next->sigma_px / sigma_px) : 0;
        out << cached.filename << ' ' << next->x_px << ' ' << next->y_px << ' '
            << std::clamp(level, 0.0, highest_level) << '\n';
        ++next;
    }
}

bool number_of(const std::string &word, double *value) {
    std::istringstream in(word);
    in.imbue(std::locale::classic());
    return static_cast<bool>(in >> *value) && in.peek() == std::char_traits<char>::eof() &&
           std::isfinite(*value);
}

bool is_plausible(double sigma_px) {
    return sigma_px >= smallest_sigma_px && sigma_px <= largest_sigma_px;
}

// Whether `text` begins with `begin`; `*words` receives the rest.
bool begins(const std::string &text, const std::string &begin, std::istringstream *words) {
    const bool does = text.compare(0, begin.size(), begin) == 0;
    words->str(does ? text.substr(begin.size()) : "");
    return does;
}

class reader {
  public:
    reader(const board &board, std::string *error) : board_(board), error_(error) {}

    bool line(const std::string &text) {
        line_++;
        const size_t start = text.find_first_not_of(" \t\r");
        if (start == std::string::npos) {
            return true;
        }
        return text[start] == '#' ? comment(text.substr(start)) : data(text);
    }

    bool finish() {
        INVARIANT(lines_of_image_ <= board_.corner_count());
        if (lines_of_image_ > 1 && lines_of_image_ != board_.corner_count()) {
            return fail("'" + views_.back().filename + "' has " + std::to_string(lines_of_image_) +
                        " corners, the board has " + std::to_string(board_.corner_count()));
        }
        if (!views_.empty() && views_.back().view.corners.empty()) {
            views_.back().view.rejection = "no board found (from the corner cache)";
        }
        return true;
    }

    std::vector<cached_view> views() { return std::move(views_); }

  private:
    bool fail(const std::string &what) {
        *error_ = "line " + std::to_string(line_) + ": " + what;
        return false;
    }

    bool comment(const std::string &text) {
        std::istringstream words;
        if (begins(text, sigma_comment, &words)) {
            std::string word;
            words >> word;
            if (!number_of(word, &sigma_px_) || !is_plausible(sigma_px_)) {
                return fail("the standard deviation must be from 0.000001 to 1000 px");
            }
        } else if (begins(text, overexposed_comment, &words)) {
            std::string share;
            words >> clipped_name_ >> share;
            if (!number_of(share, &clipped_) || clipped_ < 0 || clipped_ > 1) {
                return fail("the share is not a number from 0 to 1");
            }
        } else if (begins(text, white_first_comment, &words)) {
            words >> white_first_name_;
        } else if (begins(text, layout_open_comment, &words)) {
            words >> layout_open_name_;
        } else if (text.compare(0, 2, "##") != 0 && !legend_seen_) {
            legend_seen_ = true;
            return legend(text.substr(1));
        }
        return true;
    }

    bool legend(const std::string &text) {
        std::istringstream words(text);
        std::string names[4];
        words >> names[0] >> names[1] >> names[2] >> names[3];
        weights_ = names[3] == "weight";
        if (names[0] != "filename" || names[1] != "x" || names[2] != "y") {
            return fail("unknown columns (expected 'filename x y level')");
        }
        return true;
    }

    bool data(const std::string &text) {
        std::istringstream words(text);
        std::string name, x, y, level, more;
        words >> name >> x >> y >> level >> more;
        if (y.empty() || !more.empty()) {
            return fail("expected 'filename x y level'");
        }
        if (!select_image(name)) {
            return false;
        }
        if (lines_of_image_ >= board_.corner_count()) {
            return fail("'" + name + "' has more corners than the board");
        }
        const int index = lines_of_image_++;
        return x == "-" || y == "-" || level == "-" || found_corner(index, x, y, level);
    }

    /// Makes `name` the last of the views; false when the one before is incomplete.
    bool select_image(const std::string &name) {
        if (!views_.empty() && views_.back().filename == name) {
            return true;
        }
        if (!finish()) {
            return false;
        }
        views_.push_back({name, {}});
        views_.back().view.clipped = name == clipped_name_ ? clipped_ : 0;
        views_.back().view.white_first = name == white_first_name_;
        views_.back().view.layout_open = name == layout_open_name_;
        lines_of_image_ = 0;
        return true;
    }

    /// Standard deviation for a value of the fourth column.
    double sigma_of(double size) const {
        INVARIANT(is_plausible(sigma_px_) && (size > 0 || !weights_));
        return sigma_px_ * (weights_ ? 1 / size : std::exp2(std::min(size, highest_level)));
    }

    bool found_corner(int index, const std::string &x, const std::string &y,
                      const std::string &level) {
        corner next;
        next.index = index;
        double size = weights_ ? 1 : 0;
        if (!number_of(x, &next.x_px) || !number_of(y, &next.y_px) ||
            (!level.empty() && !number_of(level, &size))) {
            return fail("expected numbers or '-' after the name");
        }
        // mrcal and mrgingham also mark a missing corner like this.
        if (next.x_px < 0 || next.y_px < 0 || (weights_ ? size <= 0 : size < 0)) {
            return true;
        }
        next.sigma_px = sigma_of(size);
        if (!is_plausible(next.sigma_px) && weights_) {
            return fail("the weight means a standard deviation outside 0.000001 to 1000 px");
        }
        views_.back().view.corners.push_back(next);
        return true;
    }

    const board &board_;
    std::string *error_;
    int line_ = 0, lines_of_image_ = 0;
    double sigma_px_ = foreign_sigma_px;
    std::string clipped_name_;  // the next view is overexposed
    double clipped_ = 0;
    std::string white_first_name_, layout_open_name_;  // image of the next view if it has that flag
    bool legend_seen_ = false, weights_ = false;
    std::vector<cached_view> views_;
};

}  // namespace

bool corner_cache_write(std::ostream &out, const board &board,
                        const std::vector<cached_view> &views, std::string *error) {
    for (const cached_view &cached : views) {
        if (!can_be_named(cached.filename)) {
            *error = "'" + cached.filename +
                     "' cannot be written to a corner cache (no white space " +
                     "and no leading # allowed)";
            return false;
        }
    }
    std::ostringstream text;
    text.imbue(std::locale::classic());
    const double sigma_px = min_sigma_px(views);
    INVARIANT(sigma_px > 0);
    text.precision(9);
    text << sigma_comment << ' ' << sigma_px << " px\n"
         << "# filename x y level\n"
         << std::fixed;
    text.precision(6);
    for (const cached_view &cached : views) {
        write_view(text, board, cached, sigma_px);
    }
    out << text.str();
    if (!out.flush()) {
        *error = "cannot write the corner cache";
        return false;
    }
    return true;
}

bool corner_cache_read(std::istream &in, const board &board, std::vector<cached_view> *views,
                       std::string *error) {
    reader from(board, error);
    std::string text;
    while (std::getline(in, text)) {
        if (!from.line(text)) {
            return false;
        }
    }
    if (!from.finish()) {
        return false;
    }
    *views = from.views();
    return true;
}

}  // namespace calib
