// SPDX-License-Identifier: Apache-2.0
/// What an instrument has learned about its lenses, in addition to their data sheet: two tables for
/// each lens, and where the present object is. Pure: the values come from the caller.
///
/// The zoom-to-focus table holds by how much the focus of this lens differs from the nominal one at
/// some zooms, because no zoom lens keeps its focus quite while it zooms. Its entries come from
/// focusing on an object that stays where it is: after the first, each entry is known relative to
/// the others, so that from one focused zoom the focus at the others follows, at any distance of
/// the object. All positions are 1/16 count; "object" is the focus position that a nominal lens
/// would have for it.
///
/// An object may have moved since the last time, or be another one. A difference within three
/// standard deviations is divided between table and object by their variances (the scalar step of a
/// Kalman filter); a larger one is a new object. If the next entry then sees another new object,
/// one of both entries may be wrong instead: that one's standard deviation is doubled.
#ifndef VERGENCE_FOCUS_LENS_LEARNED_H
#define VERGENCE_FOCUS_LENS_LEARNED_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    LENS_POINTS_MAX = 16,
    /// Standard deviation of the table where nothing is known (1/16 count).
    LENS_PRIOR_Q4 = 8 * 16,
    LENS_RATIO_ONE = 1000,  ///< f-number relative to open, 1/1000
};

/// An entry: the value at a ring's position, its standard deviation, and how often it was measured.
struct lens_point {
    int32_t at;
    int32_t value;
    uint16_t sigma;
    uint16_t count;
};

/// A table, in ascending order of `at`, each position once. All 0: empty.
struct lens_table {
    struct lens_point point[LENS_POINTS_MAX];
    uint32_t count;
};

/// The object that was last focused on.
struct lens_object {
    bool known;
    int32_t position_q4;
    uint16_t sigma_q4;
    bool is_new;  ///< the last focusing, at `zoom` of `lens`, did not find it where it was before
    int32_t zoom;
    uint8_t lens;
};

/// The tables of one lens. All 0: nothing learned.
struct lens_learned {
    struct lens_table focus;  ///< focus minus nominal focus at a zoom position, 1/16 count
    struct lens_table iris;   ///< f-number relative to open at an iris position, 1/1000
};

/// Whether a table is as described: for one that comes from outside.
bool lens_table_is_valid(const struct lens_table *table);

/// Value at a position, linear between the entries; beyond the first and last, theirs. false: the
/// table is empty.
bool lens_table_value(const struct lens_table *table, double at, double *value);

/// Position of a value in a table that descends (as that of an iris); false: empty, or outside.
bool lens_table_position(const struct lens_table *table, double value, double *at);

/// Puts an entry into the table, in place of one at the same position. If the table is full, the
/// two entries that are closest to each other are merged first.
void lens_table_put(struct lens_table *table, const struct lens_point *point);

/// Deviation from the nominal focus at a zoom, and its standard deviation, which grows with the
/// distance from the entries, to LENS_PRIOR_Q4. `span`: range of the zoom. 1/16 count.
void lens_learned_deviation(const struct lens_table *table, int32_t zoom, int32_t span,
                            double *deviation_q4, double *sigma_q4);

/// A lens was focused at a zoom and found the object at a position, with this standard deviation.
/// `lens`: whose table it is. `distance_q4`: the nominal position of the object's distance if that
/// was measured, else INT32_MIN. Returns whether it is the object of the last time.
bool lens_learned_focus(struct lens_table *table, uint8_t lens, struct lens_object *object,
                        int32_t zoom, int32_t span, int32_t position_q4, uint16_t sigma_q4,
                        int32_t distance_q4);

#ifdef __cplusplus
}
#endif

#endif
