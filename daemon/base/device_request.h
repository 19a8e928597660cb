// SPDX-License-Identifier: Apache-2.0
/// The type of a request to ioctl().
#ifndef VERGENCE_DAEMON_BASE_DEVICE_REQUEST_H
#define VERGENCE_DAEMON_BASE_DEVICE_REQUEST_H

#include <errno.h>

// errno.h brings the macro that identifies the C library. POSIX and musl have int.
#ifdef __GLIBC__
typedef unsigned long device_request;
#else
typedef int device_request;
#endif

#endif
