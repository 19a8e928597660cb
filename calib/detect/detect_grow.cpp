// SPDX-License-Identifier: Apache-2.0
#include "calib/detect/detect_grow.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "calib/detect/detect_links.hpp"
#include "core/invariant.h"

namespace calib::detect {

namespace {

constexpr int widest = 260;  // corners: more than a board may have
constexpr std::array<place, 4> steps = {{{0, 1}, {1, 0}, {0, -1}, {-1, 0}}};

place moved(const place &from, const place &step, int times) {
    return {from.row + times * step.row, from.column + times * step.column};
}

const saddle *find(const loose_grid &cells, const place &where) {
    const auto found = cells.find(where);
    return found == cells.end() ? nullptr : &found->second.at;
}

struct prediction {
    double x = 0, y = 0, spacing_px = 0;
};

// The mean prediction from complete lines and parallelograms of neighbours.
std::optional<prediction> predicted(const loose_grid &cells, const place &where) {
    double x = 0, y = 0, spacing = 0, weight = 0;
    const auto add = [&](double px, double py, const saddle &near, double w) {
        x += w * px;
        y += w * py;
        spacing += w * std::hypot(px - near.x, py - near.y);
        weight += w;
    };
    for (size_t d = 0; d < 4; d++) {
        const saddle *a = find(cells, moved(where, steps[d], 1));
        const saddle *b = find(cells, moved(where, steps[d], 2));
        const saddle *c = find(cells, moved(where, steps[d], 3));
        const saddle *opposite = find(cells, moved(where, steps[d], -1));
        if (a != nullptr && b != nullptr && c != nullptr) {
            add(3 * a->x - 3 * b->x + c->x, 3 * a->y - 3 * b->y + c->y, *a, 1);
        } else if (a != nullptr && b != nullptr) {
            add(2 * a->x - b->x, 2 * a->y - b->y, *a, 0.5);
        }
        if (a != nullptr && opposite != nullptr) {
            add((a->x + opposite->x) / 2, (a->y + opposite->y) / 2, *a, 2);
        }
        const place &side = steps[(d + 1) % 4];
        const saddle *e = find(cells, moved(where, side, 1));
        const saddle *corner = find(cells, moved(moved(where, side, 1), steps[d], 1));
        if (a != nullptr && e != nullptr && corner != nullptr) {
            add(a->x + e->x - corner->x, a->y + e->y - corner->y, *a, 1);
        }
    }
    if (weight <= 0) {
        return std::nullopt;
    }
    return prediction{x / weight, y / weight, spacing / weight};
}

// The rotation that makes a saddle at `where` match all its neighbours; empty if one does not
// match.
std::optional<int> fitting_turn(const plane &level, const loose_grid &cells, const place &where,
                                const saddle &candidate) {
    std::optional<int> turn;
    for (int d = 0; d < 4; d++) {
        const auto found = cells.find(moved(where, steps[static_cast<size_t>(d)], 1));
        if (found == cells.end()) {
            continue;
        }
        const node &beside = found->second;
        // The neighbour's ray that leads back here.
        const int ray = (d + 2 - beside.turn + 4) % 4;
        const int own = returning_ray(beside.at, static_cast<size_t>(ray), candidate);
        if (own < 0 || !edge_between(level, beside.at, static_cast<size_t>(ray), candidate)) {
            return std::nullopt;
        }
        const int wanted = (d - own + 4) % 4;
        if (turn && *turn != wanted) {
            return std::nullopt;
        }
        turn = wanted;
    }
    return turn;
}

// The best saddle near a prediction. The search moves to the point of best mirror symmetry.
std::optional<node> node_near(const plane &level, const loose_grid &cells, const place &where,
                              const prediction &about) {
    const double radius = std::clamp(0.4 * about.spacing_px, 2.5, 6.0);
    const int reach = static_cast<int>(std::clamp(0.2 * about.spacing_px, 1.0, 4.0));
    std::optional<node> best;
    for (int v = -reach; v <= reach; v++) {
        for (int u = -reach; u <= reach; u++) {
            const std::optional<saddle> found = saddle_at(level, about.x + u, about.y + v, radius);
            if (!found || (best && found->contrast <= best->at.contrast)) {
                continue;
            }
            const std::optional<int> turn = fitting_turn(level, cells, where, *found);
            if (turn) {
                best = node{true, *found, *turn};
            }
        }
    }
    return best;
}

std::set<place> open_places(const loose_grid &cells) {
    std::set<place> open;
    for (const auto &[where, ignored] : cells) {
        for (const place &step : steps) {
            const place next = moved(where, step, 1);
            if (cells.count(next) == 0) {
                open.insert(next);
            }
        }
    }
    return open;
}

// Number of corners on each grid line.
std::map<int, int> line_counts(const loose_grid &cells, bool by_row) {
    std::map<int, int> counts;
    for (const auto &[where, ignored] : cells) {
        counts[by_row ? where.row : where.column]++;
    }
    return counts;
}

bool trim_line(loose_grid *cells, bool by_row) {
    INVARIANT(!cells->empty());
    const std::map<int, int> own = line_counts(*cells, by_row);
    const std::map<int, int> other = line_counts(*cells, !by_row);
    const int span = other.rbegin()->first - other.begin()->first + 1;
    for (const auto &end : {*own.begin(), *own.rbegin()}) {
        if (2 * end.second >= span) {
            continue;
        }
        for (auto cell = cells->begin(); cell != cells->end();) {
            const int line = by_row ? cell->first.row : cell->first.column;
            cell = line == end.first ? cells->erase(cell) : std::next(cell);
        }
        return true;
    }
    return false;
}

bool drop_loose_ends(loose_grid *cells) {
    bool dropped = false;
    for (auto cell = cells->begin(); cell != cells->end();) {
        int neighbours = 0;
        for (const place &step : steps) {
            neighbours += static_cast<int>(cells->count(moved(cell->first, step, 1)));
        }
        dropped = dropped || neighbours < 2;
        cell = neighbours < 2 ? cells->erase(cell) : std::next(cell);
    }
    return dropped;
}

}  // namespace

void grow(const plane &level, size_t enough, int *tries, loose_grid *cells) {
    // A failed place is tried again only when its neighbourhood has changed.
    std::map<place, size_t> tried;
    INVARIANT(*tries >= 0);
    bool changed = true;
    while (changed) {
        changed = false;
        for (const place &where : open_places(*cells)) {
            if (cells->size() >= enough || *tries <= 0) {
                return;
            }
            if (std::abs(where.row) > widest || std::abs(where.column) > widest) {
                continue;
            }
            size_t known = 0;
            for (int v = -1; v <= 1; v++) {
                for (int u = -1; u <= 1; u++) {
                    known += cells->count({where.row + v, where.column + u});
                }
            }
            const auto before = tried.find(where);
            if (before != tried.end() && before->second == known) {
                continue;
            }
            tried[where] = known;
            const std::optional<prediction> about = predicted(*cells, where);
            if (!about) {
                continue;
            }
            --*tries;
            INVARIANT(*tries >= 0 && cells->count(where) == 0);
            const std::optional<node> found = node_near(level, *cells, where, *about);
            if (found) {
                (*cells)[where] = *found;
                changed = true;
            }
        }
    }
}

void trim(loose_grid *cells, bool whole_lines) {
    bool changed = true;
    while (changed && !cells->empty()) {
        changed = drop_loose_ends(cells);
        if (!changed && whole_lines) {
            changed = trim_line(cells, true) || trim_line(cells, false);
        }
    }
}

}  // namespace calib::detect
