// SPDX-License-Identifier: GPL-2.0-only
// A V4L2 camera whose frames come over port 0 of a virtio console device, see README.md. It is the
// driver of that device, so that frames go straight from the port into the buffers of videobuf2.
#include <linux/delay.h>
#include <linux/ktime.h>
#include <linux/module.h>
#include <linux/poll.h>
#include <linux/slab.h>
#include <linux/virtio.h>
#include <linux/virtio_config.h>
#include <linux/virtio_ids.h>
#include <linux/workqueue.h>
#include <media/v4l2-common.h>
#include <media/v4l2-device.h>
#include <media/v4l2-ioctl.h>
#include <media/videobuf2-v4l2.h>
#include <media/videobuf2-vmalloc.h>

// The whole array of the sensor, with its dark columns and rows.
#define WIDTH_MAX 2112U
#define HEIGHT_MAX 1568U
// QEMU fills a buffer of a console's queue with at most 4 KiB.
#define RX_BYTES PAGE_SIZE
#define RX_BUFFERS 32
#define FRAME_MAGIC 0x4d415246U /* "FRAM" */

// To the host. All numbers are little endian, times are CLOCK_MONOTONIC.
enum message_kind {
    MESSAGE_ASK = 1,   // a program waits for the next whole frame of this size
    MESSAGE_CANCEL,    // no program waits any more
    MESSAGE_RECEIVED,  // the frame has arrived: only the time is news
};

struct message {
    __le32 kind;
    __le32 number;  // number of the request, counted from 1
    __le16 width, height;
    __le32 reserved;
    __le64 now_us;
};

// From the host, followed by `bytes` of pixels.
struct frame_head {
    __le32 magic;
    __le32 number;  // number of the request that this frame answers
    __le32 bytes;
    __le32 damaged;  // 1: lines or rows are missing
    __le64 begin_us, end_us;
};

struct camera_buffer {
    struct vb2_v4l2_buffer vb;  // first, as videobuf2 requires
    struct list_head link;
};

struct bench_camera {
    struct v4l2_device v4l2;
    struct video_device video;
    struct vb2_queue queue;
    struct mutex lock;  // ioctl and queue
    struct v4l2_pix_format format;
    struct virtio_device *device;
    struct virtqueue *rx, *tx;
    void *rx_pages[RX_BUFFERS];
    struct work_struct work;
    struct mutex port_lock;  // all below, and tx; taken inside `lock`
    bool gone;               // no device any more
    bool streaming, asked;
    u32 number, sequence;
    struct list_head waiting;
    struct frame_head head;
    size_t head_bytes, left;  // received of the head; missing of the pixels
    struct camera_buffer *filling;
};

// ---- the port

static u64 now_us(void) {
    return div_u64(ktime_get_ns(), NSEC_PER_USEC);
}

static void send(struct bench_camera *camera, enum message_kind kind) {
    struct message *message;
    struct scatterlist sg;
    unsigned int length;
    lockdep_assert_held(&camera->port_lock);
    if (camera->gone) {
        return;
    }
    while ((message = virtqueue_get_buf(camera->tx, &length)) != NULL) {
        kfree(message);
    }
    message = kzalloc(sizeof(*message), GFP_KERNEL);
    if (!message) {
        return;
    }
    message->kind = cpu_to_le32(kind);
    message->number = cpu_to_le32(camera->number);
    message->width = cpu_to_le16(camera->format.width);
    message->height = cpu_to_le16(camera->format.height);
    message->now_us = cpu_to_le64(now_us());
    sg_init_one(&sg, message, sizeof(*message));
    if (virtqueue_add_outbuf(camera->tx, &sg, 1, message, GFP_KERNEL) < 0) {
        kfree(message);
        return;
    }
    virtqueue_kick(camera->tx);
}

/// Requests one frame, unless one is on its way or no buffer waits for it.
static void ask(struct bench_camera *camera) {
    mutex_lock(&camera->port_lock);
    if (camera->streaming && !camera->asked && !list_empty(&camera->waiting)) {
        camera->asked = true;
        camera->number++;
        send(camera, MESSAGE_ASK);
    }
    mutex_unlock(&camera->port_lock);
}

/// Chooses the buffer of the frame that begins now; unwanted frames are received without one.
static void begin_frame(struct bench_camera *camera) {
    // After a reset the rest of an old frame may come first. The magic does not occur in it, as it
    // is larger than any two pixels of 10 bits.
    if (le32_to_cpu(camera->head.magic) != FRAME_MAGIC) {
        camera->head_bytes--;
        memmove(&camera->head, (u8 *)&camera->head + 1, camera->head_bytes);
        return;
    }
    camera->left = le32_to_cpu(camera->head.bytes);
    if (camera->streaming && camera->asked && !list_empty(&camera->waiting) &&
        le32_to_cpu(camera->head.number) == camera->number &&
        camera->left == camera->format.sizeimage) {
        camera->filling = list_first_entry(&camera->waiting, struct camera_buffer, link);
        list_del(&camera->filling->link);
    }
}

