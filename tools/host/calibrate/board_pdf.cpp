// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/board_pdf.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "calib/base/marker.hpp"
#include "console/command_words.h"
#include "core/invariant.h"
#include "daemon/surface/length_check.h"
#include "tools/host/formats/report_text.hpp"

namespace {

const double pdf_unit_mm = 25.4 / 72;
const double margin_mm = 5;    // margin that printers leave
const double caption_mm = 14;  // height of the ruler and two lines of text below the board
const double letters_mm = 3;
const double widest_letter = 0.56;  // mean width over height of Helvetica's letters, with a margin

const board_paper papers[] = {
    {"A4", 210, 297},  {"A3", 297, 420},         {"A2", 420, 594},        {"A1", 594, 841},
    {"A0", 841, 1189}, {"letter", 215.9, 279.4}, {"legal", 215.9, 355.6}, {"tabloid", 279.4, 431.8},
};

bool same_word(const std::string &a, const std::string &b) {
    return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](char x, char y) {
               return std::tolower(static_cast<unsigned char>(x)) ==
                      std::tolower(static_cast<unsigned char>(y));
           });
}

/// Largest square on a page of this width and height.
double largest_on(const calib::board &board, double width_mm, double height_mm) {
    const double across = (width_mm - 2 * margin_mm) / (board.columns + 1);
    const double down = (height_mm - 2 * margin_mm - caption_mm) / (board.rows + 1);
    return std::floor(10 * std::min(across, down) + 1e-9) / 10;
}

/// Draws in millimetres from the page's top left corner, y down.
class drawing {
  public:
    void rectangle(double x, double y, double width, double height) {
        content_ += report_text_format("%.4f %.4f %.4f %.4f re\n", x, y, width, height);
    }
    /// The rectangles up to `end` are filled as one shape, so that no seam shows between
    /// neighbours.
    void begin(bool black) { content_ += black ? "0 g\n" : "1 g\n"; }
    void end() { content_ += "f\n"; }
    void text(double x, double y, const std::string &words) {
        std::string escaped;
        for (const char c : words) {
            escaped +=
                c == '(' || c == ')' || c == '\\' ? std::string("\\") + c : std::string(1, c);
        }
        // Text is upright only where y points upwards.
        content_ += report_text_format("BT /F %.4f Tf 1 0 0 -1 %.4f %.4f Tm (", letters_mm, x, y) +
                    escaped + ") Tj ET\n";
    }
    const std::string &content() const { return content_; }

  private:
    std::string content_;
};

struct place {
    double x, y;  // upper left corner of the board's squares
};

void draw_squares(const calib::board &board, const place &at, drawing *page) {
    page->begin(true);
    for (int row = 0; row <= board.rows; row++) {
        for (int column = 0; column <= board.columns; column++) {
            if (!calib::board_square_white(column, row)) {
                page->rectangle(at.x + column * board.square_mm, at.y + row * board.square_mm,
                                board.square_mm, board.square_mm);
            }
        }
    }
    page->end();
}

void draw_markers(const calib::board &board, const place &at, drawing *page) {
    const calib::marker_dictionary *dictionary = calib::marker_dictionary_named(board.dictionary);
    INVARIANT(dictionary != nullptr && calib::board_marker_count(board) <= dictionary->count);
    const double inset = (board.square_mm - board.marker_mm) / 2;
    const double bit = board.marker_mm / (dictionary->side + 2);
    for (const bool black : {true, false}) {
        page->begin(black);
        for (int marker = 0; marker < calib::board_marker_count(board); marker++) {
            const calib::square_place square = calib::board_marker_square(board, marker);
            const double x = at.x + square.column * board.square_mm + inset;
            const double y = at.y + square.row * board.square_mm + inset;
            if (black) {
                page->rectangle(x, y, board.marker_mm, board.marker_mm);
                continue;
            }
            const int bits = dictionary->side * dictionary->side;
            for (int i = 0; i < bits; i++) {
                if ((dictionary->codes[marker] >> (bits - 1 - i) & 1) != 0) {
                    page->rectangle(x + (1 + i % dictionary->side) * bit,
                                    y + (1 + i / dictionary->side) * bit, bit, bit);
                }
            }
        }
        page->end();
    }
}

/// A line with a tick every 10 mm. Returns its length.
double draw_ruler(double x, double y, double room_mm, drawing *page) {
    const double length_mm = std::min(200.0, std::floor(room_mm / 10) * 10);
    page->begin(true);
    page->rectangle(x, y, length_mm, 0.2);
    for (int stroke = 0; stroke <= length_mm / 10; stroke++) {
        const double high_mm = stroke % 5 == 0 ? 2.5 : 1.5;
        // The left edge of each tick is at a multiple of 10 mm.
        page->rectangle(x + 10 * stroke, y - high_mm, 0.2, high_mm);
    }
    page->end();
    return length_mm;
}

