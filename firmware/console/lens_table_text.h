// SPDX-License-Identifier: Apache-2.0
/// Tables of what was learned about a lens as text, as in commands and saved settings:
/// AT:VALUE:SIGMA:TIMES,... with the position AT in counts. VALUE and SIGMA of the zoom-to-focus
/// table are counts, of the iris f-numbers relative to open. "none": an empty table.
#ifndef VERGENCE_CONSOLE_LENS_TABLE_TEXT_H
#define VERGENCE_CONSOLE_LENS_TABLE_TEXT_H

#include <stdbool.h>

#include "console/command_text.h"
#include "focus/lens_learned.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { LENS_TABLE_TEXT_BYTES = 480 };  ///< longer than any table

/// What the integers of a table count.
enum lens_table_kind { LENS_TABLE_FOCUS, LENS_TABLE_IRIS };

void lens_table_print(enum lens_table_kind kind, const struct lens_table *table,
                      struct command_text *text);
/// false: not such a table; `*table` is then unchanged.
bool lens_table_parse(enum lens_table_kind kind, const char *text, struct lens_table *table);

/// The object: FOCUS:SIGMA in counts, or "none".
void lens_object_print(const struct lens_object *object, struct command_text *text);
bool lens_object_parse(const char *text, struct lens_object *object);

#ifdef __cplusplus
}
#endif

#endif
