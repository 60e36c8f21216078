#!/usr/bin/python3
"""misuse.py MODULE PREFIX LENGTH: what a person may do wrong while LinuxCNC runs. Each time there must be an error and a message,
and LinuxCNC must go on. LENGTH is a parameter of the geometry, e.g. moma.1.link-length."""
from session import *

module, prefix, length = arguments
count = lambda: int(hal.get_value(prefix + ".errors"))


def since(start):
    return messages[start:]


def move(axis, by):
    """A small move in MDI; true if it was made."""
    mode(linuxcnc.MODE_MDI, "MDI")
    start = len(messages)
    letter = "XYZABCUVW"[axis]
    command.mdi("G21 G91 G1 F300 %s%s" % (letter, by))
    command.wait_complete(20)
    poll()
    if len(messages) > start:
        return False
    until(lambda: status.inpos and status.interp_state == linuxcnc.INTERP_IDLE, "the move")
    return True


home()
expect("homing makes no message: %s" % messages, not messages)
expect("the machine moves", move(0, 1) and move(0, -1))

# A module loaded twice; one that refuses to load. (`halcmd loadrt` waits for a component of that name to be ready, and may find the
# one that is there before rtapi_app, which it has called, says no.)
status_code, said = call("rtapi_app", "load", module)
expect("loading %s again is an error (%d: %s)" % (module, status_code, said), status_code != 0)
status_code, said = halcmd("loadrt", "planar_kins", "machine=no-such-machine")
expect("an unknown machine= is an error (%d: %s)" % (status_code, said), status_code != 0 and said)
expect("the machine moves after that", move(0, 1) and move(0, -1))

# Nonsense in the geometry, at rest and in motion.
good = hal.get_value(length)
for nonsense in ["nan", "-1", "1e300", "0", str(float(good) * 1.2)]:
    start, errors_before = len(messages), count()
    mode(linuxcnc.MODE_MDI, "MDI")
    command.mdi("G21 G91 G1 F60 X2")
    time.sleep(0.3)
    status_code, said = halcmd("setp", length, nonsense)
    expect("setp %s %s is taken by HAL (%s)" % (length, nonsense, said), status_code == 0)
    until(lambda: count() > errors_before, "an error for %s" % nonsense)
    time.sleep(0.3)
    poll()
    told = [message for message in since(start) if message.startswith(module)]
    expect("%s = %s is refused with a message: %s" % (length, nonsense, told), told)
    expect("the log is not flooded: %d messages" % len(since(start)), len(since(start)) <= 12)
    command.abort()
    command.wait_complete()
    halcmd("setp", length, repr(good))
    time.sleep(0.2)
    on_again()
    expect("the machine moves again", move(0, 1) and move(0, -1))

# Jogging out of reach, and back.
mode(linuxcnc.MODE_MANUAL, "manual mode")
command.teleop_enable(1)
until(lambda: status.motion_mode == linuxcnc.TRAJ_MODE_TELEOP, "world mode")
axis, start, errors_before, place = 0, len(messages), count(), status.actual_position[0]
for direction in (1, -1):
    command.jog(linuxcnc.JOG_CONTINUOUS, 0, axis, direction * 100)
    end = time.time() + 15
    while time.time() < end and count() == errors_before and len(messages) == start:
        poll()
        time.sleep(0.01)
    if status.task_state == linuxcnc.STATE_ON:
        command.jog(linuxcnc.JOG_STOP, 0, axis)
    poll()
    if count() > errors_before or len(messages) > start:
        break
time.sleep(0.5)
poll()
told = since(start)
expect("jogging X out of reach: %d poses refused, %d messages: %s" % (count() - errors_before, len(told), told[:3]), 0 < len(told) <= 12)
on_again()
mode(linuxcnc.MODE_MDI, "MDI")
command.mdi("G90 G53 G1 F6000 X%.4f" % place)
command.wait_complete(60)
poll()
expect("X is back", abs(status.actual_position[axis] - place) < 1e-3)
say("OK %d errors counted" % count())
