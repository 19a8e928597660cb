# SPDX-License-Identifier: Apache-2.0
"""What is proved: which functions, against which errors, with how many goals at least."""
import collections

# `min_goals`: fewer mean that something is missing from the proof.
Claim = collections.namedtuple("Claim", "name functions checks min_goals")

# In addition to the checks of -wp-rte: overflow of signed numbers, shifts, division by zero, bounds
# of arrays, reads and writes of memory.
CHECKS = [
    "-warn-right-shift-negative",
    # Contracts must not contradict themselves: then anything could be proved.
    "-wp-smoke-tests", "-wp-no-smoke-dead-code", "-wp-no-smoke-dead-call",
]

VECTORS = [
    "lower_u8", "vector_load", "vector_store", "vector_each", "vector_all", "vector_shares_each",
    "vector_min", "vector_add", "vector_sub", "vector_or", "vector_up", "vector_down",
    "vector_blend", "vector_lowest", "vector_first", "vector_equal", "count_bits", "vector_cost",
]
SMALL = [
    "match_share_of", "match_share_between", "match_weight", "match_weight_down", "match_carry",
    "match_p2", "match_least_p2", "match_step", "match_same_window", "match_rise", "match_cell",
    "match_guide", "match_span", "match_tile_columns", "match_range_ends", "match_realign",
    "match_copy_cells",
    "match_accepts", "image_u8_row", "image_i32_row",
]
MESSAGES = [
    "load_lanes", "store_lanes", "lower_neighbour", "move_lanes", "shear", "shear_average",
    "add_path_cost",
]
FEATURES = ["census_plane", "gradient_row", "reverse_feature"]
COSTS = ["tile_costs", "average_forward", "average_backward", "enter_tile_with_averages"]
COLUMNS = [
    "ring_slot", "steps_above", "weights_above", "ring_cells", "blend_leaning", "member_cells", "member_shares",
    "average_up",
    "carry_up", "realign_columns", "pass_down", "carry_down",
]
ROWS = [
    "searched", "hide_outside", "first_lowest", "choose", "pass_right", "pass_left",
    "enter_tile_with_path_costs", "hides", "prepare_line",
]
JUDGEMENTS = [
    "record_winners", "widen", "measure_contrast", "write_surface", "margin_min_at",
    "write_reasons", "write_confidence", "compute_disparities", "smooth_along",
]
FINISH = ["median_of_three", "smooth_row", "fill_between"]
# Functions that truncate numbers, or let them wrap, on purpose.
CUT = ["match_share_swapped", "sub_pixel_q8", "check_claims", "check_fits"]

ALL_CHECKS = [*CHECKS, "-warn-unsigned-overflow", "-warn-signed-downcast",
              "-warn-unsigned-downcast"]
CLAIMS = [
    Claim("lemmas", [], [], 1),
    Claim("vectors", VECTORS, ALL_CHECKS, 370),
    Claim("small functions", SMALL, ALL_CHECKS, 310),
    Claim("cut on purpose", CUT, CHECKS, 107),
    Claim("messages", MESSAGES, ALL_CHECKS, 125),
    Claim("features", FEATURES, ALL_CHECKS, 130),
    Claim("costs", COSTS, ALL_CHECKS, 399),
    Claim("columns", COLUMNS, ALL_CHECKS, 392),
    Claim("rows", ROWS, ALL_CHECKS, 555),
    Claim("judgements", JUDGEMENTS, ALL_CHECKS, 402),
    Claim("finish", FINISH, ALL_CHECKS, 57),
]

# Statements in the sources that are trusted without proof.
TRUSTED = ["admit copied"] * 4

# Mistakes: file, text, its replacement, the function whose proof must fail.
MUTANTS = [
    ("vector_plain.h", "here.lane[i + 1];\n    }", "here.lane[i + 2];\n    }", "vector_down"),
    ("vector_plain.h", "TUNE_CENSUS_WEIGHT * differing", "11 * differing", "vector_cost"),
    ("vector_plain.h", "twos - ((twos >> 1) & 0x55)", "twos - ((twos >> 1) & 0x54)",
     "count_bits"),
    ("aggregation.h", "i < 7; i++", "i < 8; i++", "match_share_between"),
    ("aggregation.h", "TUNE_EDGE_STEP - capped)", "TUNE_EDGE_STEP + 1 - capped)", "match_weight"),
    ("lanes.h", "k + 1 < lanes / MATCH_LANES ?", "k + 1 <= lanes / MATCH_LANES ?",
     "lower_neighbour"),
    ("lanes.h", "(ptrdiff_t)(c + member) * lanes", "(ptrdiff_t)(c + member + 1) * lanes",
     "member_cells"),
    ("cost.h", "first - x + i)", "first - x + i + 1)", "tile_costs"),
    ("aggregation.h", "tile->offset + (ptrdiff_t)columns * lanes",
     "tile->offset + (ptrdiff_t)(columns + 1) * lanes", "average_backward"),
    ("selection.h", "end > i + MATCH_LANES ? MATCH_LANES : end - i",
     "end > i + MATCH_LANES ? end : end - i", "hide_outside"),
    ("selection.h", "near_lanes + NEAR_MIDDLE - lane[r]",
     "near_lanes + NEAR_MIDDLE + MATCH_LANES - lane[r]", "choose"),
    ("lanes.h", "i + MATCH_LANES <= beyond ? i : beyond - MATCH_LANES",
     "i + MATCH_LANES <= beyond ? i : beyond - MATCH_LANES + 1", "match_realign"),
    ("validation.h", "loop invariant 1 <= x <= \\max(width - 1, 1)",
     "loop invariant x <= \\max(width - 1, 1)", "smooth_along"),
    ("selection.h", "lane > begin && lane + 1 < end", "lane > begin && lane + 1 <= end",
     "record_winners"),
    ("validation.h", "span.begin + half < span.end ?", "span.begin + half <= span.end + 1 ?",
     "measure_contrast"),
    ("validation.h", "requires \\valid_read(next + (0 .. columns - 1));\n",
     "requires \\valid_read(next + (0 .. columns - 2));\n", "smooth_row"),
]
