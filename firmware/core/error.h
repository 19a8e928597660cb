// SPDX-License-Identifier: Apache-2.0
/// The list of all errors. Every public function that can fail returns an `int`: 0 is success, and
/// a negative `enum error_code` says what went wrong. Outputs are unchanged on error unless a
/// function says otherwise. Messages with details (file name, limits, what to do) are written by
/// the callers.
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
    X(I2C_NACK, -21, "no answer from the device on the I2C bus")                          \
    X(I2C_ARBITRATION, -22, "another device drove the I2C bus at the same time")          \
    X(I2C_STUCK, -23, "I2C bus stuck low")                                                \
    X(TIMEOUT, -24, "the time limit was reached")                                         \
    X(DEVICE, -25, "the device is missing, has gone, or is another one")                  \
    X(REFUSED, -26, "the device rejected the value")                                      \
    X(VERIFY, -27, "a written value does not read back")                                  \
    X(UNSUPPORTED, -28, "the hardware cannot do this")                                    \
    X(RESTARTED, -29, "the device has restarted and lost its settings")                   \
    X(IO, -30, "system error")                                                            \
    X(FULL, -31, "no space left")                                                         \
    X(JAMMED, -32, "a part does not move as commanded")                                   \
    X(NOT_CONNECTED, -33, "this instrument has no such part")                             \
    X(NOT_READY, -34, "the instrument was not brought up, or is in its safe state")       \
    X(MOVED, -35, "the scene or the instrument moved during the pair")                    \
    X(FRAME, -36, "a frame was incomplete or damaged")                                    \
    X(BUSY, -37, "too many pending requests")                                             \
    X(MISMATCH, -38, "the calibration was made with other axes, cameras or windows")      \
    X(NO_FOCUS, -39, "no focus was found")

enum error_code {
#define ERROR_ENUM(name, number, text) ERROR_##name = (number),
    ERROR_LIST(ERROR_ENUM)
#undef ERROR_ENUM
};

#ifdef __cplusplus
extern "C" {
#endif

/// Text of a code, without a full stop; "unknown error" for any other number. Static storage, never
/// NULL.
const char *error_text(int code);

/// Name of a code for programs, such as "RANGE"; "UNKNOWN" for any other number. Static storage,
/// never NULL.
const char *error_name(int code);

#ifdef __cplusplus
}
#endif

#endif
