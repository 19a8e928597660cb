// SPDX-License-Identifier: Apache-2.0
#include "fake_video_names.h"

#include <linux/videodev2.h>
#include <stdio.h>

static void describe_format(const struct v4l2_format *format, char *line, size_t bytes) {
    const unsigned code = format->fmt.pix.pixelformat;
    snprintf(line, bytes, "S_FMT %c%c%c%c %ux%u", code & 0xFF, code >> 8 & 0xFF, code >> 16 & 0xFF,
             code >> 24 & 0xFF, format->fmt.pix.width, format->fmt.pix.height);
}

static void describe_control(const char *name, const void *argument, char *line, size_t bytes) {
    const struct v4l2_control *control = argument;
    snprintf(line, bytes, "%s 0x%x = %d", name, control->id, control->value);
}

void fake_video_describe(struct fake_file *file, unsigned long request, const void *argument,
                         char *line, size_t bytes) {
    (void)file;
    switch (request) {
        case VIDIOC_QUERYCAP:
            snprintf(line, bytes, "QUERYCAP");
            break;
        case VIDIOC_S_FMT:
            describe_format(argument, line, bytes);
            break;
        case VIDIOC_G_PARM:
            snprintf(line, bytes, "G_PARM");
            break;
        case VIDIOC_REQBUFS:
            snprintf(line, bytes, "REQBUFS %u",
                     ((const struct v4l2_requestbuffers *)argument)->count);
            break;
        case VIDIOC_QUERYBUF:
            snprintf(line, bytes, "QUERYBUF %u", ((const struct v4l2_buffer *)argument)->index);
            break;
        case VIDIOC_QBUF:
            snprintf(line, bytes, "QBUF %u", ((const struct v4l2_buffer *)argument)->index);
            break;
        case VIDIOC_DQBUF:
            snprintf(line, bytes, "DQBUF");
            break;
        case VIDIOC_STREAMON:
            snprintf(line, bytes, "STREAMON");
            break;
        case VIDIOC_STREAMOFF:
            snprintf(line, bytes, "STREAMOFF");
            break;
        case VIDIOC_QUERYCTRL:
            snprintf(line, bytes, "QUERYCTRL 0x%x", ((const struct v4l2_queryctrl *)argument)->id);
            break;
        case VIDIOC_S_CTRL:
            describe_control("S_CTRL", argument, line, bytes);
            break;
        case VIDIOC_G_CTRL:
            snprintf(line, bytes, "G_CTRL 0x%x", ((const struct v4l2_control *)argument)->id);
            break;
        default:
            break;
    }
}