/// Takes the next part of head or pixels from received bytes; returns how many.
static size_t receive(struct bench_camera *camera, const u8 *data, size_t bytes) {
    size_t part;
    if (camera->head_bytes < sizeof(camera->head)) {
        part = min(bytes, sizeof(camera->head) - camera->head_bytes);
        memcpy((u8 *)&camera->head + camera->head_bytes, data, part);
        camera->head_bytes += part;
        if (camera->head_bytes == sizeof(camera->head)) {
            begin_frame(camera);
        }
    } else {
        part = min(bytes, camera->left);
        if (camera->filling) {
            u8 *pixels = vb2_plane_vaddr(&camera->filling->vb.vb2_buf, 0);
            memcpy(pixels + camera->format.sizeimage - camera->left, data, part);
        }
        camera->left -= part;
    }
    return part;
}

/// Gives a received frame to who waits, not before its last pixel would be there.
static void finish_frame(struct bench_camera *camera) {
    const u64 end_us = le64_to_cpu(camera->head.end_us);
    u64 now;
    lockdep_assert_held(&camera->port_lock);
    camera->head_bytes = 0;
    if (!camera->filling) {
        return;
    }
    send(camera, MESSAGE_RECEIVED);
    now = now_us();
    if (end_us > now && end_us - now < USEC_PER_SEC) {
        mutex_unlock(&camera->port_lock);
        usleep_range(end_us - now, end_us - now + 50);
        mutex_lock(&camera->port_lock);
    }
    // The stream may have ended meanwhile and taken the buffer back.
    if (camera->filling) {
        struct vb2_v4l2_buffer *vb = &camera->filling->vb;
        vb->sequence = camera->sequence++;
        vb->field = V4L2_FIELD_NONE;
        vb->vb2_buf.timestamp = le64_to_cpu(camera->head.begin_us) * NSEC_PER_USEC;
        vb2_set_plane_payload(&vb->vb2_buf, 0, camera->format.sizeimage);
        camera->filling = NULL;
        camera->asked = false;
        vb2_buffer_done(&vb->vb2_buf, le32_to_cpu(camera->head.damaged) != 0 ? VB2_BUF_STATE_ERROR
                                                                             : VB2_BUF_STATE_DONE);
    }
}

static void lend_page(struct bench_camera *camera, void *page) {
    struct scatterlist sg;
    sg_init_one(&sg, page, RX_BYTES);
    // There is room: no more pages are lent than the queue has entries.
    WARN_ON(virtqueue_add_inbuf(camera->rx, &sg, 1, page, GFP_KERNEL) < 0);
}

static void work(struct work_struct *work) {
    struct bench_camera *camera = container_of(work, struct bench_camera, work);
    unsigned int length;
    u8 *page;
    mutex_lock(&camera->port_lock);
    do {
        virtqueue_disable_cb(camera->rx);
        while (!camera->gone && (page = virtqueue_get_buf(camera->rx, &length)) != NULL) {
            const size_t bytes = min_t(size_t, length, RX_BYTES);
            size_t used = 0;
            while (used < bytes && !camera->gone) {
                used += receive(camera, page + used, bytes - used);
                if (camera->head_bytes == sizeof(camera->head) && camera->left == 0) {
                    finish_frame(camera);
                }
            }
            lend_page(camera, page);
        }
        virtqueue_kick(camera->rx);
    } while (!camera->gone && !virtqueue_enable_cb(camera->rx));
    mutex_unlock(&camera->port_lock);
}

static void bytes_arrived(struct virtqueue *queue) {
    schedule_work(&((struct bench_camera *)queue->vdev->priv)->work);
}

// ---- buffers

static int queue_setup(struct vb2_queue *queue, unsigned int *buffers, unsigned int *planes,
                       unsigned int sizes[], struct device *devices[]) {
    *planes = 1;
    sizes[0] = ((const struct bench_camera *)vb2_get_drv_priv(queue))->format.sizeimage;
    return 0;
}

static void buffer_queue(struct vb2_buffer *buffer) {
    struct bench_camera *camera = vb2_get_drv_priv(buffer->vb2_queue);
    struct camera_buffer *own = container_of(to_vb2_v4l2_buffer(buffer), struct camera_buffer, vb);
    mutex_lock(&camera->port_lock);
    list_add_tail(&own->link, &camera->waiting);
    mutex_unlock(&camera->port_lock);
}

