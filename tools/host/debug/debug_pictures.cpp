// SPDX-License-Identifier: Apache-2.0
#include "tools/host/debug/debug_pictures.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/invariant.h"
#include "tools/host/formats/report_text.hpp"

namespace {

constexpr int last_colour = debug_nothing - 1;
constexpr colormap_rgb nothing = {0x55, 0x59, 0x5e};
constexpr colormap_rgb mark = {0xff, 0x3b, 0x30};  // not on any scale
constexpr colormap_rgb good = {0xb9, 0xe3, 0xc6}, bad = {0xd5, 0x5e, 0x00};
// As the matcher decides, see stereo/match/state.h and validation.h.
constexpr int margin_min = 24, cost_max = 40, colours_a_cost = 6;
// Minimum height of a slice: one pixel per disparity would often be a thin line.
constexpr int slice_height_px = 160;
constexpr int surfaces_max = 6;

const char *const surface_names[surfaces_max] = {"05_surface_6.png", "05_surface_5.png",
                                                 "05_surface_4.png", "05_surface_3.png",
                                                 "05_surface_2.png", "05_surface_1.png"};

using emitter = std::function<int(const debug_picture &)>;

/// Common parameters of all drawing functions.
struct scene {
    const debug_look &look;
    const reconstruct_result &result;
    const emitter &emit;
    int error;

