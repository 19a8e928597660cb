// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <map>
#include <set>

#include "tools/host/calibrate/calibrate_inputs.hpp"
#include "tools/host/calibrate/calibrate_views.hpp"

namespace {

enum { LEFT, RIGHT, UNKNOWN };

struct named {
    std::string path, key;
    int side = UNKNOWN;
    size_t group = 0;
    bool spread_group = false;
};

bool is_letter(const std::string &text, size_t at) {
    return at < text.size() && std::isalpha(static_cast<unsigned char>(text[at])) != 0;
}

bool is_lower(const std::string &text, size_t at) {
    return at < text.size() && std::islower(static_cast<unsigned char>(text[at])) != 0;
}

bool is_digit(char c) {
    return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

/// Whether a single letter at `at` means a side: "L_12", "12-r", "aloeL".
bool stands_alone(const std::string &text, size_t at) {
    const bool before =
        at == 0 || !is_letter(text, at - 1) || (!is_lower(text, at) && is_lower(text, at - 1));
    return before && !is_letter(text, at + 1);
}

/// The side that a name states; removed from `*text`.
int take_side(std::string *text) {
    std::string small = *text;
    std::transform(small.begin(), small.end(), small.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    for (const int side : {LEFT, RIGHT}) {
        const std::string word = side_name[side];
        const size_t at = small.rfind(word);
        if (at != std::string::npos) {
            text->replace(at, word.size(), "*");
            return side;
        }
    }
    for (size_t i = small.size(); i-- > 0;) {
        if ((small[i] == 'l' || small[i] == 'r') && stands_alone(*text, i)) {
            const int side = small[i] == 'l' ? LEFT : RIGHT;
            text->replace(i, 1, "*");
            return side;
        }
    }
    return UNKNOWN;
}

struct split_path {
    std::string folder, stem;
};

split_path split(const std::string &path) {
    const size_t slash = path.rfind('/');
    const std::string name = slash == std::string::npos ? path : path.substr(slash + 1);
    return {slash == std::string::npos ? "" : path.substr(0, slash),
            name.substr(0, name.rfind('.'))};
}

/// Side and key of a picture from its own name or that of its folder.
named look_at(const calibrate_picture &picture) {
    named result;
    result.path = picture.path;
    result.group = picture.group;
    result.spread_group = picture.spread_group;
    split_path parts = split(picture.path);
    result.side = take_side(&parts.stem);
    if (result.side == UNKNOWN) {
        const size_t slash = parts.folder.rfind('/');
        const size_t begin = slash == std::string::npos ? 0 : slash + 1;
        std::string last = parts.folder.substr(begin);
        result.side = take_side(&last);
        parts.folder.replace(begin, std::string::npos, last);
    }
    result.key = parts.folder + "/" + parts.stem;
    return result;
}

/// The last number of a name, without leading zeros; "" when it has none.
std::string number_of(const std::string &key) {
    size_t end = key.size();
    while (end > 0 && !is_digit(key[end - 1])) {
        end--;
    }
    size_t begin = end;
    while (begin > 0 && is_digit(key[begin - 1])) {
        begin--;
    }
    while (begin + 1 < end && key[begin] == '0') {
        begin++;
    }
    return key.substr(begin, end - begin);
}

/// Where the digits of `text` that begin at `at` end.
size_t end_of_digits(const std::string &text, size_t at) {
    while (at < text.size() && is_digit(text[at])) {
        at++;
    }
    return at;
}

/// Numbers in names are compared as numbers: 2 comes before 10.
bool is_before(const std::string &a, const std::string &b) {
    size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        if (!is_digit(a[i]) || !is_digit(b[j])) {
            if (a[i] != b[j]) {
                return a[i] < b[j];
            }
            i++, j++;
            continue;
        }
        const size_t m = end_of_digits(a, i), n = end_of_digits(b, j);
        const std::string x = number_of(a.substr(i, m - i)), y = number_of(b.substr(j, n - j));
        if (x != y) {
            return x.size() != y.size() ? x.size() < y.size() : x < y;
        }
        i = m, j = n;
    }
    return a.size() - i != b.size() - j ? a.size() - i < b.size() - j : a < b;
}

/// The real file behind a name, to detect a picture that is named twice.
std::string real_name(const std::string &path) {
    char *real = realpath(path.c_str(), nullptr);
    const std::string name = real != nullptr ? real : path;
    std::free(real);
    return name;
}

class pairing {
  public:
    pairing(const calibrate_names &names, calibrate_inputs *inputs)
        : names_(names), inputs_(inputs) {
        inputs_->notes = names.notes;
    }

    void single() {
        take_pictures();
        for (const calibrate_shot &shot : names_.shots) {
            inputs_->shots.push_back({{shot.path[LEFT], ""}, shot.mosaic});
        }
        for (const named &one : pictures_) {
            inputs_->shots.push_back({{one.path, ""}});
        }
        sort();
    }

    bool pair(std::string *error) {
        take_pictures();
        inputs_->shots = names_.shots;
        decide_sides();
        if (!pictures_.empty() && !check_sides(error)) {
            return false;
        }
        if (!pictures_.empty() && !match(error)) {
            return false;
        }
        sort();
        return true;
    }

  private:
    void take_pictures() {
        std::set<std::string> known;
        std::vector<std::string> twice;
        for (const calibrate_picture &picture : names_.pictures) {
            if (known.insert(real_name(picture.path)).second) {
                pictures_.push_back(look_at(picture));
            } else {
                twice.push_back(picture.path);
            }
        }
        note(twice, "is named twice and counts once", "are named twice and count once");
    }

    void note(const std::vector<std::string> &paths, const char *one, const char *many) {
        if (paths.empty()) {
            return;
        }
        const size_t shown = std::min<size_t>(paths.size(), 4);
        std::string text;
        for (size_t i = 0; i < shown; i++) {
            text += (i == 0 ? "" : ", ") + paths[i];
        }
        if (paths.size() > shown) {
            text += " and " + std::to_string(paths.size() - shown) + " more";
        }
        inputs_->notes.push_back(text + " " + (paths.size() == 1 ? one : many));
    }

    /// Names without a side: two folders or patterns are left and right in this order, and OpenCV's
    /// lists alternate.
    void decide_sides() {
        const bool named_all = std::none_of(pictures_.begin(), pictures_.end(),
                                            [](const named &one) { return one.side == UNKNOWN; });
        if (named_all || pictures_.empty()) {
            return;
        }
        std::vector<size_t> groups;
        for (const named &one : pictures_) {
            if (std::find(groups.begin(), groups.end(), one.group) == groups.end()) {
                groups.push_back(one.group);
            }
        }
        const bool spread = std::all_of(pictures_.begin(), pictures_.end(),
                                        [](const named &one) { return one.spread_group; });
        if (groups.size() == 2 && spread) {
            for (named &one : pictures_) {
                one.side = one.group == groups[0] ? LEFT : RIGHT;
                one.key = split(one.path).stem;
            }
        } else if (pictures_.size() == 2) {
            pictures_[0].side = LEFT;
            pictures_[1].side = RIGHT;
        }
    }

    bool check_sides(std::string *error) {
        size_t count[3] = {0, 0, 0};
        std::vector<std::string> unknown;
        for (const named &one : pictures_) {
            count[one.side]++;
            if (one.side == UNKNOWN) {
                unknown.push_back(one.path);
            }
        }
        if (!unknown.empty() && (count[LEFT] == 0 || count[RIGHT] == 0)) {
            *error = unknown[0] +
                     ": unknown camera: use names with left and right (or L and R), folders "
                     "left/ and right/, or two folders or quoted patterns, the left camera's first";
            return false;
        }
        note(unknown, "is left out: its name states no side",
             "are left out: their names state no side");
        pictures_.erase(std::remove_if(pictures_.begin(), pictures_.end(),
                                       [](const named &one) { return one.side == UNKNOWN; }),
                        pictures_.end());
        for (const int side : {LEFT, RIGHT}) {
            if (count[side] == 0 && inputs_->shots.empty()) {
                *error = "all " + std::to_string(pictures_.size()) + " pictures are of the " +
                         side_name[1 - side] + " camera: name those of the " + side_name[side] +
                         " one as well, or give --single to calibrate one camera alone";
                return false;
            }
        }
        return true;
    }

    using side_map = std::map<std::string, const named *>;

    /// Number of keys on both sides. Keys that occur twice on one side cannot be used.
    static size_t common(const side_map sides[2]) {
        return static_cast<size_t>(
            std::count_if(sides[LEFT].begin(), sides[LEFT].end(),
                          [&](const auto &entry) { return sides[RIGHT].count(entry.first) > 0; }));
    }

    bool fill(side_map sides[2], std::string (*key_of)(const std::string &)) const {
        bool unique = true;
        for (const named &one : pictures_) {
            const std::string key = key_of(one.key);
            unique = unique && !key.empty() && sides[one.side].emplace(key, &one).second;
        }
        return unique;
    }

    bool match(std::string *error) {
        side_map by_name[2], by_number[2];
        const bool names_work =
            fill(by_name, [](const std::string &key) { return key; }) && common(by_name) > 0;
        // Names that differ in more than the side may still have the same number.
        const bool numbers_work =
            fill(by_number, number_of) && common(by_number) > (names_work ? common(by_name) : 0);
        if (!names_work && !numbers_work) {
            *error = "no picture of the left camera has a partner: " + pictures_.front().path +
                     " and the other camera's pictures have no name or number in common (as "
                     "left01.png and right01.png have)";
            return false;
        }
        side_map *sides = numbers_work ? by_number : by_name;
        for (const auto &[key, left] : sides[LEFT]) {
            const auto right = sides[RIGHT].find(key);
            const bool has = right != sides[RIGHT].end();
            inputs_->shots.push_back({{left->path, has ? right->second->path : ""}});
        }
        for (const auto &[key, right] : sides[RIGHT]) {
            if (sides[LEFT].count(key) == 0) {
                inputs_->shots.push_back({{"", right->path}});
            }
        }
        record_alone();
        return true;
    }

    void record_alone() {
        for (const int side : {LEFT, RIGHT}) {
            std::vector<std::string> alone;
            for (const calibrate_shot &shot : inputs_->shots) {
                if (shot.path[static_cast<size_t>(1 - side)].empty()) {
                    alone.push_back(shot.path[static_cast<size_t>(side)]);
                }
            }
            const std::string rest = std::string(side_name[1 - side]) + " partner; ";
            const std::string one = "has no " + rest + "it is used for its own camera only";
            const std::string many = "have no " + rest + "they are used for their own camera only";
            note(alone, one.c_str(), many.c_str());
        }
    }

    void sort() {
        std::stable_sort(inputs_->shots.begin(), inputs_->shots.end(),
                         [](const calibrate_shot &a, const calibrate_shot &b) {
                             const auto first = [](const calibrate_shot &shot) {
                                 std::string stem = shot.path[shot.path[LEFT].empty()];
                                 take_side(&stem);
                                 return stem;
                             };
                             return is_before(first(a), first(b));
                         });
    }

    const calibrate_names &names_;
    calibrate_inputs *inputs_;
    std::vector<named> pictures_;
};

}  // namespace

bool calibrate_names_pair(const calibrate_names &names, bool single, calibrate_inputs *inputs,
                          std::string *error) {
    pairing pair(names, inputs);
    if (single) {
        pair.single();
        return true;
    }
    return pair.pair(error);
}
