# SPDX-License-Identifier: Apache-2.0
# U-Boot: fetches the image and starts it; every part's sum is checked. The memory map is that of 64 MB
# from 0x40000000: image at 4 MB, kernel at 16 MB, root file system at 36 MB (the parts' own load
# addresses). ${board_args} is what the environment adds to the kernel's command line.
setenv bootargs console=ttyAMA0,115200 rdinit=/init quiet ${board_args}
if tftpboot 0x40400000 vergence.fit; then
    bootm 0x40400000:kernel 0x40400000:ramdisk ${fdtcontroladdr}
fi
