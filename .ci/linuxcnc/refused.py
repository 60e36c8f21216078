#!/usr/bin/python3
"""refused.py PROGRAM: a program whose third line cannot be reached ends with LinuxCNC's own message, which names the line;
LinuxCNC and the machine stay on, and the machine still moves."""
import re

from session import *

program = os.path.abspath(arguments[0])
home()
there = list(status.actual_position)
mode(linuxcnc.MODE_AUTO, "automatic mode")
command.program_open(program)
command.wait_complete()
command.auto(linuxcnc.AUTO_RUN, 0)
own = re.compile(r"on line 3 (fails kinematicsInverse|would exceed .* limit)")
until(lambda: any(own.search(message) for message in messages), "the message that names line 3", 60)
until(lambda: status.interp_state == linuxcnc.INTERP_IDLE and status.inpos, "end of the program")
if status.task_state != linuxcnc.STATE_ON:
    fail("the machine went off")
if any(abs(a - b) > 1e-3 for a, b in zip(status.actual_position, there)):
    fail("the machine moved")
mode(linuxcnc.MODE_MDI, "MDI")
before = len(messages)
line = open(program).read().splitlines()[1]
command.mdi(line + " F900")
command.wait_complete()
poll()
if len(messages) > before:
    fail("the machine does not move any more")
say("OK " + "; ".join(messages))
