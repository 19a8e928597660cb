# SPDX-License-Identifier: Apache-2.0
# A profile of vergenced: which cameras, FPGA, servos and lenses an instrument has. For one of
# your own copy this, change what differs and leave out what does not, give it a name of its own,
# and name the file in the settings: profile = FILE. Check it with: vergenced --check FILE

# the built-in profile that it begins with (rig two-cameras two-cameras-lens)
like = rig

# what the instrument is called in its status and its sessions: letters, digits, - _ and .
name = rig

# whether there is an FPGA bridge, and both sensors behind it (no yes)
bridge = yes

# I2C address of the bridge (0 to 119)
bridge_address = 44

# I2C address of the left sensor (0 to 119)
sensor_address_left = 92

# I2C address of the right sensor (0 to 119)
sensor_address_right = 94

# clock that the sensors get (0 to 48000000 Hz)
sensor_clock_hz = 48000000

# whether servos turn the cameras (no yes)
servos = yes

# pulse in the left servo's middle (0 to 65535 us/16)
servo_left_centre_q4 = 24000

# shortest pulse that it may get (0 to 65535 us/16)
servo_left_least_q4 = 9600

# longest pulse that it may get (0 to 65535 us/16)
servo_left_most_q4 = 38400

# how far a pulse turns it (0 to 1000000 us/16 a radian)
servo_left_q4_per_rad = 9442

# its speed at the lowest supply (0 to 100000000 urad/s)
servo_left_urad_per_s = 5500000

# until it rests after a motion (0 to 10000000 us)
servo_left_settle_us = 100000

# pulse in the right servo's middle (0 to 65535 us/16)
servo_right_centre_q4 = 24000

# shortest pulse that it may get (0 to 65535 us/16)
servo_right_least_q4 = 9600

# longest pulse that it may get (0 to 65535 us/16)
servo_right_most_q4 = 38400

# how far a pulse turns it (0 to 1000000 us/16 a radian)
servo_right_q4_per_rad = 9442

# its speed at the lowest supply (0 to 100000000 urad/s)
servo_right_urad_per_s = 5500000

# until it rests after a motion (0 to 10000000 us)
servo_right_settle_us = 100000

# greatest change from pulse to pulse (0 to 2047 us/16 a pulse)
servo_slew_q4 = 480

# silence after which the bridge lets the servos rest (0 to 1500 ms)
watchdog_ms = 1000

# farthest turn to the left (-1570796 to 1570796 urad)
pan_least_urad = -523599

# farthest turn to the right (-1570796 to 1570796 urad)
pan_most_urad = 523599

# standard deviation of an angle approached again; a calibration made further away than this is
# refused (0 to 174533 urad)
pan_repeatability_urad = 5236

# fixed; two motorized ones on a V3LC; the left one on a V1LC. Sets the lens_ keys, which may be
# changed in lines below it (fixed v3lc v1lc)
lenses = v3lc

# a slower zoom motor is taken for jammed (0 to 100000 counts/s)
lens_counts_per_s_zoom = 80

# a slower focus motor is taken for jammed (0 to 100000 counts/s)
lens_counts_per_s_focus = 80

# a slower iris motor is taken for jammed (0 to 100000 counts/s)
lens_counts_per_s_iris = 80

# moves end from below, after so far past (0 to 100 counts)
lens_backlash_counts = 10

# a move has arrived within this (0 to 100 counts)
lens_tolerance_counts = 4

# a calibration made further away than this in zoom, focus or iris is refused (0 to 100 counts)
lens_repeatability_counts = 4

# change of the focal length by one count of zoom (0 to 100000 ppm a count)
lens_zoom_ppm = 4187

# width of full frames (16 to 16384 px)
width_px = 2048

# height of full frames (16 to 16384 px)
height_px = 1536

# longest time between frames where no sensor tells (1000 to 60000000 us)
frame_us = 200000

# longest time between the frames of a pair (1 to 60000000 us)
skew_limit_us = 1000000

# whether both cameras, on ports of their own and set to external trigger, take each pair with a
# pulse of trigger_line; those behind a bridge run freely (no yes)
trigger = no

# length of that pulse, 100 at least (0 to 1000000 us)
trigger_us = 0
