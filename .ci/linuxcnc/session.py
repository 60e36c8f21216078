"""What every session script needs: the machine switched on and homed, messages, waiting, and a record of every servo period."""
import os
import subprocess
import sys
import time

import hal
import linuxcnc

command, status, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
component = hal.component("session")
component.ready()
messages = []
# `linuxcnc` gives the user interface arguments of its own.
arguments = os.environ["ARGUMENTS"].split()


def say(text):
    print(text, flush=True)


def fail(text):
    for message in messages:
        say("message: " + message)
    say("FAIL " + text)
    sys.exit(1)


def poll():
    """Reads LinuxCNC's state and keeps its messages."""
    status.poll()
    while True:
        message = errors.poll()
        if not message:
            return
        messages.append(str(message[1]).strip())


def until(condition, what, seconds=30, also=lambda: None):
    end = time.time() + seconds
    while time.time() < end:
        poll()
        also()
        if condition():
            return
        time.sleep(0.005)
    fail("no end of: " + what)


def mode(wanted, name):
    command.mode(wanted)
    until(lambda: status.task_mode == wanted, name)


def home():
    """Emergency stop off, machine on, all joints homed."""
    for _ in range(400):
        try:
            status.poll()
            break
        except linuxcnc.error:
            time.sleep(0.05)
    command.state(linuxcnc.STATE_ESTOP_RESET)
    until(lambda: status.task_state == linuxcnc.STATE_ESTOP_RESET, "emergency stop reset")
    command.state(linuxcnc.STATE_ON)
    until(lambda: status.task_state == linuxcnc.STATE_ON, "machine on")
    mode(linuxcnc.MODE_MANUAL, "manual mode")
    command.home(-1)
    until(lambda: all(status.homed[: status.joints]), "homing")


def expect(what, condition):
    if not condition:
        fail(what)
    say("ok: " + what)


def call(*words):
    """Exit status and output of one of LinuxCNC's programs."""
    done = subprocess.run(words, capture_output=True, text=True, timeout=20)
    return done.returncode, (done.stdout + done.stderr).strip()


def halcmd(*words):
    return call("halcmd", *words)


def on_again():
    """After an error LinuxCNC may have switched the machine off: on again, and back to rest."""
    command.abort()
    command.wait_complete()
    if status.task_state != linuxcnc.STATE_ON:
        command.state(linuxcnc.STATE_ESTOP_RESET)
        until(lambda: status.task_state >= linuxcnc.STATE_ESTOP_RESET, "emergency stop reset")
        command.state(linuxcnc.STATE_ON)
        until(lambda: status.task_state == linuxcnc.STATE_ON, "machine on")
    poll()


class Record:
    """Every servo period at full precision, from the component `sampler`."""

    def __init__(self):
        self.rows = []
        self.stream = hal.stream(component, hal.sampler_base)
        hal.set_p("sampler.0.enable", "1")
        time.sleep(0.05)

    def drain(self):
        while self.stream.readable:
            row = self.stream.read()
            if row is not None:
                self.rows.append(tuple(row))

    def save(self, name):
        time.sleep(0.1)
        hal.set_p("sampler.0.enable", "0")
        time.sleep(0.05)
        self.drain()
        if int(hal.get_value("sampler.0.overruns")):
            fail("the record has gaps")
        with open(name, "w") as file:
            for row in self.rows:
                file.write(",".join(map(repr, row)) + "\n")


def run(program, record=None, seconds=300):
    """Runs a program in automatic mode to its end."""
    also = record.drain if record else lambda: None
    mode(linuxcnc.MODE_AUTO, "automatic mode")
    command.program_open(program)
    command.wait_complete()
    before = len(messages)
    command.auto(linuxcnc.AUTO_RUN, 0)
    until(lambda: status.interp_state != linuxcnc.INTERP_IDLE or len(messages) > before, "start of the program", 20, also)
    until(lambda: status.interp_state == linuxcnc.INTERP_IDLE and status.inpos, "end of the program", seconds, also)
    poll()
