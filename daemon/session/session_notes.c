// SPDX-License-Identifier: Apache-2.0
#include "daemon/session/session_notes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/error.h"
#include "daemon/session/session_read.h"

/// What follows `lead` at the beginning of a text; NULL: it begins differently.
static const char *after(const char *text, const char *lead) {
    const size_t length = strlen(lead);
    return strncmp(text, lead, length) == 0 ? text + length : NULL;
}

static void add_step(struct session_notes *notes, const char *text) {
    const size_t used = strlen(notes->steps);
    if (used + strlen(text) + 2 <= sizeof notes->steps) {
        snprintf(notes->steps + used, sizeof notes->steps - used, "%s\n", text);
    }
}

/// A request begins another measurement; `whole` keeps the one before if it came as far as its
/// surface. Returns whether it is a request.
static bool take_note(struct session_notes *notes, struct session_notes *whole, const char *text) {
    const char *words = after(text, SESSION_NOTE_MEASURE);
    const char *step = after(text, SESSION_NOTE_STEP);
    const char *surface = after(text, SESSION_NOTE_SURFACE);
    if (step != NULL) {
        add_step(notes, step);
    } else if (surface != NULL) {
        snprintf(notes->surface, sizeof notes->surface, "%s", surface);
    } else if (words != NULL) {
        if (notes->surface[0] != '\0') {
            *whole = *notes;
        }
        notes->surface[0] = notes->steps[0] = '\0';
        snprintf(notes->request, sizeof notes->request, "%s", words);
    }
    return words != NULL;
}

int session_notes_read(int parent, const char *path, struct session_notes *notes,
                       struct message *message) {
    struct session_reader reader;
    struct session_event *event = malloc(sizeof *event);
    struct session_notes *whole = calloc(1, sizeof *whole);
    notes->request[0] = notes->surface[0] = notes->steps[0] = '\0';
    if (event == NULL || whole == NULL) {
        free(event);
        free(whole);
        return message_set(message, ERROR_MEMORY, "%s: out of memory", path);
    }
    int got = session_reader_open(&reader, parent, path, event, message);
    if (got == ERROR_OK) {
        int measured = 0;
        while ((got = session_reader_next(&reader, event, message)) == 1) {
            if (event->kind == SESSION_COMMAND && take_note(notes, whole, event->text)) {
                measured = 1;
            }
        }
        session_reader_close(&reader);
        got = got == 0 ? measured : got;
    }
    if (notes->surface[0] == '\0' && whole->surface[0] != '\0') {
        *notes = *whole;
    }
    free(whole);
    free(event);
    return got;
}
