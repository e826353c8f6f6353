"""Frames of the Tonus wire protocol, version 2, as dictionaries: one frame in hex per line of standard input."""
import json, struct, sys, zlib

MUSCLES = ["absent", "biceps_short", "biceps_long", "triceps_lateral", "triceps_long", "other"]
FLAGS = ["hand_seen", "orientation_seen", "gap", "posture_clamped", "stiffness_held", "activation_held", "blending", "near_singular"]
RESETS = ["unknown", "power_on", "pin", "watchdog", "software", "lockup", "wake"]
PROBLEMS = ["low_battery", "front_end_failed", "attitude_sensor_failed", "last_words_wait", "not_calibrated", "no_model"]
COMMANDS = {1: "raw", 2: "send_calibration", 3: "send_model_state", 4: "restart", 5: "send_last_words", 6: "face_forward"}
REASONS = [None, "malformed", "out_of_range", "wrong_state", "too_large", "hash_mismatch", "wrong_offset", "storage_failed", "not_fitting", "busy"]
KINDS = {1: ("configuration", "<3fiIB8sBB8s"), 2: ("stream", "<I8f2f3f8sBH"), 3: ("raw_semg", None), 4: ("orientation", "<4f"),
         5: ("hand_position", "<B3f"), 6: ("ping", "<BIQQQ"), 7: ("inference", "<BB" + "Bf" * 4 + "f3f"), 8: ("status", "<IHB5I8sBIIHI"),
         9: ("control", "<BI"), 10: ("calibration", "<IB8sB26f"), 11: ("model_upload", None), 12: ("model_state", "<B8sB8sIII4B"),
         13: ("reply", "<BIBBI"), 14: ("last_words", None)}

def decode(data):
    version, kind, boot_id, sequence, device_us = struct.unpack_from("<BBIIQ", data)
    if version != 2 or kind not in KINDS:
        raise ValueError(f"version {version}, kind {kind}: not in protocol version 2")
    if zlib.crc32(data[:-4]) != struct.unpack("<I", data[-4:])[0]:
        raise ValueError("bad CRC: drop the frame")
    (name, form), p = KINDS[kind], data[18:-4]
    f = struct.unpack(form, p) if form else ()
    out = dict(kind=name, boot_id=boot_id, sequence=sequence, device_us=device_us)
    if kind == 1:
        out |= dict(semg_hz=f[0], stream_hz=f[1], volts_per_count=f[2], offset_counts=f[3], chain_delay_us=f[4],
                    muscles=[MUSCLES[m] for m in f[6][:f[5]]], mains_hz=f[7] or None, raw=bool(f[8]), firmware_hash=f[9].hex())
    elif kind == 2:
        n = f[15]
        out |= dict(describes_us=device_us - f[0], envelopes=f[1:1 + n], activation=f[9], co_contraction=f[10], stiffness_n_per_m=f[11:14],
                    quality=list(f[14][:n]), flags=[flag for bit, flag in enumerate(FLAGS) if f[16] >> bit & 1])
    elif kind == 3:
        f = struct.unpack_from("<IBB", p)
        counts = [int.from_bytes(p[i:i + 3], "little", signed=True) for i in range(6, 6 + 3 * f[1] * f[2], 3)]
        out |= dict(first_index=f[0], scans=[counts[i:i + f[1]] for i in range(0, len(counts), f[1])])
    elif kind == 4: out |= dict(xyzw=f)
    elif kind == 5: out |= dict(position_m=f[1:] if f[0] else None)
    elif kind == 6: out |= dict(role=["request", "reply"][f[0]], id=f[1], requested_us=f[2]) | (dict(received_us=f[3], replied_us=f[4]) if f[0] else {})
    elif kind == 7: out |= dict(skills=f[0], top=[f[2 + 2 * i:4 + 2 * i] for i in range(f[1])], phase=f[10], stiffness_n_per_m=f[11:])
    elif kind == 8:
        out |= dict(uptime_s=f[0], battery_mv=f[1] or None, reset_reason=RESETS[f[2]], overruns=f[3], gaps=f[4], missed_scans=f[5],
                    refused=f[6], dropped_packets=f[7], quality=list(f[8]), flags=[flag for bit, flag in enumerate(PROBLEMS) if f[9] >> bit & 1],
                    dropped_hypotheses=f[10], refused_requests=f[11], links=f[12], lost_reports=f[13])
    elif kind == 9: out |= dict(command=COMMANDS[f[0]], value=f[1])
    elif kind == 10:
        out |= dict(revision=f[0], muscles=[MUSCLES[m] for m in f[2][:f[1]]], mains_hz=f[3] or None, semg_hz=f[4], rest_v=f[5:5 + f[1]],
                    mvc_v=f[13:13 + f[1]], activation_window_s=f[21], l1=f[22], l2=f[23], rest_stiffness_nm_per_rad=f[24:28],
                    body_mass_kg=f[28], body_height_m=f[29])
    elif kind == 11:
        out |= dict(step=["begin", "piece", "finish", "abandon"][p[0]])
        if p[0] < 2: out |= {["total_bytes", "offset_bytes"][p[0]]: struct.unpack_from("<I", p, 1)[0], ["sha256", "bytes"][p[0]]: p[5:].hex()}
    elif kind == 12:
        out |= dict(active=dict(hash=f[1].hex(), skills=f[7], dofs=f[8], functions=f[9], rank=f[10]) if f[0] else None,
                    receiving=dict(hash=f[3].hex(), received_bytes=f[4], total_bytes=f[5]) if f[2] else None, capacity_bytes=f[6])
    elif kind == 13: out |= dict(answered=KINDS[f[0]][0], answered_sequence=f[1], outcome=["done", "refused"][f[2]], reason=REASONS[f[3]], detail=f[4])
    else: out |= dict(words=p[1:1 + p[0]].decode())
    return out

if __name__ == "__main__":
    for line in sys.stdin:
        print(json.dumps(decode(bytes.fromhex(line.strip()))))
