// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/world/document.hpp"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <fstream>
#include <sstream>

namespace world {
namespace {

// Limit of coordinates in any unit: products stay far from the limits of doubles.
constexpr double kFarthest = 1e7;

std::string number_text(double value) {
    std::ostringstream text;
    text << value;
    return text.str();
}

// Quoted content of a file may hold any character.
std::string one_line(std::string text) {
    for (char &c : text) {
        const auto byte = static_cast<unsigned char>(c);
        c = byte < 0x20 || byte == 0x7F ? '?' : c;
    }
    return text;
}

}  // namespace

Entry::Entry(std::string file, const YAML::Node &node)
    : file_(std::move(file)), node_(std::make_shared<const YAML::Node>(node)) {}

std::string Entry::contents(const std::string &path) {
    std::ifstream stream(path, std::ios::binary);
    if (!stream) {
        throw BadFile(path, "cannot be read");
    }
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
}

Entry Entry::of_file(const std::string &path) {
    return of_text(path, contents(path));
}

Entry Entry::of_text(const std::string &name, const std::string &text) {
    try {
        return Entry(name, YAML::Load(text));
    } catch (const YAML::ParserException &error) {
        throw BadFile(name + ":" + std::to_string(error.mark.line + 1),
                      "not YAML: " + one_line(error.msg));
    }
}

void Entry::fail(const std::string &what) const {
    const int line = node_->Mark().line;
    throw BadFile(file_ + ":" + std::to_string(line < 0 ? 1 : line + 1), one_line(what));
}

bool Entry::has(const std::string &key) const {
    return node_->IsMap() && (*node_)[key].IsDefined();
}

Entry Entry::at(const std::string &key) const {
    if (!node_->IsMap()) {
        fail("not a map (expected keys, among them '" + key + "')");
    }
    const YAML::Node child = (*node_)[key];
    if (!child.IsDefined()) {
        fail("'" + key + "' is missing");
    }
    return Entry(file_, child);
}

std::vector<Entry> Entry::items() const {
    if (!node_->IsSequence()) {
        fail("not a list");
    }
    std::vector<Entry> found;
    for (const YAML::Node &child : *node_) {
        found.push_back(Entry(file_, child));
    }
    return found;
}

std::string Entry::only_key() const {
    if (!node_->IsMap() || node_->size() != 1) {
        fail("not a single key with its values");
    }
    return Entry(file_, node_->begin()->first).text();
}

void Entry::allow(const std::set<std::string> &keys) const {
    if (!node_->IsMap()) {
        fail("not a map of keys");
    }
    std::set<std::string> seen;
    for (const auto &pair : *node_) {
        const Entry key(file_, pair.first);
        const std::string name = key.text();
        if (keys.count(name) == 0) {
            key.fail("unknown key '" + name + "'");
        }
        if (!seen.insert(name).second) {
            key.fail("duplicate key '" + name + "'");
        }
    }
}

void Entry::read(const std::vector<Number> &wanted, std::set<std::string> others) const {
    for (const Number &one : wanted) {
        others.insert(one.key);
    }
    allow(others);
    for (const Number &one : wanted) {
        *one.value = number(one.key, one.low, one.high);
    }
}

std::string Entry::text() const {
    if (!node_->IsScalar()) {
        fail("not a word");
    }
    return node_->Scalar();
}

double Entry::number() const {
    double value = 0;
    if (!node_->IsScalar() || !YAML::convert<double>::decode(*node_, value) ||
        !std::isfinite(value)) {
        fail("not a number" + (node_->IsScalar() ? ": '" + node_->Scalar() + "'" : std::string()));
    }
    return value;
}

double Entry::number(double low, double high) const {
    const double value = number();
    if (value < low || value > high) {
        fail(number_text(value) + " is not between " + number_text(low) + " and " +
             number_text(high));
    }
    return value;
}

int Entry::whole(int low, int high) const {
    const double value = number(low, high);
    if (value != std::floor(value)) {
        fail(number_text(value) + " is not an integer");
    }
    return static_cast<int>(value);
}

std::vector<double> Entry::numbers(std::size_t count) const {
    std::vector<double> values;
    for (const Entry &item : items()) {
        values.push_back(item.number(-kFarthest, kFarthest));
    }
    if (values.size() != count) {
        fail("expected " + std::to_string(count) + " numbers, not " +
             std::to_string(values.size()));
    }
    return values;
}

Vec2 Entry::pair() const {
    const auto v = numbers(2);
    return {v[0], v[1]};
}

Vec3 Entry::vector() const {
    const auto v = numbers(3);
    return {v[0], v[1], v[2]};
}

double Entry::number(const std::string &key, double low, double high, double otherwise) const {
    return has(key) ? at(key).number(low, high) : otherwise;
}

double Entry::number(const std::string &key, double low, double high) const {
    return at(key).number(low, high);
}

Vec3 Entry::vector(const std::string &key, const Vec3 &otherwise) const {
    return has(key) ? at(key).vector() : otherwise;
}

}  // namespace world
