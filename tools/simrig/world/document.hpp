// SPDX-License-Identifier: Apache-2.0
/// Strict reading of YAML: every mistake becomes one line with file and line number.
#ifndef VERGENCE_SIMRIG_WORLD_DOCUMENT_HPP
#define VERGENCE_SIMRIG_WORLD_DOCUMENT_HPP

#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "tools/simrig/world/vec.hpp"

namespace YAML {
class Node;
}

namespace world {

/// What is wrong with a scene or rig file: "file:line: what", which may quote the file.
class BadFile : public std::runtime_error {
  public:
    BadFile(const std::string &place, const std::string &what)
        : std::runtime_error(place + ": " + what), place_(place) {}
    /// "file:line" alone, for readers who may not see the file's content.
    const std::string &place() const { return place_; }

  private:
    std::string place_;
};

/// One value of a file and its line. Unknown map keys are errors.
class Entry {
  public:
    /// The whole file. Throws BadFile when it cannot be read or is not YAML.
    static Entry of_file(const std::string &path);
    /// The same for a text in memory, of a file called `name`.
    static Entry of_text(const std::string &name, const std::string &text);
    /// The bytes of a file. Throws BadFile when it cannot be read.
    static std::string contents(const std::string &path);

    /// Throws BadFile at this entry's line.
    [[noreturn]] void fail(const std::string &what) const;

    bool has(const std::string &key) const;
    Entry at(const std::string &key) const;
    std::vector<Entry> items() const;
    /// The only key of a map of one entry, as in `- sheet: {...}`.
    std::string only_key() const;
    /// Throws BadFile when the map has a key that is not among these.
    void allow(const std::set<std::string> &keys) const;

    /// Reads the numbers of a map, each from `low` to `high`. Throws BadFile where one is missing
    /// or out of range, or where the map has another key that is not among `others`.
    struct Number {
        const char *key;
        double *value;
        double low, high;
    };
    void read(const std::vector<Number> &wanted, std::set<std::string> others = {}) const;

    std::string text() const;
    double number() const;
    double number(double low, double high) const;
    int whole(int low, int high) const;
    /// [x, y] or [x, y, z], each within -1e7 .. 1e7.
    Vec2 pair() const;
    Vec3 vector() const;

    double number(const std::string &key, double low, double high, double otherwise) const;
    double number(const std::string &key, double low, double high) const;
    Vec3 vector(const std::string &key, const Vec3 &otherwise) const;

  private:
    Entry(std::string file, const YAML::Node &node);
    std::vector<double> numbers(std::size_t count) const;

    std::string file_;
    std::shared_ptr<const YAML::Node> node_;  // a pointer, so that few sources include yaml-cpp
};

}  // namespace world

#endif
