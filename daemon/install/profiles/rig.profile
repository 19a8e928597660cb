# SPDX-License-Identifier: Apache-2.0
# A profile of vergenced: the cameras, FPGA, servos and lenses of an instrument. For an instrument
# of your own, copy this file, change what differs, delete the other lines, give it another name,
# and set profile = FILE in the settings. Check it with: vergenced --check FILE

# the built-in profile that it starts from (rig two-cameras two-cameras-lens)
like = rig

# name of the instrument in its status and its sessions: letters, digits, - _ and .
name = rig

# whether there is an FPGA bridge, with both sensors behind it (no yes)
bridge = yes

# I2C address of the bridge (0x00 to 0x77)
bridge_address = 0x2c

# I2C address of the left sensor (0x00 to 0x77)
sensor_address_left = 0x5c

# I2C address of the right sensor (0x00 to 0x77)
sensor_address_right = 0x5e

# clock of the sensors (0 to 48 MHz)
sensor_clock = 48 MHz

# whether servos pan the cameras (no yes)
servos = yes

# pulse at the centre of the left servo (0 to 4095.9375 us)
servo_left_centre = 1500 us

# shortest pulse of the left servo (0 to 4095.9375 us)
servo_left_min = 600 us

# longest pulse of the left servo (0 to 4095.9375 us)
servo_left_max = 2400 us

# change of the pulse that turns the left servo by one degree (0 to 1090.831 us/deg)
servo_left_scale = 10.3 us/deg

# speed of the left servo at the lowest supply voltage (0 to 5729.57796 deg/s)
servo_left_speed = 315.1268 deg/s

# time until the left servo is at rest after a motion (0 to 10000 ms)
servo_left_settle = 100 ms

# pulse at the centre of the right servo (0 to 4095.9375 us)
servo_right_centre = 1500 us

# shortest pulse of the right servo (0 to 4095.9375 us)
servo_right_min = 600 us

# longest pulse of the right servo (0 to 4095.9375 us)
servo_right_max = 2400 us

# change of the pulse that turns the right servo by one degree (0 to 1090.831 us/deg)
servo_right_scale = 10.3 us/deg

# speed of the right servo at the lowest supply voltage (0 to 5729.57796 deg/s)
servo_right_speed = 315.1268 deg/s

# time until the right servo is at rest after a motion (0 to 10000 ms)
servo_right_settle = 100 ms

# largest change from one pulse to the next (0 to 127.9375 us)
servo_slew = 30 us

# the bridge brings the servos to rest after this long without I2C traffic (0 to 1500 ms)
servo_watchdog = 1000 ms

# leftmost pan angle (-90 to 90 deg)
pan_min = -30 deg

# rightmost pan angle (-90 to 90 deg)
pan_max = 30 deg

# standard deviation of a pan angle that is approached again; a calibration made further away than
# this is rejected (0 to 10 deg)
pan_repeatability = 0.3 deg

# fixed, or the controller of motorized lenses (vergenced --help-lenses lists them). Sets the
# lens_ keys; other lines change them
lenses = v3lc

# baud rate of a lens controller on a serial port (0 to 921600)
lens_baud = 9600

# I2C address of a lens controller on I2C (0x00 to 0x77)
lens_address = 0x00

# a move overshoots by this much, so that each ends from the same side; for all axes (0 to 1000
# counts)
lens_backlash = 10 counts

# a move is complete within this distance of its target; for all axes (0 to 1000 counts)
lens_tolerance = 4 counts

# smallest position of the zoom motor (0 to 65535 counts)
lens_zoom_min = 300 counts

# largest position of the zoom motor (0 to 65535 counts)
lens_zoom_max = 850 counts

# a slower zoom motor counts as jammed (0 to 100000 counts/s)
lens_zoom_speed_min = 80 counts/s

# lens_backlash of zoom (0 to 1000 counts)
lens_zoom_backlash = 10 counts

# lens_tolerance of zoom (0 to 1000 counts)
lens_zoom_tolerance = 4 counts

# side from which the zoom motor reaches its target (below above)
lens_zoom_approach = above

# smallest position of the focus motor (0 to 65535 counts)
lens_focus_min = 300 counts

# largest position of the focus motor (0 to 65535 counts)
lens_focus_max = 850 counts

# a slower focus motor counts as jammed (0 to 100000 counts/s)
lens_focus_speed_min = 80 counts/s

# lens_backlash of focus (0 to 1000 counts)
lens_focus_backlash = 10 counts

# lens_tolerance of focus (0 to 1000 counts)
lens_focus_tolerance = 4 counts

# side from which the focus motor reaches its target (below above)
lens_focus_approach = above

# smallest position of the iris motor (0 to 65535 counts)
lens_iris_min = 300 counts

# largest position of the iris motor (0 to 65535 counts)
lens_iris_max = 850 counts

# a slower iris motor counts as jammed (0 to 100000 counts/s)
lens_iris_speed_min = 80 counts/s

# lens_backlash of iris (0 to 1000 counts)
lens_iris_backlash = 10 counts

# lens_tolerance of iris (0 to 1000 counts)
lens_iris_tolerance = 4 counts

# side from which the iris motor reaches its target (below above)
lens_iris_approach = above

# a calibration made further away than this in zoom, focus or iris is rejected (0 to 1000 counts)
lens_repeatability = 4 counts

# change of the focal length by one count of zoom (0 to 10 %)
lens_zoom_step = 0.4187 %

# focal length at the smallest position of zoom, by the lens's data sheet; 0 mm: not known (0 to
# 1000 mm)
focal_length_wide = 8.5 mm

# focal length at the largest position of zoom (0 to 1000 mm)
focal_length_tele = 85 mm

# distance in focus at the largest position of focus; at the smallest it is infinity. 0 mm: not
# known (0 to 100000 mm)
focus_nearest = 800 mm

# f-number at the largest position of iris; 0: not known (0 to 64)
f_number_open = 1.6

# f-number at the smallest position of iris (0 to 64)
f_number_closed = 16

# distance from pixel to pixel on the sensor; 0 um: not known (0 to 50 um)
pixel_pitch = 3.2 um

# width of full frames (16 to 16384 px)
width = 2048 px

# height of full frames (16 to 16384 px)
height = 1536 px

# longest time between frames of cameras that do not report it (1 to 60000 ms)
frame_interval = 200 ms

# longest time between the two frames of a pair (0.001 to 60000 ms)
skew_limit = 1000 ms

# frequency of the mains: autoexpose prefers exposures of whole half periods, in which its lamps
# do not flicker; 0 Hz: constant light (0 to 100 Hz)
mains = 50 Hz

# whether a pulse of trigger_line triggers each pair; both cameras have ports of their own and are
# set to external trigger. Not with a bridge, whose sensors run freely (no yes)
trigger = no

# length of that pulse, at least 0.1 ms (0 to 1000 ms)
trigger_pulse = 0 ms
