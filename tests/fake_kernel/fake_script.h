// SPDX-License-Identifier: Apache-2.0
/// The fake kernel in an unmodified program: LD_PRELOAD names the library, and VERGENCE_FAKE_KERNEL
/// a script that is run at start. Time is real.
///
///     video PATH FORMAT PICTURE FRAME_US [WIDTHxHEIGHT]
///                          a camera that shows PICTURE (fake_picture.h); FORMAT: GREY, YUYV,
///                          SGRBG10 or MJPEG, the last with a size
///     set PATH KEY VALUE   of a camera: first_us, phase_us, damage_every, lose_every,
///                          readout_us, bright_at, as in fake_video.h
///     trigger PATH [LINE]  the camera takes a frame only when that line of the chip goes high;
///                          without LINE its input is not connected
///     plug PATH FILE       the device is connected while FILE exists; files that are open when
///                          it disappears stay dead
///     i2c PATH ADDRESS     a bus with one device of 256 registers
///     gpio PATH            a chip with 8 lines
///     watchdog PATH [MOST_S]   a watchdog with a period of 60 s, or at most MOST_S
///     mtd NAME FILE BLOCK [worn]   the next partition of flash, with the file's contents
///     watch PREFIX         handles real files under PREFIX
///     fail NTH TIMES ERRNO WHAT    as fake_kernel_fail; ERRNO as in errno.h, or a number
///     kill NTH WHAT        as fake_kernel_kill
///     hang NTH WHAT        as fake_kernel_hang
///     slow MS WHAT         as fake_kernel_slow
///     record FILE          appends every line of the record to FILE
///     # ...                a comment
///
/// WHAT is the rest of the line; default: all calls. An invalid line ends the program.
#ifndef VERGENCE_TESTS_FAKE_SCRIPT_H
#define VERGENCE_TESTS_FAKE_SCRIPT_H

/// Runs the script in a file.
void fake_script_run(const char *path);

#endif
