// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/calibrate_views.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <mutex>
#include <tuple>

#include "calib/base/coded_layout.hpp"
#include "calib/base/pair_order.hpp"
#include "calib/detect/detect.hpp"
#include "core/invariant.h"

namespace {

/// What is kept of one picture once its pixels are freed.
struct looked_at {
    bool read = false;
    int width_px = 0, height_px = 0, orientation = 0;
    uint64_t fingerprint = 0;
    calib::board_view view;
    std::string reason;
};

std::string base_name(const std::string &path) {
    const size_t slash = path.rfind('/');
    return slash == std::string::npos ? path : path.substr(slash + 1);
}

std::string size_text(int width_px, int height_px) {
    return std::to_string(width_px) + "x" + std::to_string(height_px);
}

/// Detects duplicates: equal pixels have equal fingerprints.
uint64_t fingerprint_of(const std::vector<uint8_t> &grey) {
    uint64_t sum = 14695981039346656037u;  // FNV-1a
    for (const uint8_t byte : grey) {
        sum = (sum ^ byte) * 1099511628211u;
    }
    return sum;
}

/// The part of a message about a picture after the picture's name.
std::string without_name(const std::string &text, const std::string &path) {
    const bool named = text.compare(0, path.size(), path) == 0;
    const size_t at = named ? text.find_first_not_of(": ", path.size()) : 0;
    return at == std::string::npos ? text : text.substr(at);
}

/// Corners of a shrunk picture, in its full size. Pixel centres: x' = (x + 1/2) k - 1/2.
void enlarge(int factor, calib::board_view *view) {
    for (calib::corner &corner : view->corners) {
        corner.x_px = (corner.x_px + 0.5) * factor - 0.5;
        corner.y_px = (corner.y_px + 0.5) * factor - 0.5;
        corner.sigma_px *= factor;
    }
}

class finder {
  public:
    finder(const std::vector<calibrate_shot> &shots, const calibrate_views_request &request)
        : shots_(shots), request_(request), cameras_(request.single ? 1 : 2) {
        pictures_.resize(2 * shots.size());
        for (size_t i = 0; i < pictures_.size(); i++) {
            if (!path(i).empty() && static_cast<int>(i % 2) < cameras_) {
                named_.push_back(i);
            }
        }
        for (const calib::cached_view &one : request.cache) {
            cached_.emplace(one.filename, &one.view);
            const bool first = cached_by_base_.emplace(base_name(one.filename), &one.view).second;
            if (!first) {
                cached_by_base_[base_name(one.filename)] = nullptr;  // ambiguous
            }
        }
    }

    calibrate_views run() {
        const parallel &threads = *request_.threads;
        threads.run(
            threads.self,
            [](void *self, int index) { static_cast<finder *>(self)->look(size_t(index)); }, this,
            static_cast<int>(named_.size()));
        refuse_other_sizes();
        refuse_parts_of_another_board();
        refuse_doubles();
        settle_layouts();
        decide_orders();
        return report();
    }

  private:
    const std::string &path(size_t i) const { return shots_[i / 2].path[i % 2]; }

    /// The cache entry under the picture's name, under the end of its path, or under the same name
    /// in another folder.
    const calib::board_view *cached_view(const std::string &name) const {
        for (size_t at = 0; at != std::string::npos;) {
            const auto found = cached_.find(name.substr(at));
            if (found != cached_.end()) {
                return found->second;
            }
            const size_t slash = name.find('/', at);
            at = slash == std::string::npos ? slash : slash + 1;
        }
        const auto base = cached_by_base_.find(base_name(name));
        return base != cached_by_base_.end() ? base->second : nullptr;
    }

    /// Length of the folder prefix common to all names.
    size_t common_folder() const {
        const std::string &first = path(named_[0]);
        size_t length = first.rfind('/');
        length = length == std::string::npos ? 0 : length + 1;
        for (const size_t i : named_) {
            while (length > 0 && path(i).compare(0, length, first, 0, length) != 0) {
                const size_t slash = length < 2 ? std::string::npos : first.rfind('/', length - 2);
                length = slash == std::string::npos ? 0 : slash + 1;
            }
        }
        return length;
    }