    void show(debug_picture picture) {
        picture.palette[debug_nothing] = nothing;
        error = error == ERROR_OK ? emit(picture) : error;
    }
    const debug_level &finest() const { return look.levels().front(); }
};

/// A colour scale over the indices up to `last_colour`.
colormap_table scale(const colormap_table &table, bool reversed) {
    colormap_table result = table;
    if (reversed) {
        std::reverse(result.begin(), result.begin() + debug_nothing);
    }
    return result;
}

colormap_table greys() {
    colormap_table table{};
    for (std::size_t i = 0; i < table.size(); i++) {
        table[i].fill(static_cast<std::uint8_t>(i));
    }
    return table;
}

colormap_table few(const std::vector<page_key> &keys) {
    colormap_table table{};
    for (std::size_t i = 0; i < keys.size(); i++) {
        table[i] = keys[i].colour;
    }
    return table;
}

/// Position of a value in [low, high] on a colour scale.
std::uint8_t colour_of(double value, double low, double high) {
    const double place = high > low ? (value - low) / (high - low) : 0;
    return static_cast<std::uint8_t>(std::lround(last_colour * std::clamp(place, 0.0, 1.0)));
}

debug_picture picture_of_level(const char *file_name, const char *section,
                               const debug_level &level) {
    debug_picture picture{};
    picture.file_name = file_name;
    picture.section = section;
    picture.width_px = level.width;
    picture.height_px = level.height;
    picture.indices.assign(level.winner.size(), debug_nothing);
    picture.last_index = last_colour;
    picture.has_row = true;
    return picture;
}

debug_picture picture_of_image(const char *file_name, const char *section, const image_u8 &image) {
    debug_picture picture{};
    picture.file_name = file_name;
    picture.section = section;
    picture.width_px = image.width;
    picture.height_px = image.height;
    for (int y = 0; y < image.height; y++) {
        const std::uint8_t *row = image_u8_row(&image, y);
        picture.indices.insert(picture.indices.end(), row, row + image.width);
    }
    picture.last_index = last_colour;
    picture.has_row = true;
    return picture;
}

/// Fills a picture of a level by a function of the pixel's index.
template <typename Value>
void fill(debug_picture *picture, Value value) {
    for (std::size_t i = 0; i < picture->indices.size(); i++) {
        picture->indices[i] = static_cast<std::uint8_t>(value(i));
    }
}

std::string pixels(double value) {
    return report_text_format("%g px", value);
}

void show_pair(scene *scene) {
    const char *section = "The pair";
    debug_picture left = picture_of_image("01_left.png", section, scene->result.left);
    left.title = "Left image";
    left.shows = "The rectified left image, grey, as the matcher gets it.";
    left.look_for = "Is it sharp, and not blown out where the result is bad?";
    debug_picture right = picture_of_image("02_right.png", section, scene->result.right);
    right.title = "Right image";
    right.shows = "The rectified right image.";
    right.look_for =
        "Every detail must be on the same row as on the left, and further left by its "
        "disparity.";
    for (debug_picture *picture : {&left, &right}) {
        // The last index means no data.
        for (std::uint8_t &index : picture->indices) {
            index = std::min<std::uint8_t>(index, last_colour);
        }
        picture->palette = greys();
        picture->low = "black";
        picture->high = "white";
    }
    scene->show(left);
    scene->show(right);
}

void show_features(scene *scene) {
    const char *section = "What is compared";
    debug_picture census = picture_of_level("03_census.png", section, scene->finest());
    census.title = "Census";
    census.shows =
        "How many of 24 comparisons around a pixel find the first one brighter; their pattern is "
        "what is compared.";
    census.look_for =
        "Shapeless grain means noise; dark areas have no pattern at "
        "all.";
    census.palette = scale(colormap_sequential(), false);
    census.low = "0";
    census.high = "24";
    fill(&census, [&](std::size_t i) { return colour_of(scene->look.brighter()[i], 0, 24); });
    scene->show(census);
    debug_picture gradient = picture_of_level("04_gradient.png", section, scene->finest());
    gradient.title = "Gradient along the row";
    gradient.shows = "Where the image gets brighter (red) or darker (blue) to the right.";
    gradient.look_for = "Pale areas and edges along the row distinguish disparities poorly.";
    gradient.palette = scale(colormap_diverging(), false);
    gradient.low = "-64 or less";
    gradient.high = "64 or more";
    fill(&gradient,
         [&](std::size_t i) { return colour_of(scene->look.gradient()[i] - 128, -64, 64); });
    scene->show(gradient);
}

/// The colours of full-size disparities: half of them strong, half of them pale, for surfaces.
enum { SURFACE_COLOURS = 127 };

void show_surface(scene *scene, std::size_t number) {
    const debug_level &level = scene->look.levels()[number];
    const int factor = 1 << level.shift_x;
    const rectify_plan &plan = scene->result.plan;
    debug_picture picture = picture_of_level(surface_names[surfaces_max - static_cast<int>(number)],
                                             "Where to search", level);
    picture.title = report_text_format("Surface at 1/%d", factor);
    picture.shows = report_text_format(
        "What level %zu found (%d x %d pixels, disparities of the full size); pale where another "
        "disparity fits as well, grey where nothing is accepted.",
        number, level.width, level.height);
    picture.look_for = "What is missing or wrong here is not searched for on the next level.";
    const colormap_table table = colormap_sequential();
    for (std::size_t i = 0; i < SURFACE_COLOURS; i++) {
        const colormap_rgb &strong = table[2 * i];
        picture.palette[i] = strong;
        for (std::size_t k = 0; k < strong.size(); k++) {
            picture.palette[SURFACE_COLOURS + i][k] =
                static_cast<std::uint8_t>((strong[k] + 2 * 235) / 3);
        }
    }
    picture.last_index = SURFACE_COLOURS - 1;
    picture.low = pixels(plan.disparity_min);
    picture.high = pixels(plan.disparity_min + plan.disparity_count - 1);
    fill(&picture, [&](std::size_t i) -> int {
        if (level.winner[i] < 0 || level.consistent[i] == 0 || level.fits[i] == 0) {
            return debug_nothing;
        }
        const int full = factor * (level.disparity_min + level.winner[i]) - plan.disparity_min;
        const int colour = full * (SURFACE_COLOURS - 1) / std::max(1, plan.disparity_count - 1);
        return std::clamp(colour, 0, SURFACE_COLOURS - 1) +
               (level.margin[i] < margin_min ? SURFACE_COLOURS : 0);
    });
    scene->show(picture);
}

void show_windows(scene *scene) {
    const debug_level &level = scene->finest();
    const int last = level.disparity_min + level.disparity_count - 1;
    debug_picture low = picture_of_level("06_window_low.png", "Where to search", level);
    low.title = "Lowest disparity searched";
    low.shows = "Where the window of each tile of 16 columns and 8 rows begins.";
    low.look_for = "An object in front of or behind its background needs a tile of its own colour.";
    low.palette = scale(colormap_sequential(), false);
    low.low = pixels(level.disparity_min);
    low.high = pixels(last);
    fill(&low, [&](std::size_t i) {
        return colour_of(level.disparity_min + level.window_first[i], level.disparity_min, last);
    });
    scene->show(low);
    const int widest = *std::max_element(level.window_count.begin(), level.window_count.end());
    debug_picture count = picture_of_level("06_window_count.png", "Where to search", level);
    count.title = "Disparities searched";
    count.shows = "How many disparities each tile searches, in steps of 16.";
    count.look_for =
        "Bright tiles contain a step in depth, or were ambiguous on a coarser level: they "
        "take the most time.";
    count.palette = scale(colormap_sequential(), false);
    count.low = "0";
    count.high = std::to_string(widest);
    fill(&count, [&](std::size_t i) { return colour_of(level.window_count[i], 0, widest); });
    scene->show(count);
}

struct slice_text {
    const char *file_name;
    debug_plane plane;
    const char *title, *shows, *look_for;
    int highest;  // value at the dark end
};

const slice_text slices[] = {
    {"07_row_cost.png", DEBUG_COST, "Cost of each pixel",
     "How badly the pixel at x on the left fits the one at x - disparity on the right.",
     "The true surface should be a bright line, even if broken; without one, the images "
     "differ "
     "here.",
     127},
    {"08_row_cost_along.png", DEBUG_COST_ALONG, "Averaged along the row",
     "The same, averaged over neighbours of similar grey level.",
     "The line should be clearer now; broad bright bands are areas without texture.", 64},
    {"09_row_cost_around.png", DEBUG_COST_AROUND, "Averaged along the columns as well",
     "The same with the rows above and six rows below.",
     "One bright line; several in parallel are repeated texture.", 64},
    {"10_row_from_above.png", DEBUG_FROM_ABOVE, "Path cost from above",
     "What the best path from the row above costs, less that of the cheapest disparity.",
     "Bright where the rows above support a disparity.", 127},
    {"11_row_from_left.png", DEBUG_FROM_LEFT, "Path cost from the left",
     "The same along the row, coming from the left.",
     "After a step in depth it follows the old surface for some pixels.", 127},
    {"12_row_from_right.png", DEBUG_FROM_RIGHT, "Path cost from the right",
     "The same coming from the right.", "Where it differs from the left one, the total decides.",
     127},
    {"13_row_total.png", DEBUG_TOTAL, "Total of the path costs, and the winners",
     "The sum of the three path costs; the lowest wins (red).",
     "Red should follow one bright line; where it jumps between two, the margin is small.", 255},
};

void show_slice(scene *scene, const slice_text &text) {
    const debug_level &level = scene->finest();
    const int times = (slice_height_px + level.disparity_count - 1) / level.disparity_count;
    const std::vector<std::int16_t> &slice = scene->look.slice(text.plane);
    debug_picture picture{};
    picture.file_name = text.file_name;
    picture.section = "One row";
    picture.title = text.title;
    picture.shows = text.shows;
    if (text.plane == DEBUG_COST) {
        picture.shows += report_text_format(
            " Columns to the right, disparities from %d to %d px upwards.", level.disparity_min,
            level.disparity_min + level.disparity_count - 1);
    }
    picture.look_for = text.look_for;
    picture.width_px = level.width;
    picture.height_px = times * level.disparity_count;
    picture.palette = scale(colormap_sequential(), true);
    picture.last_index = last_colour - 1;
    picture.low = "0 (fits)";
    picture.high = report_text_format("%d%s", text.highest, text.highest < 255 ? " or more" : "");
    const int row = std::min(scene->look.row() >> level.shift_y, level.height - 1);
    for (int y = 0; y < picture.height_px; y++) {
        const int i = level.disparity_count - 1 - y / times;
        for (int x = 0; x < level.width; x++) {
            const int value =
                slice[static_cast<std::size_t>(i) * static_cast<std::size_t>(level.width) +
                      static_cast<std::size_t>(x)];
            const int colour = std::min<int>(colour_of(value, 0, text.highest), last_colour - 1);
            const bool won = text.plane == DEBUG_TOTAL && level.winner[level.index(x, row)] == i;
            const int shown = value == DEBUG_NOT_SEARCHED ? debug_nothing : colour;
            picture.indices.push_back(static_cast<std::uint8_t>(won ? last_colour : shown));
        }
    }
    picture.palette[last_colour] = mark;
    scene->show(picture);
}

void show_decisions(scene *scene) {
    const char *section = "Decisions";
    const debug_level &level = scene->finest();
    const int last = level.disparity_min + level.disparity_count - 1;
    const auto none = [&](std::size_t i) { return level.winner[i] < 0; };
    debug_picture winner = picture_of_level("14_winner.png", section, level);
    winner.title = "Winner";
    winner.shows = "The disparity with the lowest total, before anything is checked or smoothed.";
    winner.look_for = "Streaks along the row are areas without support from above.";
    winner.palette = scale(colormap_sequential(), false);
    winner.low = pixels(level.disparity_min);
    winner.high = pixels(last);
    fill(&winner, [&](std::size_t i) -> int {
        return none(i) ? debug_nothing : colour_of(level.winner[i], 0, level.disparity_count - 1);
    });
    scene->show(winner);
    debug_picture consistent = picture_of_level("15_consistent.png", section, level);
    consistent.title = "Left-right check";
    consistent.shows =
        "Whether no other pixel of the row claims the same right pixel at a lower "
        "cost.";
    consistent.look_for =
        "Disagreement is normal to the left of near objects, where the right camera "
        "sees no background; elsewhere one of the two winners is wrong.";
    consistent.keys = {{bad, "disagree", ""}, {good, "agree", ""}};
    consistent.palette = few(consistent.keys);
    fill(&consistent,
         [&](std::size_t i) -> int { return none(i) ? debug_nothing : level.consistent[i]; });
    scene->show(consistent);
    debug_picture cost = picture_of_level("16_cost.png", section, level);
    cost.title = "Cost of the winner";
    cost.shows = report_text_format(
        "The averaged cost of the winner; red above %d, where nothing matches.", cost_max);
    cost.look_for =
        "Bright edges are misplaced borders; red areas are reflections, things outside "
        "the range, or what only one camera sees.";
    cost.palette = scale(colormap_sequential(), false);
    cost.palette[last_colour] = mark;
    cost.last_index = colours_a_cost * cost_max;
    cost.low = "0";
    cost.high = std::to_string(cost_max);
    fill(&cost, [&](std::size_t i) -> int {
        const int colour = level.cost[i] <= cost_max ? colours_a_cost * level.cost[i] : last_colour;
        return none(i) ? debug_nothing : colour;
    });
    scene->show(cost);
}

void show_confidence(scene *scene) {
    const bool greedy = scene->look.levels().empty();
    debug_picture margin =
        picture_of_image("17_margin.png", "The result", scene->result.match.confidence);
    margin.title = "Confidence";
    margin.shows = greedy ? "How much worse the neighbouring disparities fit, as the greedy "
                            "path measures it."
                          : report_text_format(
                                "The winner's margin over its best rival; grey below "
                                "%d, where another disparity fits as well.",
                                margin_min);
    margin.look_for = "In dark and grey areas a result would be arbitrary.";
    margin.palette = scale(colormap_sequential(), false);
    for (std::size_t i = 0; i < margin_min && !greedy; i++) {
        margin.palette[i].fill(0x80);
    }
    margin.low = "0";
    margin.high = report_text_format("%d or more", last_colour);
    for (std::uint8_t &index : margin.indices) {
        index = std::min<std::uint8_t>(index, last_colour);
    }
    scene->show(margin);
}

void show_reasons(scene *scene) {
    std::vector<page_key> keys;
    for (int reason = 0; reason < REASON_COUNT; reason++) {
        keys.push_back({colormap_reasons[reason], reason_text(reason), ""});
    }
    if (!scene->look.levels().empty()) {
        debug_picture first =
            picture_of_level("18_reasons_first.png", "The result", scene->finest());
        first.title = "Reasons before the speckle filter";
        first.shows = "Why a pixel has no disparity, as decided row by row.";
        first.look_for = "The left-right check comes first, then cost and range, texture, margin.";
        first.keys = keys;
        first.palette = few(keys);
        fill(&first, [&](std::size_t i) { return scene->look.reason()[i]; });
        scene->show(first);
    }
    debug_picture reasons =
        picture_of_image("19_reasons.png", "The result", scene->result.match.reason);
    reasons.title = "Reasons";
    reasons.shows = "Why a pixel of the result has no disparity, after the speckle filter.";
    reasons.look_for =
        "A correct island is lost here: --speckle sets how large they may "
        "be.";
    reasons.keys = keys;
    reasons.palette = few(keys);
    scene->show(reasons);
}

void show_disparity(scene *scene) {
    const reconstruct_result &result = scene->result;
    debug_picture picture = picture_of_image("20_disparity.png", "The result", result.match.reason);
    picture.title = "Disparity";
    picture.shows = "The result: smoothed, refined below a pixel, grey where it is rejected.";
    picture.look_for =
        "Pixels present in the winner but missing here were rejected: the reasons show why.";
    picture.palette = scale(colormap_sequential(), false);
    const double low = result.plan.disparity_min;
    const double high = low + result.plan.disparity_count - 1;
    picture.low = pixels(low);
    picture.high = pixels(high);
    std::size_t i = 0;
    for (int y = 0; y < picture.height_px; y++) {
        const std::int32_t *row = image_i32_row(&result.match.disparity_q8, y);
        for (int x = 0; x < picture.width_px; x++, i++) {
            picture.indices[i] = picture.indices[i] != REASON_VALID
                                     ? static_cast<std::uint8_t>(debug_nothing)
                                     : colour_of(row[x] / 256.0, low, high);
        }
    }
    scene->show(picture);
}

}  // namespace