static int start_streaming(struct vb2_queue *queue, unsigned int count) {
    struct bench_camera *camera = vb2_get_drv_priv(queue);
    mutex_lock(&camera->port_lock);
    camera->streaming = true;
    camera->sequence = 0;
    mutex_unlock(&camera->port_lock);
    return 0;
}

static void stop_streaming(struct vb2_queue *queue) {
    struct bench_camera *camera = vb2_get_drv_priv(queue);
    struct camera_buffer *buffer, *next;
    mutex_lock(&camera->port_lock);
    if (camera->asked) {
        send(camera, MESSAGE_CANCEL);
    }
    camera->streaming = false;
    camera->asked = false;
    if (camera->filling) {
        // The rest of the frame is received without a buffer.
        list_add(&camera->filling->link, &camera->waiting);
        camera->filling = NULL;
    }
    list_for_each_entry_safe(buffer, next, &camera->waiting, link) {
        list_del(&buffer->link);
        vb2_buffer_done(&buffer->vb.vb2_buf, VB2_BUF_STATE_ERROR);
    }
    mutex_unlock(&camera->port_lock);
}

static const struct vb2_ops queue_operations = {
    .queue_setup = queue_setup,
    .buf_queue = buffer_queue,
    .start_streaming = start_streaming,
    .stop_streaming = stop_streaming,
    .wait_prepare = vb2_ops_wait_prepare,
    .wait_finish = vb2_ops_wait_finish,
};

// ---- V4L2

static int query_capabilities(struct file *file, void *private, struct v4l2_capability *can) {
    strscpy(can->driver, KBUILD_MODNAME, sizeof(can->driver));
    strscpy(can->card, "Bench camera", sizeof(can->card));
    strscpy(can->bus_info, "platform:virtio", sizeof(can->bus_info));
    return 0;
}

static int enumerate_formats(struct file *file, void *private, struct v4l2_fmtdesc *format) {
    if (format->index > 0) {
        return -EINVAL;
    }
    format->pixelformat = V4L2_PIX_FMT_SGRBG10;
    return 0;
}

static int get_format(struct file *file, void *private, struct v4l2_format *format) {
    format->fmt.pix = ((const struct bench_camera *)video_drvdata(file))->format;
    return 0;
}

static int try_format(struct file *file, void *private, struct v4l2_format *format) {
    const struct v4l2_pix_format *wanted = &format->fmt.pix;
    const u32 width = clamp(wanted->width, 1U, WIDTH_MAX);
    const u32 height = clamp(wanted->height, 1U, HEIGHT_MAX);
    format->fmt.pix = (struct v4l2_pix_format){.width = width,
                                               .height = height,
                                               .pixelformat = V4L2_PIX_FMT_SGRBG10,
                                               .field = V4L2_FIELD_NONE,
                                               .bytesperline = 2 * width,
                                               .sizeimage = 2 * width * height,
                                               .colorspace = V4L2_COLORSPACE_RAW};
    return 0;
}

static int set_format(struct file *file, void *private, struct v4l2_format *format) {
    struct bench_camera *camera = video_drvdata(file);
    if (vb2_is_busy(&camera->queue)) {
        return -EBUSY;
    }
    try_format(file, private, format);
    camera->format = format->fmt.pix;
    return 0;
}

static int dequeue(struct file *file, void *private, struct v4l2_buffer *buffer) {
    struct bench_camera *camera = video_drvdata(file);
    if ((file->f_flags & O_NONBLOCK) == 0 && list_empty_careful(&camera->queue.done_list)) {
        ask(camera);
    }
    return vb2_ioctl_dqbuf(file, private, buffer);
}

static __poll_t poll_frame(struct file *file, poll_table *wait) {
    struct bench_camera *camera = video_drvdata(file);
    const __poll_t events = vb2_fop_poll(file, wait);
    if ((events & (EPOLLIN | EPOLLERR)) == 0) {
        ask(camera);
    }
    return events;
}

static const struct v4l2_ioctl_ops ioctl_operations = {
    .vidioc_querycap = query_capabilities,
    .vidioc_enum_fmt_vid_cap = enumerate_formats,
    .vidioc_g_fmt_vid_cap = get_format,
    .vidioc_s_fmt_vid_cap = set_format,
    .vidioc_try_fmt_vid_cap = try_format,
    .vidioc_reqbufs = vb2_ioctl_reqbufs,
    .vidioc_querybuf = vb2_ioctl_querybuf,
    .vidioc_qbuf = vb2_ioctl_qbuf,
    .vidioc_dqbuf = dequeue,
    .vidioc_streamon = vb2_ioctl_streamon,
    .vidioc_streamoff = vb2_ioctl_streamoff,
};

static const struct v4l2_file_operations file_operations = {
    .owner = THIS_MODULE,
    .open = v4l2_fh_open,
    .release = vb2_fop_release,
    .unlocked_ioctl = video_ioctl2,
    .mmap = vb2_fop_mmap,
    .poll = poll_frame,
};

