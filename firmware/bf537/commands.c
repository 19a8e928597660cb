// SPDX-License-Identifier: Apache-2.0
#include "bf537/commands.h"

#include "bf537/clock.h"
#include "bf537/console.h"
#include "bf537/fault.h"
#include "console/line/commands_help.h"
#include "core/error.h"
#include "memory/calibration.h"
#include "memory/files.h"
#include "memory/host.h"
#include "memory/measure.h"
#include "memory/pair.h"
#include "memory/reconstruct.h"

enum { COMMANDS_MAX = 48 };

static const double us_per_s = 1e6;

static int run_board(const struct command_call *call) {
    const struct bf537_console *console = call->context;
    reply_text(call, "started", bf537_fault_last());
    reply_number(call, "up", (double)bf537_now_us() / us_per_s, 1, "s");
    const struct bf537_stack stack = bf537_stack(), l1_stack = bf537_l1_stack();
    reply_number(call, "stack", (double)stack.bytes, 0, "bytes");
    reply_number(call, "stack_used", (double)stack.used_bytes, 0, "bytes");
    reply_number(call, "l1_stack", (double)l1_stack.bytes, 0, "bytes");
    reply_number(call, "l1_stack_used", (double)l1_stack.used_bytes, 0, "bytes");
    reply_number(call, "console_overruns", (double)console->serial->lost, 0, NULL);
    return ERROR_OK;
}

static const struct command *board_table(size_t *count) {
    static const struct command commands[] = {
        {.name = "board",
         .summary = "show why the board was started, and the deepest use of its stacks",
         .help = "After a fault, \"started\" is the reason that was reported then.",
         .flags = COMMAND_NO_RIG,
         .run = run_board},
    };
    *count = sizeof commands / sizeof commands[0];
    return commands;
}

struct command_table bf537_commands(void) {
    static const struct command *(*const tables[])(size_t *) = {board_table,
                                                                memory_files_table,
                                                                memory_pair_table,
                                                                memory_calibration_table,
                                                                memory_reconstruct_table,
                                                                memory_measure_table,
                                                                command_help_table,
                                                                memory_rig_table};
    static struct command all[COMMANDS_MAX];
    return command_join(tables, sizeof tables / sizeof tables[0], all, COMMANDS_MAX);
}
