// SPDX-License-Identifier: Apache-2.0
/// Recorded sessions: what made them, and how each pair was taken.
#include <fcntl.h>

#include <cstdio>
#include <memory>
#include <vector>

#include "console/pair/calibration_match.h"
#include "core/error.h"
#include "daemon/session/capture_info.h"
#include "daemon/session/session_notes.h"
#include "daemon/session/session_pairs.h"
#include "tools/host/formats/json_of.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/info/info.hpp"

namespace {

using document = nlohmann::ordered_json;

const char *const side_names[RIG_SIDES] = {"left", "right"};
const char *const axis_names[LENS_AXES] = {"zoom", "focus", "iris"};

/// A session being read. Large, therefore allocated.
struct reading {
    session_reader reader{};
    session_pairs pairs{};
    session_event begin{};
    calibration_match_state state{};  // state of the current pair
    message last_error{};

    reading() { reader.directory = -1; }
    reading(const reading &) = delete;
    reading &operator=(const reading &) = delete;
    ~reading() { session_reader_close(&reader); }
};

/// Statistics of a frame's picture: from the session, or else from its pixels.
bool read_picture(reading *self, int side, picture_stats *found) {
    pair_frame frame = self->pairs.pair.pair.frame[side];
    if (session_reader_load(&self->reader, &frame.image, self->pairs.pair.frame_crc[side],
                            &self->last_error) != ERROR_OK) {
        return false;
    }
    if (!frame.has_picture) {
        pair_frame_assess(&frame);
    }
    raw_image_release(&frame.image);
    *found = frame.picture;
    return true;
}

/// The servo's angle, if the session states which servo it was.
std::string angle_text(const reading &self, int side, double *angle_deg) {
    const calibration_axis &pan = self.state.origin.side[side].axis[CALIBRATION_PAN];
    if (pan.kind != CALIBRATION_AXIS_KNOWN) {
        return "";
    }
    *angle_deg = pan.mean;
    char text[32];
    std::snprintf(text, sizeof text, "%.2f deg, ", *angle_deg);
    return text;
}

/// "zoom 422", and where it was after the pair if that is another place.
std::string moved_text(const std::string &name, double before, double after) {
    return name + number_text(before, 6) +
           (after != before ? " to " + number_text(after, 6) : std::string());
}

void add_axes(const reading &self, int side, info_page *page, document *object) {
    const pair_frame &frame = self.pairs.pair.pair.frame[side];
    std::string text;
    const auto join = [&](const std::string &part) { text += (text.empty() ? "" : ", ") + part; };
    if (frame.before.pan_q4 != 0) {
        double angle_deg = 0;
        const std::string angle = angle_text(self, side, &angle_deg);
        join("pan " + angle +
             moved_text(angle.empty() ? "" : "pulse ", frame.before.pan_q4 / 16.0,
                        frame.after.pan_q4 / 16.0) +
             " us");
        (*object)["pan_deg"] = angle.empty() ? document() : document(angle_deg);
    }
    for (int axis = 0; axis < LENS_AXES; axis++) {
        if (frame.before.lens[axis].position_q4 != INT32_MIN) {
            join(moved_text(std::string(axis_names[axis]) + " ",
                            frame.before.lens[axis].position_q4 / 16.0,
                            frame.after.lens[axis].position_q4 / 16.0));
        }
    }
    page->add("", "", text.empty() ? "pan and lens: unknown or fixed" : text, document());
}

void add_exposure(const pair_frame &frame, info_page *page) {
    const std::string exposure =
        frame.exposure_us != 0 ? number_text(frame.exposure_us, 10) + " us" : "not set";
    const std::string gain = frame.gain_q3 != 0 ? number_text(frame.gain_q3 / 8.0, 6) : "not set";
    std::string merged;
    for (int i = 0; i < frame.parts; i++) {
        const pair_part &part = frame.part[i];
        merged += (i == 0 ? ", merged from " : " + ") + std::to_string(part.frames) + " x " +
                  number_text(part.exposure_us, 10) + " us";
    }
    page->add("", "", "exposure " + exposure + ", gain " + gain + merged, document());
}

bool add_side(reading *self, int side, info_page *page, document *object) {
    static const char *const layouts[] = {"grey", "rgb", "grbg"};
    const pair_frame &frame = self->pairs.pair.pair.frame[side];
    picture_stats shown{};
    if (!read_picture(self, side, &shown)) {
        return false;
    }
    std::string text = std::to_string(frame.image.width_px) + " x " +
                       std::to_string(frame.image.height_px) + " px, " +
                       std::to_string(frame.image.bits) + " bit " + layouts[frame.image.layout];
    (*object)["size_px"] = {frame.image.width_px, frame.image.height_px};
    (*object)["bits"] = frame.image.bits;
    (*object)["layout"] = layouts[frame.image.layout];
    if (frame.window.skip != 0) {
        text += ", from " + std::to_string(frame.window.column_px) + "," +
                std::to_string(frame.window.row_px) + " of the sensor, skip " +
                std::to_string(frame.window.skip);
        (*object)["window"] = {{"column_px", frame.window.column_px},
                               {"row_px", frame.window.row_px},
                               {"skip", frame.window.skip}};
    }
    page->add("", side_names[side], text, document());
    add_exposure(frame, page);
    add_axes(*self, side, page, object);
    char line[96];
    std::snprintf(line, sizeof line,
                  "brightness %.1f %%, saturated %.1f %%, black %.1f %%, sharpness %.0f %%",
                  shown.brightness_permille / 10.0, shown.saturated_permille / 10.0,
                  shown.black_permille / 10.0, shown.sharpness_permille / 10.0);
    page->add("", "", line, document());
    (*object)["brightness_percent"] = shown.brightness_permille / 10.0;
    (*object)["saturated_percent"] = shown.saturated_permille / 10.0;
    (*object)["black_percent"] = shown.black_permille / 10.0;
    (*object)["sharpness_percent"] = shown.sharpness_permille / 10.0;
    return true;
}

/// Why the calibration cannot be used for the pair; "" if it can.
std::string mismatch_of(const reading &self, const calibration &value) {
    for (int side = 0; side < RIG_SIDES; side++) {
        const pair_frame &frame = self.pairs.pair.pair.frame[side];
        const lens &lens = side == RIG_LEFT ? value.left : value.right;
        const bool same =
            lens.width_px == frame.image.width_px && lens.height_px == frame.image.height_px;
        const bool whole = lens.width_px == MT9T001_WIDTH_PX &&
                           lens.height_px == MT9T001_HEIGHT_PX && frame.window.skip != 0;
        if (!same && !whole) {
            return std::string("it is for ") + side_names[side] + " frames of " +
                   std::to_string(lens.width_px) + " x " + std::to_string(lens.height_px) + " px";
        }
    }
    message why{};
    const char *accept = "\"vergence reconstruct --accept-mismatch\"";
    return calibration_match(&value, &self.state, accept, &why) == ERROR_OK ? "" : why.text;
}

std::string match_text(const std::string &why, bool known) {
    if (!why.empty()) {
        return ", does not match: " + why;
    }
    return known ? ", matches" : ", unknown whether it matches: axis positions are missing";
}

/// The calibration that was active.
bool add_calibration(reading *self, info_page *page, document *object) {
    (*object)["calibration"] = document();
    if (!self->pairs.has_calibration) {
        page->add("", "calibration", "none in the session", document());
        return true;
    }
    char name[SESSION_NAME_MAX + 1], text[CALIBRATION_TEXT_MAX_BYTES];
    session_calibration_name(self->pairs.calibration_crc, name);
    const int length = session_reader_calibration(&self->reader, self->pairs.calibration_crc, text,
                                                  sizeof text, &self->last_error);
    if (length < 0) {
        return false;
    }
    calibration value;
    calibration_fault fault{};
    if (calibration_parse(text, static_cast<size_t>(length), &value, &fault) != ERROR_OK) {
        message_set(&self->last_error, ERROR_SYNTAX, "%s/%s:%d: %s: %s", self->reader.path, name,
                    fault.line, fault.field, fault.reason);
        return false;
    }
    const std::string why = mismatch_of(*self, value);
    const bool known = !calibration_match_is_partial(&value, &self->state.origin);
    if (!why.empty() && value.has_origin && page->mismatch.empty()) {
        page->mismatch = "pair " + std::to_string(self->pairs.count) + ": ERR MISMATCH " + why;
    }
    page->add("", "calibration",
              std::string(value.id) + " (" + name + ")" +
                  (value.date[0] != '\0' ? std::string(", made ") + value.date : "") +
                  match_text(why, known),
              document());
    (*object)["calibration"] = {
        {"id", value.id},
        {"file", name},
        {"matches", why.empty() && !known ? document() : document(why.empty())},
        {"mismatch", why}};
    return true;
}

bool add_pair(reading *self, info_page *page, document *list) {
    struct pair pair = self->pairs.pair.pair;
    pair.number = self->pairs.count;
    calibration_match_pair(self->begin.profile,
                           self->pairs.has_instrument ? &self->pairs.instrument : nullptr, &pair,
                           &self->state);
    document object = json_of([&](json *out) {
        const capture_info info = {self->reader.path, &pair, nullptr};  // the state has angles
        capture_info_json(&info, out);
    })["capture"];
    object.erase("session");
    std::string text = "skew " + std::to_string(pair.skew_us) + " us, ";
    text += pair.checked ? "static: " + number_text(pair.change_permille / 10.0, 4) + " % changed"
                         : "not checked for motion";
    page->add("", "pair " + std::to_string(pair.number), text, document());
    for (int side = 0; side < RIG_SIDES; side++) {
        if (!add_side(self, side, page, &object[side_names[side]])) {
            return false;
        }
    }
    if (!add_calibration(self, page, &object)) {
        return false;
    }
    list->push_back(object);
    return true;
}

/// What `measure` was asked for, if it took the session, and the options that made its surface.
void add_measurement(const std::string &path, info_page *page) {
    const auto notes = std::make_unique<session_notes>();
    message ignored{};
    if (session_notes_read(AT_FDCWD, path.c_str(), notes.get(), &ignored) != 1) {
        page->add("measured", "", "", document());
        return;
    }
    const std::string request = notes->request, surface = notes->surface;
    document measured;
    measured["request"] = request;
    measured["surface"] = surface.empty() ? document() : document(surface);
    page->add("measured", "taken by",
              "measure " + request +
                  (surface.empty() ? ", which ended before its surface"
                                   : "; \"vergence measure\" makes its surface: " + surface),
              measured);
}

}  // namespace