void draw_caption(const calib::board &board, const place &at, double width_mm, double ruler_mm,
                  drawing *page) {
    std::string board_text = report_text_format("%d x %d inner corners, squares of %g mm",
                                                board.columns, board.rows, board.square_mm);
    std::string command =
        report_text_format("--board %dx%d --square %g", board.columns, board.rows, board.square_mm);
    if (board.coded()) {
        board_text +=
            report_text_format(", markers %s of %g mm", board.dictionary.c_str(), board.marker_mm);
        command += report_text_format(" --charuco %s --marker %g", board.dictionary.c_str(),
                                      board.marker_mm);
    }
    std::string print_text =
        report_text_format("Print at 100 %%, glue it flat. The ruler is %g mm long.", ruler_mm);
    const double max = width_mm / (letters_mm * widest_letter);
    const std::string with_command = print_text + "  vergence calibrate " + command;
    print_text = static_cast<double>(with_command.size()) < max ? with_command : print_text;
    page->begin(true);
    page->text(at.x, at.y + 4, board_text.substr(0, static_cast<size_t>(max)));
    page->text(at.x, at.y + 8, print_text.substr(0, static_cast<size_t>(max)));
}

/// The file around the page's content.
std::string wrapped(const std::string &content, const board_paper &paper) {
    const double width = paper.width_mm / pdf_unit_mm, height = paper.height_mm / pdf_unit_mm;
    const std::string objects[] = {
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        report_text_format("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 %.6f %.6f] /Contents 4 0 R "
                           "/Resources << /Font << /F 5 0 R >> >> >>",
                           width, height),
        report_text_format("<< /Length %zu >>\nstream\n", content.size()) + content + "endstream",
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
    };
    std::string file = "%PDF-1.6\n";
    std::string table = "0000000000 65535 f \n";
    int number = 0;
    for (const std::string &object : objects) {
        table += report_text_format("%010zu 00000 n \n", file.size());
        file += report_text_format("%d 0 obj\n", ++number) + object + "\nendobj\n";
    }
    const size_t table_at = file.size();
    return file + report_text_format("xref\n0 %d\n", number + 1) + table +
           report_text_format("trailer\n<< /Size %d /Root 1 0 R >>\nstartxref\n%zu\n", number + 1,
                              table_at) +
           "%%EOF\n";
}

}  // namespace

bool board_paper_parse(const std::string &text, board_paper *paper) {
    for (const board_paper &known : papers) {
        if (same_word(text, known.name)) {
            *paper = known;
            return true;
        }
    }
    const size_t by = text.find('x');
    command_number width, height;
    if (by == std::string::npos ||
        command_words_quantity(text.substr(0, by).c_str(), "mm", &width) != COMMAND_QUANTITY_READ ||
        command_words_quantity(text.c_str() + by + 1, "mm", &height) != COMMAND_QUANTITY_READ) {
        return false;
    }
    board_paper given;
    given.width_mm = width.value;
    given.height_mm = height.value;
    const bool good = given.width_mm >= 20 && given.height_mm >= 20 && given.width_mm <= 5000 &&
                      given.height_mm <= 5000;
    if (good) {
        *paper = given;
    }
    return good;
}

std::string board_paper_names() {
    std::string names;
    for (const board_paper &known : papers) {
        names += known.name + " ";
    }
    return names + "WIDTHxHEIGHT";
}

double board_largest_square_mm(const calib::board &board, const board_paper &paper) {
    return std::max(0.0, std::max(largest_on(board, paper.width_mm, paper.height_mm),
                                  largest_on(board, paper.height_mm, paper.width_mm)));
}

std::string board_pdf(const calib::board &board, const board_paper &paper, double *scale_mm) {
    board_paper turned = paper;
    if (largest_on(board, paper.width_mm, paper.height_mm) + 1e-6 < board.square_mm) {
        std::swap(turned.width_mm, turned.height_mm);
    }
    INVARIANT(largest_on(board, turned.width_mm, turned.height_mm) + 0.1 > board.square_mm);
    const double width_mm = (board.columns + 1) * board.square_mm;
    const double height_mm = (board.rows + 1) * board.square_mm;
    const place at = {(turned.width_mm - width_mm) / 2,
                      (turned.height_mm - caption_mm - height_mm) / 2};
    const double room_mm = turned.width_mm - 2 * margin_mm;
    drawing page;
    draw_squares(board, at, &page);
    if (board.coded()) {
        draw_markers(board, at, &page);
    }
    const double caption_y =
        std::min(at.y + height_mm + margin_mm, turned.height_mm - caption_mm - margin_mm + 4);
    *scale_mm = draw_ruler(margin_mm, caption_y + 1, room_mm, &page);
    draw_caption(board, {margin_mm, caption_y + 1}, room_mm, *scale_mm, &page);
    // From points, upwards, to millimetres, downwards.
    const std::string scale = report_text_format("%.9f 0 0 %.9f 0 %.6f cm\n", 1 / pdf_unit_mm,
                                                 -1 / pdf_unit_mm, turned.height_mm / pdf_unit_mm);
    return wrapped(scale + page.content(), turned);
}