int debug_pictures_draw(const debug_look &look, const reconstruct_context &context,
                        const std::function<int(const debug_picture &)> &emit) {
    scene scene{look, *context.result, emit, ERROR_OK};
    show_pair(&scene);
    if (!look.levels().empty()) {
        INVARIANT(look.levels().size() <= surfaces_max + 1);
        show_features(&scene);
        for (std::size_t number = look.levels().size() - 1; number > 0; number--) {
            show_surface(&scene, number);
        }
        if (look.levels().size() > 1) {
            show_windows(&scene);
        }
        for (const slice_text &text : slices) {
            show_slice(&scene, text);
        }
        show_decisions(&scene);
    }
    show_confidence(&scene);
    show_reasons(&scene);
    show_disparity(&scene);
    return scene.error;
}

const std::vector<const char *> &debug_pictures_names() {
    static const std::vector<const char *> names = [] {
        std::vector<const char *> all = {"01_left.png", "02_right.png", "03_census.png",
                                         "04_gradient.png"};
        all.insert(all.end(), std::begin(surface_names), std::end(surface_names));
        all.insert(all.end(), {"06_window_low.png", "06_window_count.png"});
        for (const slice_text &text : slices) {
            all.push_back(text.file_name);
        }
        all.insert(all.end(), {"14_winner.png", "15_consistent.png", "16_cost.png", "17_margin.png",
                               "18_reasons_first.png", "19_reasons.png", "20_disparity.png"});
        return all;
    }();
    return names;
}
