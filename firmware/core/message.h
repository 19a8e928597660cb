// SPDX-License-Identifier: Apache-2.0
/// One line for people: what is wrong and what to do about it.
#ifndef VERGENCE_CORE_MESSAGE_H
#define VERGENCE_CORE_MESSAGE_H

enum { MESSAGE_BYTES = 1024 };

struct message {
    char text[MESSAGE_BYTES];  // zero-terminated, without a line feed; truncated when too long
};

#endif
