#!/usr/bin/python3
"""switching.py: a machine whose mechanism is switched by M428 and M429 (type 0 and 1), switched at every wrong moment and in every
mode. No joint may move when the mechanism does, and LinuxCNC goes on whatever is asked of it."""
from session import *

V1 = 2
joints = lambda: [hal.get_value("joint.%d.pos-cmd" % joint) for joint in range(status.joints)]
kind = lambda: int(hal.get_value("motion.switchkins-type"))


def mdi(*lines):
    """Lines behind each other without a pause; true if LinuxCNC ran them without a message."""
    mode(linuxcnc.MODE_MDI, "MDI")
    before = len(messages)
    for line in lines:
        command.mdi(line)
    command.wait_complete(20)
    until(lambda: status.interp_state == linuxcnc.INTERP_IDLE and status.queue == 0 and status.inpos, str(lines))
    return len(messages) == before


def rest():
    """The joints, when their interpolation has run out."""
    time.sleep(0.1)
    poll()
    return joints()


def moved(before, after):
    return max(abs(a - b) for a, b in zip(before, after))


def jogging(world):
    """Ready to jog axes, or joints."""
    mode(linuxcnc.MODE_MANUAL, "manual mode")
    command.teleop_enable(world)
    until(lambda: status.motion_mode == (linuxcnc.TRAJ_MODE_TELEOP if world else linuxcnc.TRAJ_MODE_FREE), "jogging")


home()

# Switches right behind a move and behind each other: the joints end where the move ended.
expect("M429", mdi("M429", "G21 G90 G1 F1200 C0"))
zero = rest()
for turn in range(20):
    expect("a move of V and M428 at once", mdi("G1 C%d" % (2 - turn % 2 * 4), "G1 C0", "M428") and kind() == 0)
    expect("the joints are where C0 has them: %s" % moved(zero, rest()), moved(zero, joints()) < 1e-9)
    expect("C is 0: %s" % status.actual_position[5], abs(status.actual_position[5]) < 1e-9)
    expect("M429, M428, M429", mdi("M429", "M428", "M429") and kind() == 1)
    expect("no joint has moved: %s" % moved(zero, rest()), moved(zero, joints()) < 1e-9)
expect("M428", mdi("M428"))

# A joint of the idle mechanism is jogged in joint mode: it stays there, and V begins there.
before = rest()
jogging(False)
command.jog(linuxcnc.JOG_INCREMENT, 1, V1, 20, 1.5)
until(lambda: abs(joints()[V1] - before[V1] - 1.5) < 1e-6, "the jog")
jogged = rest()
expect("back to driving the pose", mdi("G91 G1 X1", "X-1"))
expect("the idle joint stays where it was jogged to: %s" % moved(jogged, rest()), moved(jogged, joints()) < 1e-9)
u = status.actual_position[6]
expect("M429", mdi("M429"))
expect("no joint moves: %s" % moved(jogged, rest()), moved(jogged, joints()) < 1e-9)
expect("U is where the jog has brought it: %s" % status.actual_position[6], abs(status.actual_position[6] - u) > 0.1)
expect("M428", mdi("M428"))

# Through all modes, each mechanism: nothing moves.
for line in ("M429", "M428"):
    expect(line, mdi(line))
    stands = rest()
    for world in (False, True, False, True):
        jogging(world)
        expect("a change of mode moves nothing: %s" % moved(stands, rest()), moved(stands, joints()) < 1e-9)
    command.state(linuxcnc.STATE_OFF)
    until(lambda: status.task_state != linuxcnc.STATE_ON, "machine off")
    on_again()
    expect("nor does that: %s" % moved(stands, rest()), moved(stands, joints()) < 1e-9)

# An axis of the idle mechanism; a type that does not exist; a switch in motion.
expect("moving U while H is active is refused", not mdi("G91 G1 F1200 U1"))
on_again()
for nonsense in ("7", "-1", "1000000000"):
    before, start = rest(), len(messages)
    mdi("M68 E3 Q" + nonsense)
    until(lambda: any("kinematicsSwitch" in text for text in messages[start:]), "a message")
    say("ok: type %s is refused: %s" % (nonsense, messages[start:]))
    expect("and moves nothing", moved(before, rest()) < 1e-9)
    mdi("M68 E3 Q0")
    on_again()
    expect("the machine moves again", mdi("G91 G1 F1200 X1", "X-1"))

# The pin itself, in motion: the module refuses.
halcmd("unlinkp", "motion.switchkins-type")
for nonsense in ("1", "nan"):
    before = len(messages)
    mode(linuxcnc.MODE_MDI, "MDI")
    command.mdi("G91 G1 F60 X5")
    time.sleep(0.2)
    halcmd("setp", "motion.switchkins-type", nonsense)
    until(lambda: len(messages) > before, "a message")
    time.sleep(0.3)
    poll()
    expect("type %s in motion is refused: %s" % (nonsense, messages[before:]), 0 < len(messages) - before <= 6)
    command.abort()
    command.wait_complete()
    halcmd("setp", "motion.switchkins-type", "0")
    on_again()
    expect("the machine moves again", mdi("G91 G1 F1200 X1", "X-1"))
say("OK %d messages" % len(messages))
