// SPDX-License-Identifier: Apache-2.0
#include "tools/host/convert/import_storage.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/error.h"
#include "tools/host/formats/numpy_archive.hpp"

namespace {

using json = nlohmann::ordered_json;
using kind = import_storage_kind;

[[noreturn]] void fail(const import_file &file, const std::string &what) {
    import_fail(ERROR_SYNTAX, file, "not a complete file of OpenCV's FileStorage: " + what);
}

/// A word as a number, or as text.
json value_of(const std::string &word) {
    double value = 0;
    const char *const end = word.data() + word.size();
    const auto read = std::from_chars(word.data(), end, value);
    return read.ec == std::errc() && read.ptr == end ? json(value) : json(word);
}

/// NaN for anything but a number.
double number_of(const json &value) {
    return value.is_number() ? value.get<double>() : std::nan("");
}

/// The numbers of a list, or of a list of rows.
std::vector<double> numbers_of(const json &list) {
    std::vector<double> numbers;
    for (const json &item : list) {
        for (const json &inner : item.is_array() ? item : json::array({item})) {
            numbers.push_back(number_of(inner));
        }
    }
    return numbers;
}

/// Whether this is an integer from `min` up that fits an int.
bool is_count(double value, double min) {
    return value >= min && value <= std::numeric_limits<int>::max() && value == std::floor(value);
}

void set_matrix(const import_file &file, const json &value, import_storage_entry *entry) {
    const double rows = number_of(value["rows"]), columns = number_of(value["cols"]);
    // "d", or with a channel count before it: "3d".
    const std::string type = value.contains("dt") && value["dt"].is_string() ? value["dt"] : "";
    const std::string count = type.substr(0, type.find_first_not_of("0123456789"));
    const double channels = count.empty() ? 1 : number_of(value_of(count));
    if (value.contains("data") && value["data"].is_array()) {
        entry->numbers = numbers_of(value["data"]);
    }
    if (!is_count(rows, 0) || !is_count(columns, 0) || !is_count(channels, 1) ||
        rows * columns * channels != static_cast<double>(entry->numbers.size())) {
        fail(file, entry->name + " does not have rows times cols numbers");
    }
    entry->kind = kind::matrix;
    entry->rows = static_cast<int>(rows);
    entry->columns = static_cast<int>(columns);
    entry->channels = static_cast<int>(channels);
}

import_storage_entry entry_of(const import_file &file, const std::string &name, const json &value) {
    import_storage_entry entry;
    entry.name = name;
    if (value.is_number()) {
        entry.kind = kind::number;
        entry.numbers = {value.get<double>()};
    } else if (value.is_array()) {
        entry.kind = kind::list;
        entry.numbers = numbers_of(value);
    } else if (value.is_object() && value.contains("rows") && value.contains("cols")) {
        set_matrix(file, value, &entry);
    }
    return entry;
}

// Names may be repeated in lists of XML only.
void add_member(const import_file &file, const std::string &name, json member, int depth,
                json *value) {
    if (depth == 0 && value->contains(name)) {
        import_fail(ERROR_DUPLICATE, file, name + " is a duplicate");
    }
    (*value)[name] = std::move(member);
}

// YAML. OpenCV's first line, %YAML:1.0, is rejected by YAML parsers.

// Anchors can make a node its own child, or the child of many: nothing is read below the rows of a
// matrix's data, and no more nodes than a calibration has.
constexpr int yaml_depth_max = 4, yaml_nodes_max = 100000;

json json_of(const import_file &file, const YAML::Node &node, int depth, int *nodes) {
    if (++*nodes > yaml_nodes_max) {
        fail(file, "it has too many entries");
    }
    if (node.IsScalar()) {
        return value_of(node.Scalar());
    }
    json value = node.IsSequence() ? json::array() : json();
    if (depth == yaml_depth_max) {
        return value;
    }
    for (const auto &item : node) {
        if (node.IsSequence()) {
            value.push_back(json_of(file, item, depth + 1, nodes));
        } else if (item.first.IsScalar()) {
            add_member(file, item.first.Scalar(), json_of(file, item.second, depth + 1, nodes),
                       depth, &value);
        }
    }
    return value;
}

bool is_of_name(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.';
}

/// OpenCV needs no blank after the colon of a name (data:[1, 2]), YAML parsers do.
std::string with_blanks(const std::string &text) {
    std::string result;
    for (const import_line &line : import_lines(text)) {
        const auto begin =
            std::find_if(line.text.begin(), line.text.end(), [](char c) { return c != ' '; });
        const auto colon = std::find_if_not(begin, line.text.end(), is_of_name);
        const bool blank = line.text.end() - colon > 1 && *colon == ':' && colon[1] != ' ';
        const auto end = blank ? colon + 1 : line.text.end();
        result += std::string(line.text.begin(), end) + (blank ? " " : "") +
                  std::string(end, line.text.end()) + "\n";
    }
    return result;
}

json read_yaml(const import_file &file) {
    std::string text = with_blanks(file.text);
    if (text.compare(0, 5, "%YAML") == 0) {
        text[0] = '#';  // keeps the line numbers
    }
    try {
        const YAML::Node root = YAML::Load(text);
        if (!root.IsMap()) {
            fail(file, "it contains no names");
        }
        int nodes = 0;
        return json_of(file, root, 0, &nodes);
    } catch (const YAML::Exception &error) {
        // The library has no message for excessive nesting.
        const std::string why = error.msg == "bad file" ? "nested too deeply" : error.msg;
        fail(file, "line " + std::to_string(error.mark.line + 1) + ": " + why);
    }
}

// XML: elements, attributes (skipped), text, comments and the declaration, which is all that
// FileStorage writes. Entities occur in strings only, which are not used.

struct element {
    std::string name, text;
    std::vector<element> children;
};

class xml_reader {
  public:
    explicit xml_reader(const import_file &file) : file_(file), text_(file.text) {}