bool info_session(const std::string &path, info_page *page, std::string *message) {
    const auto self = std::make_unique<reading>();
    page->kind = "session";
    int got =
        session_reader_open(&self->reader, AT_FDCWD, path.c_str(), &self->begin, &self->last_error);
    page->add("build", "made by", std::string("build ") + self->begin.build, self->begin.build);
    page->add("profile", "instrument", self->begin.profile, self->begin.profile);
    page->add("date", "date", self->begin.date, self->begin.date);
    info_page rows;
    document list = document::array();
    while (got >= 0 &&
           (got = session_pairs_next(&self->pairs, &self->reader, &self->last_error)) == 1) {
        got = add_pair(self.get(), &rows, &list) ? got : ERROR_CRC;
    }
    // A session without pairs is valid.
    if (got < 0 &&
        !(got == ERROR_MISSING && self->pairs.count == 0 && self->reader.text != nullptr)) {
        *message = self->last_error.text;
        return false;
    }
    add_measurement(path, page);
    page->add("cut_off", "end",
              self->reader.cut ? "truncated, or still being written" : "closed in order",
              self->reader.cut);
    page->add("pair_count", "pairs", std::to_string(self->pairs.count), self->pairs.count);
    page->mismatch = rows.mismatch;
    page->rows.insert(page->rows.end(), rows.rows.begin(), rows.rows.end());
    page->add("pairs", "", "", list);
    return true;
}