    void look(size_t index) {
        if (request_.cancelled && request_.cancelled()) {
            return;
        }
        const size_t i = named_[index];
        looked_at *picture = &pictures_[i];
        calibrate_image image;
        if (shots_[i / 2].missing[i % 2]) {
            look_at_cache(i, picture);
        } else if (!calibrate_image_read(path(i), shots_[i / 2].mosaic, &image, &picture->reason)) {
            picture->reason = without_name(picture->reason, path(i));
        } else {
            picture->read = true;
            picture->width_px = image.file_width_px;
            picture->height_px = image.file_height_px;
            picture->orientation = std::max(image.orientation, 1);
            picture->fingerprint = fingerprint_of(image.grey);
            find_corners(path(i), &image, picture);
        }
        const std::lock_guard<std::mutex> alone(mutex_);
        done_++;
        if (request_.progress) {
            request_.progress(done_, static_cast<int>(named_.size()));
        }
    }

    /// A frame without a file, of a session: its corners may be known.
    void look_at_cache(size_t i, looked_at *picture) const {
        const calib::board_view *cached = cached_view(path(i));
        if (cached == nullptr) {
            picture->reason = "missing, and its corners are not known";
            return;
        }
        picture->read = true;
        picture->width_px = shots_[i / 2].state->width_px[i % 2];
        picture->height_px = shots_[i / 2].state->height_px[i % 2];
        picture->orientation = 1;
        const std::string &name = path(i);  // states the CRC of the contents
        picture->fingerprint = fingerprint_of({name.begin(), name.end()});
        picture->view = *cached;
        picture->reason = cached->rejection;
    }

    void find_corners(const std::string &name, calibrate_image *image, looked_at *picture) const {
        const calib::board_view *cached = cached_view(name);
        if (cached != nullptr) {
            picture->view = *cached;
        } else {
            const image_u8 grey = {image->grey.data(), image->width_px, image->height_px,
                                   image->width_px};
            picture->view = calib::detect_board(request_.board, grey, {});
            enlarge(image->shrink, &picture->view);
        }
        picture->reason = picture->view.rejection;
    }

    void refuse(size_t i, const std::string &reason) {
        pictures_[i].view = {};
        pictures_[i].reason = reason;
    }

    /// All pictures of a camera have one size and one orientation: those of the majority.
    void refuse_other_sizes() {
        for (int camera = 0; camera < cameras_; camera++) {
            std::map<std::tuple<int, int, int>, int> count;
            for (const size_t i : named_) {
                const looked_at &one = pictures_[i];
                if (static_cast<int>(i % 2) == camera && one.read) {
                    count[{one.width_px, one.height_px, one.orientation}]++;
                }
            }
            if (count.empty()) {
                continue;
            }
            const auto max =
                std::max_element(count.begin(), count.end(),
                                 [](const auto &a, const auto &b) { return a.second < b.second; });
            const auto [width_px, height_px, orientation] = max->first;
            width_px_[camera] = width_px;
            height_px_[camera] = height_px;
            for (const size_t i : named_) {
                const looked_at &one = pictures_[i];
                if (static_cast<int>(i % 2) != camera || !one.read) {
                    continue;
                }
                if (one.orientation != orientation) {
                    refuse(i, "other orientation (EXIF orientation " +
                                  std::to_string(one.orientation) +
                                  ") than most pictures of its camera (" +
                                  std::to_string(orientation) +
                                  "): calibrate a camera in one orientation");
                } else if (one.width_px != width_px || one.height_px != height_px) {
                    refuse(i, size_text(one.width_px, one.height_px) +
                                  " pixels; most pictures of its camera have " +
                                  size_text(width_px, height_px));
                }
            }
        }
    }

