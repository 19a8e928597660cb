// SPDX-License-Identifier: Apache-2.0
#include "tools/host/convert/import_storage.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/error.h"

namespace {

using json = nlohmann::json;
using kind = import_storage_kind;

[[noreturn]] void fail(const import_file &file, const std::string &what) {
    import_fail(ERROR_SYNTAX, file, "not a complete file of OpenCV's FileStorage: " + what);
}

/// NaN for anything but a single number.
double number_of(const std::string &word) {
    double value = 0;
    const char *const end = word.data() + word.size();
    const auto read = std::from_chars(word.data(), end, value);
    return read.ec == std::errc() && read.ptr == end ? value : std::nan("");
}

/// Whether this is an integer from `min` up that fits an int.
bool is_count(double value, double min) {
    return value >= min && value <= std::numeric_limits<int>::max() && value == std::floor(value);
}

/// A matrix's parts as words: the three formats differ only in how they nest them.
void set_matrix(const import_file &file, const std::string &rows, const std::string &columns,
                const std::string &type, const std::vector<double> &data,
                import_storage_entry *entry) {
    const double row_count = number_of(rows), column_count = number_of(columns);
    // "d", or with a channel count before it: "3d".
    const std::string channels = type.substr(0, type.find_first_not_of("0123456789"));
    const double channel_count = channels.empty() ? 1 : number_of(channels);
    entry->kind = kind::matrix;
    entry->numbers = data;
    const double product = row_count * column_count * channel_count;
    if (!is_count(row_count, 0) || !is_count(column_count, 0) || !is_count(channel_count, 1) ||
        product != static_cast<double>(data.size())) {
        fail(file, entry->name + " does not have rows times cols numbers");
    }
    entry->rows = static_cast<int>(row_count);
    entry->columns = static_cast<int>(column_count);
    entry->channels = static_cast<int>(channel_count);
}

// YAML. OpenCV's first line, %YAML:1.0, is rejected by YAML parsers.

std::vector<double> yaml_numbers(const YAML::Node &node) {
    std::vector<double> numbers;
    for (const YAML::Node &item : node) {
        if (item.IsSequence()) {  // one level of nesting: a list of rows
            for (const YAML::Node &inner : item) {
                numbers.push_back(inner.IsScalar() ? number_of(inner.Scalar()) : std::nan(""));
            }
        } else {
            numbers.push_back(item.IsScalar() ? number_of(item.Scalar()) : std::nan(""));
        }
    }
    return numbers;
}

std::string yaml_word(const YAML::Node &map, const char *name) {
    const YAML::Node node = map[name];
    return node && node.IsScalar() ? node.Scalar() : "";
}

import_storage_entry yaml_entry(const import_file &file, const std::string &name,
                                const YAML::Node &node) {
    import_storage_entry entry;
    entry.name = name;
    if (node.IsScalar()) {
        entry.numbers = {number_of(node.Scalar())};
        entry.kind = std::isnan(entry.numbers[0]) ? kind::other : kind::number;
    } else if (node.IsSequence()) {
        entry.kind = kind::list;
        entry.numbers = yaml_numbers(node);
    } else if (node.IsMap() && node["rows"] && node["cols"]) {
        const YAML::Node data = node["data"];
        const bool list = data && data.IsSequence();
        set_matrix(file, yaml_word(node, "rows"), yaml_word(node, "cols"), yaml_word(node, "dt"),
                   list ? yaml_numbers(data) : std::vector<double>(), &entry);
    }
    return entry;
}

std::vector<import_storage_entry> read_yaml(const import_file &file) {
    std::string text = file.text;
    if (text.compare(0, 5, "%YAML") == 0) {
        text[0] = '#';  // keeps the line numbers
    }
    std::vector<import_storage_entry> entries;
    try {
        const YAML::Node root = YAML::Load(text);
        if (!root.IsMap()) {
            fail(file, "it contains no names");
        }
        for (const auto &pair : root) {
            if (pair.first.IsScalar()) {
                entries.push_back(yaml_entry(file, pair.first.Scalar(), pair.second));
            }
        }
    } catch (const YAML::Exception &error) {
        // The library has no message for excessive nesting.
        const std::string why = error.msg == "bad file" ? "nested too deeply" : error.msg;
        fail(file, "line " + std::to_string(error.mark.line + 1) + ": " + why);
    }
    return entries;
}

// JSON.

std::vector<double> json_numbers(const json &list) {
    std::vector<double> numbers;
    for (const json &item : list) {
        if (item.is_array()) {
            for (const json &inner : item) {
                numbers.push_back(inner.is_number() ? inner.get<double>() : std::nan(""));
            }
        } else {
            numbers.push_back(item.is_number() ? item.get<double>() : std::nan(""));
        }
    }
    return numbers;
}

std::string json_word(const json &map, const char *name) {
    const auto found = map.find(name);
    if (found == map.end()) {
        return "";
    }
    return found->is_string() ? found->get<std::string>() : found->dump();
}

std::vector<import_storage_entry> read_json(const import_file &file) {
    const json root = json::parse(file.text, nullptr, false);
    if (!root.is_object()) {
        fail(file, "it is not a JSON object");
    }
    std::vector<import_storage_entry> entries;
    for (const auto &pair : root.items()) {
        import_storage_entry entry;
        entry.name = pair.key();
        const json &value = pair.value();
        if (value.is_number()) {
            entry.kind = kind::number;
            entry.numbers = {value.get<double>()};
        } else if (value.is_array()) {
            entry.kind = kind::list;
            entry.numbers = json_numbers(value);
        } else if (value.is_object() && value.contains("rows") && value.contains("cols")) {
            const bool list = value.contains("data") && value["data"].is_array();
            set_matrix(file, json_word(value, "rows"), json_word(value, "cols"),
                       json_word(value, "dt"),
                       list ? json_numbers(value["data"]) : std::vector<double>(), &entry);
        }
        entries.push_back(entry);
    }
    return entries;
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

std::vector<std::string> words_of(const std::string &text) {
    std::vector<std::string> words;
    static const char *const blanks = " \t\r\n";
    size_t begin = text.find_first_not_of(blanks);
    while (begin != std::string::npos) {
        const size_t end = std::min(text.find_first_of(blanks, begin), text.size());
        words.push_back(text.substr(begin, end - begin));
        begin = text.find_first_not_of(blanks, end);
    }
    return words;
}

/// Words of the child with this name; empty if it is missing.
std::vector<std::string> xml_words(const element &parent, const char *name) {
    for (const element &child : parent.children) {
        if (child.name == name) {
            return words_of(child.text);
        }
    }
    return {};
}

std::vector<double> numbers_of(const std::vector<std::string> &words) {
    std::vector<double> numbers;
    std::transform(words.begin(), words.end(), std::back_inserter(numbers), number_of);
    return numbers;
}

std::vector<import_storage_entry> read_xml(const import_file &file) {
    const element root = xml_reader(file).read_document();
    std::vector<import_storage_entry> entries;
    for (const element &child : root.children) {
        import_storage_entry entry;
        entry.name = child.name;
        const auto rows = xml_words(child, "rows"), columns = xml_words(child, "cols");
        const auto type = xml_words(child, "dt");
        if (rows.size() == 1 && columns.size() == 1) {
            set_matrix(file, rows[0], columns[0], type.empty() ? "" : type[0],
                       numbers_of(xml_words(child, "data")), &entry);
        } else if (child.children.empty()) {
            entry.numbers = numbers_of(words_of(child.text));
            const bool word = entry.numbers.size() == 1 && std::isnan(entry.numbers[0]);
            entry.kind = word ? kind::other : entry.numbers.size() == 1 ? kind::number : kind::list;
        }
        entries.push_back(entry);
    }
    return entries;
}

}  // namespace

std::vector<import_storage_entry> import_storage_read(const import_file &file) {
    const size_t first = file.text.find_first_not_of(" \t\r\n");
    const char begin = first == std::string::npos ? '\0' : file.text[first];
    return begin == '<' ? read_xml(file) : begin == '{' ? read_json(file) : read_yaml(file);
}
