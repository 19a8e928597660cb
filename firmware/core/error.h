// SPDX-License-Identifier: Apache-2.0
/// The one list of errors. Every public function that can fail returns an
/// `int`: 0 is success, a negative `enum error_code` says what went wrong.
/// Outputs are untouched on error unless a function says otherwise.
/// The sentence for people (file name, limits, what to do) is made at the edge.
#ifndef VERGENCE_CORE_ERROR_H
#define VERGENCE_CORE_ERROR_H

// X(name, number, text)
#define ERROR_LIST(X)                                                                     \
    X(OK, 0, "no error")                                                                  \
    X(ARGUMENT, -1, "an argument is outside its documented range")                        \
    X(MEMORY, -2, "the working memory is too small")                                      \
    X(SYNTAX, -3, "the text does not follow the grammar")                                 \
    X(RANGE, -4, "a value is outside its legal range")                                    \
    X(MISSING, -5, "a required field is missing")                                         \
    X(DUPLICATE, -6, "a field appears twice")                                             \
    X(CRC, -7, "the checksum does not match the contents")                                \
    X(VERSION, -8, "the format version is not supported")                                 \
    X(BASELINE, -9, "the two cameras have no baseline between them")                      \
    X(ROTATION, -10, "the rotation is not a proper rotation")                             \
    X(DISTORTION, -11, "the distortion folds over in the image's middle")                 \
    X(OVERLAP, -12, "the two cameras share no field of view in the depth range")          \
    X(DEPTH_RANGE, -13, "the depth range is empty")                                       \
    X(DISPARITY_RANGE, -14, "the disparity range is empty or too wide")                   \
    X(TOO_LARGE, -15, "the image is larger than the maximum")                             \
    X(TOO_SMALL, -16, "the image is too small to be matched")                             \
    X(SIZE_MISMATCH, -17, "the images differ in size from each other or the calibration") \
    X(NO_SURFACE, -18, "no surface was found")                                            \
    X(CANCELLED, -19, "cancelled")                                                        \
    X(BUFFER, -20, "the output buffer is too small")                                      \
    X(I2C_NACK, -21, "the device on the I2C bus does not answer")                         \
    X(I2C_ARBITRATION, -22, "something else drove the I2C bus at the same time")          \
    X(I2C_STUCK, -23, "a line of the I2C bus is held low")                                \
    X(TIMEOUT, -24, "the time limit was reached")                                         \
    X(DEVICE, -25, "the device is missing, has gone, or is not the expected one")         \
    X(REFUSED, -26, "the device refused the value")                                       \
    X(VERIFY, -27, "a value that was written does not read back")                         \
    X(UNSUPPORTED, -28, "the hardware cannot do this")                                    \
    X(RESTARTED, -29, "the device has restarted and lost its settings")                   \
    X(IO, -30, "the system could not do it")                                              \
    X(FULL, -31, "there is no room left")                                                 \
    X(JAMMED, -32, "something does not move where it was told to")                        \
    X(NOT_CONNECTED, -33, "this instrument has no such part")                             \
    X(NOT_READY, -34, "the instrument was not brought up, or is in its safe state")       \
    X(MOVED, -35, "the scene or the instrument moved between the two frames")             \
    X(FRAME, -36, "a frame was torn or damaged")                                          \
    X(BUSY, -37, "too much else is waiting to be done")                                   \
    X(MISMATCH, -38, "the calibration was made with other axes, cameras or windows")

enum error_code {
#define ERROR_ENUM(name, number, text) ERROR_##name = (number),
    ERROR_LIST(ERROR_ENUM)
#undef ERROR_ENUM
};

#ifdef __cplusplus
extern "C" {
#endif

/// The text of a code, without a full stop; "unknown error" for any other number.
/// Static storage, never NULL.
const char *error_text(int code);

/// The name of a code, such as "RANGE", for programs; "UNKNOWN" for any other number.
/// Static storage, never NULL.
const char *error_name(int code);

#ifdef __cplusplus
}
#endif

#endif