    /// If most pictures show a board of one other size, a board of the requested size is part of
    /// that one, cut off or half hidden.
    void refuse_parts_of_another_board() {
        std::map<std::pair<int, int>, int> others;
        int asked_for = 0;
        for (const size_t i : named_) {
            std::pair<int, int> size;
            if (calibrate_rejection_size(pictures_[i].reason, &size.first, &size.second)) {
                others[size]++;
            }
            asked_for += !pictures_[i].view.corners.empty();
        }
        for (const auto &[size, count] : others) {
            for (const size_t i : named_) {
                if (count > asked_for && !pictures_[i].view.corners.empty()) {
                    refuse(i, "probably only a part of the board of " + std::to_string(size.first) +
                                  " x " + std::to_string(size.second) +
                                  " corners that most pictures show");
                }
            }
        }
    }

    /// Counting a picture twice would make the error bars too small.
    void refuse_doubles() {
        std::map<std::tuple<uint64_t, int, int>, size_t> known;
        for (const size_t i : named_) {
            const looked_at &one = pictures_[i];
            if (one.view.corners.empty()) {
                continue;
            }
            const auto [first, is_new] =
                known.emplace(std::tuple(one.fingerprint, one.width_px, one.height_px), i);
            if (!is_new && first->second == i - 1 && i % 2 == 1) {
                refuse(i, "left and right are the same picture");
            } else if (!is_new) {
                refuse(i, "the same picture as " + path(first->second).substr(common_folder()));
            }
        }
    }

    void settle_layouts() {
        std::vector<calib::board_view *> views;
        for (looked_at &one : pictures_) {
            views.push_back(&one.view);
        }
        calib::settle_layouts(request_.board, views);
    }

    /// Boards with rotational symmetry: all pairs together decide where each view begins.
    void decide_orders() {
        std::vector<calib::board_view> side[2];
        for (size_t i = 0; i < pictures_.size(); i++) {
            side[i % 2].push_back(pictures_[i].view);
        }
        if (cameras_ == 1) {
            return;
        }
        const std::vector<calib::pair_turn> turns =
            calib::pair_order(request_.board, side[0], side[1]);
        INVARIANT(turns.size() == shots_.size());
        for (size_t shot = 0; shot < shots_.size(); shot++) {
            const size_t right = 2 * shot + 1;
            if (!turns[shot].decided) {
                refuse(right,
                       "ambiguous corner numbering: this board looks "
                       "the same after a rotation");
            } else if (turns[shot].quarters != 0) {
                pictures_[right].view =
                    calib::turned_view(request_.board, pictures_[right].view, turns[shot].quarters);
            }
        }
    }

    calibrate_views report() const {
        calibrate_views result;
        result.seen.target = request_.board;
        result.seen.cameras = cameras_;
        for (size_t camera = 0; camera < 2; camera++) {
            result.seen.width_px[camera] = width_px_[camera];
            result.seen.height_px[camera] = height_px_[camera];
        }
        result.pictures = static_cast<int>(named_.size());
        const size_t folder = common_folder();
        for (size_t shot = 0; shot < shots_.size(); shot++) {
            calib::capture capture;
            for (size_t camera = 0; camera < static_cast<size_t>(cameras_); camera++) {
                const looked_at &one = pictures_[2 * shot + camera];
                const std::string &name = shots_[shot].path[camera];
                capture.name[camera] = name.empty() ? name : name.substr(folder);
                capture.view[camera] = one.view;
                result.boards += !one.view.corners.empty();
                if (!one.reason.empty()) {
                    capture.view[camera].rejection = one.reason;
                    result.rejections.push_back({shot, static_cast<int>(camera), one.reason});
                }
            }
            result.pairs += !capture.view[0].corners.empty() && !capture.view[1].corners.empty();
            result.seen.captures.push_back(capture);
        }
        return result;
    }

