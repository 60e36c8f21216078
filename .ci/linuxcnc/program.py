#!/usr/bin/python3
"""program.py PROGRAM: home, run, record every servo period into rows.csv, end where the program ends (M2)."""
from session import *

program = os.path.abspath(arguments[0])
home()
record = Record()
run(program, record)
record.save("rows.csv")
if messages:
    fail("messages during the program")
if status.task_state != linuxcnc.STATE_ON:
    fail("the machine is off after the program")
# "In position" is said of the axes; the joints' interpolation is still running out. At rest is what two looks see alike.
looks = []
def rests():
    time.sleep(0.1)
    poll()
    looks.append(list(status.actual_position))
    return looks[-1:] == looks[-2:-1]
until(rests, "the joints at rest")
with open("end.txt", "w") as file:
    file.write(" ".join(map(repr, status.actual_position)) + "\n")
say("OK rows=%d" % len(record.rows))