    element read_document() {
        element root;
        read_children(&root, 0);
        if (at_ != text_.size() || root.children.size() != 1) {
            damaged("it must contain one element, opencv_storage");
        }
        return root.children[0];
    }

  private:
    static constexpr int depth_max = 32;

    [[noreturn]] void damaged(const std::string &what) const {
        const auto lines = std::count(
            text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(std::min(at_, text_.size())),
            '\n');
        fail(file_, "line " + std::to_string(lines + 1) + ": " + what);
    }

    bool begins(const char *word) const {
        return text_.compare(at_, std::char_traits<char>::length(word), word) == 0;
    }

    void skip_past(const char *word) {
        const size_t found = text_.find(word, at_);
        if (found == std::string::npos) {
            damaged(std::string("\"") + word + "\" is missing");
        }
        at_ = found + std::char_traits<char>::length(word);
    }

    /// Everything up to the closing tag of `parent`, or to the end of the text at depth 0.
    void read_children(element *parent, int depth) {
        while (at_ < text_.size()) {
            const size_t open = std::min(text_.find('<', at_), text_.size());
            parent->text.append(text_, at_, open - at_);
            at_ = open;
            if (begins("<?")) {
                skip_past("?>");
            } else if (begins("<!--")) {
                skip_past("-->");
            } else if (begins("</")) {
                const std::string tag = "</" + parent->name + ">";
                if (depth == 0 || !begins(tag.c_str())) {
                    damaged("a closing tag does not match");
                }
                at_ += tag.size();
                return;
            } else if (at_ < text_.size()) {
                read_element(parent, depth);
            }
        }
        if (depth > 0) {
            damaged("</" + parent->name + "> is missing");
        }
    }

    void read_element(element *parent, int depth) {
        const size_t close = text_.find('>', at_);
        if (close == std::string::npos) {
            damaged("\">\" is missing");
        }
        if (depth == depth_max) {
            damaged("elements are nested too deeply");
        }
        const std::string tag = text_.substr(at_ + 1, close - at_ - 1);
        at_ = close + 1;
        element child;
        child.name = tag.substr(0, tag.find_first_of(" \t\r\n/"));
        if (child.name.empty()) {
            damaged("an element has no name");
        }
        if (tag.back() != '/') {
            read_children(&child, depth + 1);
        }
        parent->children.push_back(std::move(child));
    }

    const import_file &file_;
    const std::string &text_;
    size_t at_ = 0;
};

/// An element's children by name, or its words: one value, or a list.
json json_of(const import_file &file, const element &parent, int depth) {
    json value;
    for (const element &child : parent.children) {
        add_member(file, child.name, json_of(file, child, depth + 1), depth, &value);
    }
    std::istringstream text(parent.text);
    std::string word;
    while (value.is_null() || value.is_array()) {
        if (!(text >> word)) {
            break;
        }
        value.push_back(value_of(word));
    }
    return value.is_array() && value.size() == 1 && parent.name != "data" ? value[0] : value;
}

/// Type and shape of an array that holds neither a number, a list nor a matrix of real numbers.
std::string unread_array(const numpy_array &array) {
    std::string shape;
    for (const long length : array.shape) {
        shape += (shape.empty() ? "" : ", ") + std::to_string(length);
    }
    return "has numpy's type '" + array.type + "' and shape (" + shape +
           "): save it as one matrix or list of numbers (numpy.asarray(..., float))";
}

import_storage_kind kind_of(const numpy_array &array) {
    if (array.shape.empty()) {
        return kind::number;
    }
    return array.shape.size() == 1 ? kind::list : kind::matrix;
}

std::vector<import_storage_entry> read_numpy(const import_file &file) {
    std::vector<numpy_array> arrays;
    std::string reason;
    if (!numpy_archive_read(file.text, &arrays, &reason)) {
        import_fail(ERROR_SYNTAX, file, reason);
    }
    std::vector<import_storage_entry> entries;
    for (const numpy_array &array : arrays) {
        import_storage_entry entry;
        entry.name = array.name;
        entry.numbers = array.numbers;
        if (!array.numbers.empty() && array.shape.size() <= 2) {
            entry.kind = kind_of(array);
        } else {
            entry.unread = unread_array(array);
        }
        if (entry.kind == kind::matrix) {
            entry.rows = static_cast<int>(array.shape[0]);
            entry.columns = static_cast<int>(array.shape[1]);
        }
        entries.push_back(std::move(entry));
    }
    return entries;
}

json read_root(const import_file &file) {
    const size_t first = file.text.find_first_not_of(" \t\r\n");
    const char begin = first == std::string::npos ? '\0' : file.text[first];
    if (begin == '<') {
        return json_of(file, xml_reader(file).read_document(), 0);
    }
    return begin == '{' ? import_json(file) : read_yaml(file);
}

}  // namespace

std::vector<import_storage_entry> import_storage_read(const import_file &file) {
    if (numpy_archive_matches(file.text)) {
        return read_numpy(file);
    }
    const json root = read_root(file);
    std::vector<import_storage_entry> entries;
    for (const auto &pair : root.items()) {
        entries.push_back(entry_of(file, pair.key(), pair.value()));
    }
    return entries;
}