    const std::vector<calibrate_shot> &shots_;
    const calibrate_views_request &request_;
    int cameras_;
    std::vector<looked_at> pictures_;  // two per shot, left first
    std::vector<size_t> named_;        // indices in `pictures_` of the existing ones
    std::map<std::string, const calib::board_view *> cached_, cached_by_base_;
    int width_px_[2] = {0, 0}, height_px_[2] = {0, 0};
    std::mutex mutex_;
    int done_ = 0;
};

}  // namespace

calibrate_views calibrate_views_find(const std::vector<calibrate_shot> &shots,
                                     const calibrate_views_request &request) {
    INVARIANT(request.threads != nullptr && !shots.empty());
    return finder(shots, request).run();
}

namespace {

const char *const is_it_the_board = "does --board count inner corners, and is it the right board?";
const char *const are_markers_right =
    "is --marker the side of a marker including its black border, and --charuco its dictionary?";
const char *const whole_in_both =
    "both must see the whole board (a coded one in part) at the same time";
const char *const whole_board = "the whole plain board must be visible";
const char *const no_mirror = "switch mirroring off (webcam previews do it) and take them again";

/// The hint for a reason that contains these words.
struct advice {
    const char *words;
    const char *no_board;  // hint if no picture shows a board
    const char *no_pair;   // hint if boards were found, but by one camera at a time
};

const advice table[] = {
    {" corners, not ", is_it_the_board, is_it_the_board},
    {"do not fit a coded board", is_it_the_board, is_it_the_board},
    {"too few readable markers", are_markers_right, are_markers_right},
    {"not of dictionary", are_markers_right, are_markers_right},
    {"read backwards", no_mirror, no_mirror},
    {"left and right are the same", "", "name the pictures of both cameras, or give --single"},
    {"no board found: ", "", ""},  // followed by what is wrong
    {"no board found", is_it_the_board, whole_in_both},
    {"is cut off", whole_board, whole_in_both},
    {" corners visible", whole_board, whole_in_both},
};

std::string advice_for(const std::string &reason, bool no_board) {
    if (reason.empty()) {
        return whole_in_both;
    }
    for (const advice &one : table) {
        if (reason.find(one.words) != std::string::npos) {
            return no_board ? one.no_board : one.no_pair;
        }
    }
    return "";
}

/// Reasons that differ only in a name are merged.
std::string without_names(const std::string &reason) {
    const std::string same = "the same picture as ";
    return reason.compare(0, same.size(), same) == 0 ? same + "another one" : reason;
}

/// The reason for which most pictures were rejected, and how many; 0 when none was rejected.
std::pair<std::string, int> commonest(const calibrate_views &views) {
    std::map<std::string, int> count;
    for (const calibrate_rejection &one : views.rejections) {
        count[without_names(one.reason)]++;
    }
    const auto max = std::max_element(count.begin(), count.end(), [](const auto &a, const auto &b) {
        return a.second < b.second;
    });
    return max == count.end() ? std::pair(std::string(), 0) : std::pair(max->first, max->second);
}

}  // namespace

std::string calibrate_rejection_text(const calibrate_views &views) {
    const bool no_board = views.boards == 0;
    if (!no_board && (views.seen.cameras == 1 || views.pairs > 0)) {
        return "";
    }
    const auto [reason, count] = commonest(views);
    std::string text = no_board ? "no picture shows a board of " +
                                      std::to_string(views.seen.target.columns) + " x " +
                                      std::to_string(views.seen.target.rows) + " corners"
                                : "no board was seen by both cameras at the same moment";
    if (count > 0) {
        text += ": " + reason + " (" + std::to_string(count) + " of " +
                std::to_string(views.pictures) + " pictures)";
    }
    const std::string help = advice_for(reason, no_board);
    return text + (help.empty() ? "" : "; " + help);
}

bool calibrate_rejection_size(const std::string &reason, int *columns, int *rows) {
    int length = 0;
    // As worded by the detector.
    return std::sscanf(reason.c_str(), "found %d x %d corners, not %n", columns, rows, &length) ==
               2 &&
           length > 0;
}