namespace {

std::string in_small_letters(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
}

const int corners_min = 2, corners_max = 255;
// Parts of the names that other programs give to patterns without the corners of squares.
const char *const other_patterns[] = {"circ", "dot", "blob", "ring", "april"};

// Reads the inner corners; returns one sentence with what is wrong, "" when nothing is.
std::string read_corners(const char *given, calib::board *board) {
    const std::string text = in_small_letters(given), named = std::string("--board \"") + given;
    for (const char *pattern : other_patterns) {
        if (text.find(pattern) != std::string::npos) {
            return named +
                   "\": only chessboards and ChArUco boards are supported: print one with "
                   "\"vergence board\", and give its inner corners, as in --board 9x6";
        }
    }
    const size_t middle = text.find('x');
    int64_t columns = 0, rows = 0;
    if (middle == std::string::npos ||
        !command_words_integer(text.substr(0, middle).c_str(), &columns) ||
        !command_words_integer(text.substr(middle + 1).c_str(), &rows)) {
        return named + "\": not COLUMNSxROWS (the inner corners of the board, as in --board 9x6)";
    }
    if (std::min(columns, rows) < corners_min || std::max(columns, rows) > corners_max) {
        return named + "\": out of range (expected " + std::to_string(corners_min) + " to " +
               std::to_string(corners_max) + " inner corners each way)";
    }
    board->columns = static_cast<int>(columns);
    board->rows = static_cast<int>(rows);
    return "";
}

std::string dictionary_name(const std::string &given) {
    const std::string text = in_small_letters(given);
    const std::string prefix = "dict_";
    return text.compare(0, prefix.size(), prefix) == 0 ? text.substr(prefix.size()) : text;
}

std::string check_markers(const calibrate_board_request &request, const calib::board &board) {
    const calib::marker_dictionary *dictionary = calib::marker_dictionary_named(board.dictionary);
    if (dictionary == nullptr) {
        const calib::marker_dictionary_list all = calib::marker_dictionaries();
        std::string names;
        for (size_t i = 0; i < all.count; i++) {
            names += (i > 0 ? " " : "") + std::string(all.first[i].name);
        }
        return std::string("unknown --charuco \"") + request.dictionary +
               "\" (expected one of: " + names + ")";
    }
    if (!(request.marker > 0)) {
        return "--marker MM is missing (the side of a marker, including its black border)";
    }
    if (request.marker >= request.square) {
        return "--marker must be smaller than --square (markers are inside the white squares)";
    }
    const int needed = calib::board_marker_count(board);
    if (needed > dictionary->count) {
        return std::string("the board has ") + std::to_string(needed) + " markers, but " +
               board.dictionary + " has only " + std::to_string(dictionary->count) +
               ": use a larger dictionary of that kind";
    }
    return "";
}

const double units_mm[] = {1, 10, 1000};

// Whether the sides are valid square sizes in mm; "" when they are.
std::string check_size(const calibrate_board_request &request, const calib::board &board) {
    const double across_mm = (std::max(board.columns, board.rows) + 1) * board.square_mm;
    const std::string square = number_text(request.square, 6);
    if (board.square_mm < 1e-3 || board.square_mm > calibrate_board_side_max) {
        return "--square " + square + ": out of range: " + number_text(board.square_mm, 6) +
               " mm (expected 0.001 to " + number_text(calibrate_board_side_max, 6) + " mm)";
    }
    if (request.unit >= 0 || across_mm >= LENGTH_MIN_BOARD_MM) {
        return "";
    }
    return "--square " + square + ": the board would be " + number_text(across_mm, 4) +
           " mm across; below " + number_text(LENGTH_MIN_BOARD_MM, 4) +
           " mm the unit must be stated: --unit m for metres, --unit mm for millimetres";
}

}  // namespace

const char *const calibrate_board_units = "mm cm m";

std::string calibrate_board_make(const calibrate_board_request &request, calib::board *board) {
    if (request.corners == nullptr) {
        return "--board COLUMNSxROWS is missing (the inner corners of the board, as in --board "
               "9x6)";
    }
    std::string wrong = read_corners(request.corners, board);
    if (!wrong.empty()) {
        return wrong;
    }
    if (!(request.square > 0)) {
        return "--square MM is missing (the side of one square of the board)";
    }
    const double unit_mm = units_mm[std::max(request.unit, 0)];
    board->square_mm = request.square * unit_mm;
    wrong = check_size(request, *board);
    if (!wrong.empty()) {
        return wrong;
    }
    if (request.dictionary == nullptr) {
        return request.marker > 0 ? "--marker requires --charuco" : "";
    }
    board->dictionary = dictionary_name(request.dictionary);
    board->marker_mm = request.marker * unit_mm;
    return check_markers(request, *board);
}
