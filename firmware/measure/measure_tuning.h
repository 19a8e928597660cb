// SPDX-License-Identifier: Apache-2.0
/// The tuned numbers of a measurement.
#ifndef VERGENCE_MEASURE_MEASURE_TUNING_H
#define VERGENCE_MEASURE_MEASURE_TUNING_H

/// f-number of the wide view, whatever its depth. At 8.5 mm everything from 1 m on is then within
/// 2.5 px of blur of a focus at 1.8 m, and the coarse surface has a quarter of the pixels. Larger:
/// more depth, longer exposures.
#define MEASURE_WIDE_F_NUMBER 4.0

/// A subject without a wish for its size gets a field so many times as wide.
#define MEASURE_SUBJECT_MARGIN 1.25

/// Least part of the view around the subject that is good enough: its square is what is left of the
/// density that the subject could have. Larger: more aims, of which each takes 4 s with its pair.
#define MEASURE_CENTRED_MIN 0.8
/// Most aims: each comes to rest elsewhere by the servos' repeatability.
enum { MEASURE_AIMS_MAX = 3 };

/// Blur at which an image counts as sharp, px: RIG_OPTICS_SHARP_PX.
#define MEASURE_SHARP_PX 1.0
/// Blur of the worse end from which on the result has lost something, px.
#define MEASURE_BLURRED_PX 2.0
/// A lens that comes to rest farther than this from where it is to focus is sent again, so many
/// times at most. At 85 mm and f/11 each count blurs by 0.5 px. Smaller: more moves, of 2 s each.
#define MEASURE_FOCUS_COUNTS 1.5
enum { MEASURE_FOCUS_TRIES = 2 };

/// Least depth to be sharp behind the subject's middle, part of its own dioptres.
#define MEASURE_BEHIND_MIN 0.02

/// f-number, relative to the least that makes exposures long enough for steady light. Larger: less
/// light; smaller: an error of the f-numbers makes lamps flicker.
#define MEASURE_STEADY_MARGIN 1.05

/// Error of a disparity on texture, px, as the figures of the simulated rig have it: 0.07 (1x) to
/// 0.09 (3x).
#define MEASURE_DISPARITY_PX 0.1

/// Depth that is searched beyond the subject's, part of its distance. Larger: longer matching, and
/// more that can be mistaken; smaller: what the coarse surface missed is lost.
#define MEASURE_SEARCH_MARGIN 0.1

/// Behind the subject the search continues as far as so many disparities reach, and no farther than
/// this. More: longer matching, and more memory.
#define MEASURE_SEARCH_PX 512
#define MEASURE_SEARCH_FAR_MM 20000.0

/// Mean over its target below which a picture is too dark to be measured well.
#define MEASURE_DARK_REACHED 0.5
/// Dark part of the subject from which several exposures are worth their time; less: a mean of
/// several frames, which is measured a little more of at any brightness.
#define MEASURE_DARK_PART_MIN 0.03
/// The best in dark parts, and what is nearly as good without a bridge: daemon/RESULTS.md.
enum { MEASURE_BRACKET_FRAMES = 4, MEASURE_AVERAGE_FRAMES = 8 };
/// Duration of a bracket of both cameras in exposures of the single pair, as taken on the simulated
/// rig: the last one is 16 to 27 times as long; and of an average.
#define MEASURE_BRACKET_EXPOSURES 100.0
#define MEASURE_AVERAGE_EXPOSURES (2.0 * MEASURE_AVERAGE_FRAMES)

/// Least ratio of the focal lengths of two pairs that help each other: that of wide_pair.c.
#define MEASURE_RATIO_MIN 1.3
/// A pair of less than so many times the smallest focal length is helped by a longer one,
/// MEASURE_LONGER_FACTOR times the smallest; any other by the widest. Longer: less in common, and
/// easily out of focus. Expected of fit=1000, 600, 500 and 360 mm at 1.8 m (1.4x, 2.3x, 2.8x,
/// 3.8x): 8.7, 4.3, 3.9, 2.9 mm with the widest, 2.4, 3.0, 3.4, 4.6 mm with 5x.
#define MEASURE_LONGER_BELOW 2.5
#define MEASURE_LONGER_FACTOR 5.0

/// Points that the pictures of a pair usually have in common and the standard deviation of one
/// coordinate, px; of those of the narrower of two pairs, the part that the wider one shows too,
/// and by how much they are noisier there: calib/zoom/RESULTS.md, rendered pairs. For what is
/// expected of a pair before it is taken.
enum { MEASURE_MATCHES = 450, MEASURE_MATCHES_MAX = 1024 };
#define MEASURE_MATCH_PX 0.065
#define MEASURE_CARRIED_PART 0.6
#define MEASURE_CARRIED_NOISE 1.4
/// Corners of the board of the demo, whose squares have so many mm, and the standard deviation of
/// one coordinate of a corner, px.
enum { MEASURE_BOARD_COLUMNS = 10, MEASURE_BOARD_ROWS = 7 };
#define MEASURE_BOARD_SQUARE_MM 24.0
#define MEASURE_CORNER_PX 0.05
/// What is advised must reduce the common error to this part of it at least.
#define MEASURE_ADVICE_GAIN 0.8

/// A distance to look at where none is known, mm.
#define MEASURE_ANY_DISTANCE_MM 2000.0

/// A pair that something moved in is taken so many times more.
enum { MEASURE_MOVED_TRIES = 1 };

/// Size of the pictures that a surface is computed from, of frames with one colour a pixel, which
/// have no more detail in two of three. On the cylinder at 2x to 4x it measures 98 to 99 % instead
/// of 80 to 87 %, each point better (0.23 instead of 0.32 mm), and with errors as predicted; at a
/// quarter the share of wrong points doubles: tests/study/experiments/RESULTS.md.
#define MEASURE_MOSAIC_SCALE 0.5

/// An error that all points share and that is so many times theirs is worth a board; below this
/// share of the subject texture is what is missing.
#define MEASURE_COMMON_FACTOR 3.0
#define MEASURE_SHARE_MIN 0.8
/// Points whose error is this part of their distance show nothing but that something is far away.
#define MEASURE_FAR_PART 0.1
/// Share of the subject from which on its holes are few, and their reason is not stated.
#define MEASURE_SHARE_WHOLE 0.97

#endif
