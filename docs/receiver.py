#!/usr/bin/env python3
"""Receives Tonus's set-points over UDP and keeps by itself what safety asks: python3 receiver.py [PORT, 5005 by default]

Replace `command` by your robot's own call. Clocks are never compared: `valid_for_us` counts from a datagram's arrival, by
this machine's monotonic clock. When it runs out the robot holds (stays where it is, as firm as it is); after 0.5 s without
a datagram it stops, and starts again only when a person says so: here, by starting this program again. Until a person has
armed it nothing is valid: it answers where it is, and does nothing.
"""
import json
import socket
import sys
import time

STOP_AFTER_S, NEVER = 0.5, float("-inf")
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.bind(("127.0.0.1", int(sys.argv[1]) if len(sys.argv) > 1 else 5005))
link.settimeout(0.005)  # the control period


def command(what, setpoint):  # your robot here; keep its own limits too
    print(what, json.dumps(setpoint and [setpoint["position_m"], setpoint["stiffness_n_per_m"]]), flush=True)


setpoint, sequence, arrived, doing, known = None, -1, NEVER, None, False
while True:
    try:
        data, host = link.recvfrom(65536)
        new = json.loads(data)
        known = known or new["state"] == "disarmed"  # started in the midst: silent, until Tonus has noticed
        if new["version"] == 1 and new["sequence"] > sequence and known:
            setpoint, sequence, arrived = new, new["sequence"], time.monotonic()
            answer = {"version": 1, "position_m": new["position_m"], "stiffness_n_per_m": new["stiffness_n_per_m"]}
            link.sendto(json.dumps(answer).encode(), host)  # where your robot is, as it measures it
    except (socket.timeout, ValueError, KeyError, TypeError):
        new = None
    silent = time.monotonic() - arrived
    if doing and silent > STOP_AFTER_S:
        sys.exit(command("stop", None))
    if setpoint and silent * 1e6 >= setpoint["valid_for_us"]:
        if doing == "follow":
            command(doing := "hold", setpoint)
    elif new and new is setpoint:
        command(doing := "follow", setpoint)
