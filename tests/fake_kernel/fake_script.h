// SPDX-License-Identifier: Apache-2.0
/// The fake kernel in a program that knows nothing of it: LD_PRELOAD names the library, and
/// VERGENCE_FAKE_KERNEL a file of lines that are followed at start. Time is real, but for
/// `rig`.
///
///     video PATH FORMAT PICTURE FRAME_US [WIDTHxHEIGHT]
///                          a camera that shows PICTURE (fake_picture.h); FORMAT: GREY, YUYV,
///                          SGRBG10 or MJPEG, the last with a size
///     set PATH KEY VALUE   of a camera: first_us, phase_us, damage_every, lose_every,
///                          readout_us, as in fake_video.h
///     trigger PATH [LINE]  the camera gives a frame when that line of the chip goes high, else
///                          none; without LINE its input hangs on nothing
///     plug PATH FILE       the device is connected while FILE is there; files that are open when
///                          it goes stay dead
///     i2c PATH ADDRESS     a bus with one device of 256 registers
///     gpio PATH            a chip with 8 lines
///     rig WHERE            a simulated rig that runs there (unix:PATH, tcp:HOST:PORT) stands
///                          behind the devices of the next four lines, and the time is its
///                          (fake_rig.h)
///     rig i2c PATH         its bus
///     rig video PATH       its port
///     rig serial PATH      the line to its lens controller
///     rig gpio PATH RESET IRQ      its two lines, with their numbers at that chip
///     watchdog PATH [MOST_S]   a watchdog of 60 s, or of no more than MOST_S
///     watch PREFIX         real files under PREFIX are seen
///     fail NTH TIMES ERRNO WHAT    as fake_kernel_fail; ERRNO as in errno.h, or a number
///     kill NTH WHAT        as fake_kernel_kill
///     hang NTH WHAT        as fake_kernel_hang
///     slow MS WHAT         as fake_kernel_slow
///     record FILE          every line of the record is appended to FILE as it comes
///     # ...                a remark
///
/// WHAT is the rest of the line and may be missing: all. A line that is wrong ends the program.
#ifndef VERGENCE_TESTS_FAKE_SCRIPT_H
#define VERGENCE_TESTS_FAKE_SCRIPT_H

/// Follows the lines of a file.
void fake_script_run(const char *path);

#endif
