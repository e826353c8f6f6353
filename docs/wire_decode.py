"""Frames of the Tonus wire protocol, version 1, as dictionaries: one frame in hex per line of standard input."""
import json, struct, sys, zlib

MUSCLES = ["absent", "biceps_short", "biceps_long", "triceps_lateral", "triceps_long", "other"]
FLAGS = ["hand_seen", "orientation_seen", "gap", "posture_clamped", "stiffness_held", "activation_held", "blending", "near_singular"]
RESETS = ["unknown", "power_on", "pin", "watchdog", "software", "lockup", "wake"]
KINDS = {1: ("configuration", "<3fiIB8sBB8s"), 2: ("stream", "<I8f2f3f8sBH"), 3: ("raw_semg", None), 4: ("orientation", "<4f"),
         5: ("hand_position", "<B3f"), 6: ("ping", "<BIQQQ"), 7: ("inference", "<BB" + "Bf" * 4 + "f3f"), 8: ("status", "<IHB5I8s")}

def decode(data):
    version, kind, boot_id, sequence, device_us = struct.unpack_from("<BBIIQ", data)
    if version != 1 or kind not in KINDS:
        raise ValueError(f"version {version}, kind {kind}: not in protocol version 1")
    if zlib.crc32(data[:-4]) != struct.unpack("<I", data[-4:])[0]:
        raise ValueError("bad CRC: drop the frame")
    (name, form), p = KINDS[kind], data[18:-4]
    f = struct.unpack(form, p) if form else struct.unpack_from("<IBB", p)
    out = dict(kind=name, boot_id=boot_id, sequence=sequence, device_us=device_us)
    if kind == 1:
        out |= dict(semg_hz=f[0], stream_hz=f[1], volts_per_count=f[2], offset_counts=f[3], chain_delay_us=f[4],
                    muscles=[MUSCLES[m] for m in f[6][:f[5]]], mains_hz=f[7] or None, raw=bool(f[8]), firmware_hash=f[9].hex())
    elif kind == 2:
        n = f[15]
        out |= dict(describes_us=device_us - f[0], envelopes=f[1:1 + n], activation=f[9], co_contraction=f[10], stiffness_n_per_m=f[11:14],
                    quality=list(f[14][:n]), flags=[flag for bit, flag in enumerate(FLAGS) if f[16] >> bit & 1])
    elif kind == 3:
        counts = [int.from_bytes(p[i:i + 3], "little", signed=True) for i in range(6, 6 + 3 * f[1] * f[2], 3)]
        out |= dict(first_index=f[0], scans=[counts[i:i + f[1]] for i in range(0, len(counts), f[1])])
    elif kind == 4: out |= dict(xyzw=f)
    elif kind == 5: out |= dict(position_m=f[1:] if f[0] else None)
    elif kind == 6: out |= dict(role=["request", "reply"][f[0]], id=f[1], requested_us=f[2]) | (dict(received_us=f[3], replied_us=f[4]) if f[0] else {})
    elif kind == 7: out |= dict(skills=f[0], top=[f[2 + 2 * i:4 + 2 * i] for i in range(f[1])], phase=f[10], stiffness_n_per_m=f[11:])
    else:
        out |= dict(uptime_s=f[0], battery_mv=f[1] or None, reset_reason=RESETS[f[2]], overruns=f[3], gaps=f[4], missed_scans=f[5],
                    refused=f[6], dropped_packets=f[7], quality=list(f[8]))
    return out

if __name__ == "__main__":
    for line in sys.stdin:
        print(json.dumps(decode(bytes.fromhex(line.strip()))))