static int add_camera(struct bench_camera *camera) {
    struct vb2_queue *queue = &camera->queue;
    struct video_device *video = &camera->video;
    struct v4l2_format format = {.fmt.pix = {.width = 640, .height = 480}};
    int error;
    try_format(NULL, NULL, &format);
    camera->format = format.fmt.pix;
    queue->type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    queue->io_modes = VB2_MMAP;
    queue->drv_priv = camera;
    queue->buf_struct_size = sizeof(struct camera_buffer);
    queue->ops = &queue_operations;
    queue->mem_ops = &vb2_vmalloc_memops;
    queue->lock = &camera->lock;
    queue->dev = &camera->device->dev;
    queue->timestamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    error = vb2_queue_init(queue);
    if (error) {
        return error;
    }
    strscpy(video->name, "Bench camera", sizeof(video->name));
    video->v4l2_dev = &camera->v4l2;
    video->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    video->fops = &file_operations;
    video->ioctl_ops = &ioctl_operations;
    video->lock = &camera->lock;
    video->queue = queue;
    video->release = video_device_release_empty;
    video_set_drvdata(video, camera);
    return video_register_device(video, VFL_TYPE_VIDEO, -1);
}

// ---- the device

static void release(struct v4l2_device *v4l2) {
    struct bench_camera *camera = container_of(v4l2, struct bench_camera, v4l2);
    for (int i = 0; i < RX_BUFFERS; i++) {
        free_page((unsigned long)camera->rx_pages[i]);
    }
    kfree(camera);
}

static int open_port(struct bench_camera *camera) {
    vq_callback_t *callbacks[] = {bytes_arrived, NULL};
    static const char *const names[] = {"input", "output"};
    struct virtqueue *queues[2];
    int error;
    for (int i = 0; i < RX_BUFFERS; i++) {
        camera->rx_pages[i] = (void *)__get_free_page(GFP_KERNEL);
        if (!camera->rx_pages[i]) {
            return -ENOMEM;
        }
    }
    error = virtio_find_vqs(camera->device, 2, queues, callbacks, names, NULL);
    if (error) {
        return error;
    }
    camera->rx = queues[0];
    camera->tx = queues[1];
    virtio_device_ready(camera->device);
    for (int i = 0; i < RX_BUFFERS; i++) {
        lend_page(camera, camera->rx_pages[i]);
    }
    virtqueue_kick(camera->rx);
    return 0;
}

static void close_port(struct bench_camera *camera) {
    struct message *message;
    mutex_lock(&camera->port_lock);
    camera->gone = true;
    mutex_unlock(&camera->port_lock);
    virtio_reset_device(camera->device);
    cancel_work_sync(&camera->work);
    while ((message = virtqueue_detach_unused_buf(camera->tx)) != NULL) {
        kfree(message);
    }
    camera->device->config->del_vqs(camera->device);
}

static int probe(struct virtio_device *device) {
    struct bench_camera *camera = kzalloc(sizeof(*camera), GFP_KERNEL);
    int error;
    if (!camera) {
        return -ENOMEM;
    }
    camera->device = device;
    device->priv = camera;
    mutex_init(&camera->lock);
    mutex_init(&camera->port_lock);
    INIT_LIST_HEAD(&camera->waiting);
    INIT_WORK(&camera->work, work);
    error = v4l2_device_register(&device->dev, &camera->v4l2);
    if (error) {
        kfree(camera);
        return error;
    }
    camera->v4l2.release = release;
    error = open_port(camera);
    if (!error) {
        error = add_camera(camera);
        if (!error) {
            return 0;
        }
        close_port(camera);
    }
    v4l2_device_disconnect(&camera->v4l2);
    v4l2_device_put(&camera->v4l2);
    return error;
}

static void remove(struct virtio_device *device) {
    struct bench_camera *camera = device->priv;
    vb2_video_unregister_device(&camera->video);
    close_port(camera);
    v4l2_device_disconnect(&camera->v4l2);
    v4l2_device_put(&camera->v4l2);
}

static const struct virtio_device_id ids[] = {{VIRTIO_ID_CONSOLE, VIRTIO_DEV_ANY_ID}, {0}};
MODULE_DEVICE_TABLE(virtio, ids);

// No feature is negotiated: without VIRTIO_CONSOLE_F_MULTIPORT the device has its port 0 alone.
static struct virtio_driver bench_camera_driver = {
    .driver.name = KBUILD_MODNAME,
    .driver.owner = THIS_MODULE,
    .id_table = ids,
    .probe = probe,
    .remove = remove,
};
module_virtio_driver(bench_camera_driver);

MODULE_DESCRIPTION("Camera whose frames come over a virtio port");
MODULE_LICENSE("GPL");
