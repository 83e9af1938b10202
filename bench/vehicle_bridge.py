#!/usr/bin/env python3
"""Processor time of a vehicle's bridge, and latency from `/cmd_vel` to the set-point.

    scripts/ros_env .venv/bin/python3 bench/vehicle_bridge.py [--seconds 30]

Starts a roscore on a free port, one bridge, and a vehicle of `test/vehicles` in this process. The
navigator is this process: it publishes commands at 20 Hz and tells them apart by their speed.
"""

from __future__ import annotations

import argparse
import os
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Dict, List

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "test" / "vehicles"))

COMMANDS_HZ = 20.0
PATIENCE_S = 30.0
TEMPLATE = """
vehicles:
  - {{number: 0, kind: mavlink, address: "udpin:127.0.0.1:{port}", start: [0, 0, 0]}}
"""


def free_port(kind: int) -> int:
    """Return a port that is free now."""
    with socket.socket(socket.AF_INET, kind) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def cpu_s(pid: int) -> float:
    """Return the processor time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measure(port: int, pid: int, seconds: float) -> None:
    """Fly one vehicle and print the figures."""
    import rospy
    from geometry_msgs.msg import Twist, Vector3
    from std_srvs.srv import Trigger
    from udp_vehicles import UdpVehicle

    rospy.init_node("bench", disable_signals=True)
    one = UdpVehicle(f"point:{port}:0:0:0", None, 0)
    publisher = rospy.Publisher("/cmd_vel0", Twist, queue_size=1, tcp_nodelay=True)
    sent: Dict[int, float] = {}
    latencies_s: List[float] = []
    replies: List[object] = []

    def fly(end) -> None:  # noqa: ANN001
        number, next_s, step_s = 0, time.monotonic(), time.monotonic()
        while not end():
            now_s = time.monotonic()
            if now_s >= next_s and replies:
                next_s += 1.0 / COMMANDS_HZ
                number += 1
                sent[number % 100] = time.monotonic()
                publisher.publish(Twist(linear=Vector3(0.001 * (1 + number % 100), 0.0, 0.0)))
            before = len(one.vehicle.setpoints)
            if now_s >= step_s:
                step_s += 0.01
                one.step()
            else:
                one.receive()
            for _, fields in one.vehicle.setpoints[before:]:
                found = sent.pop(round(fields.vx * 1e3) - 1, None)
                if found is not None:
                    latencies_s.append(time.monotonic() - found)
            time.sleep(0.0002)

    import threading

    def take_off() -> None:
        rospy.wait_for_service("/vehicle0/take_off", PATIENCE_S)
        while not rospy.ServiceProxy("/vehicle0/take_off", Trigger)().success:
            time.sleep(0.2)
        replies.append(True)

    threading.Thread(target=take_off, daemon=True).start()
    end_s = time.monotonic() + PATIENCE_S
    fly(lambda: replies or time.monotonic() > end_s)
    if not replies:
        raise SystemExit("the vehicle did not take off")
    end_s = time.monotonic() + 2.0
    fly(lambda: time.monotonic() > end_s)
    latencies_s.clear()
    one.vehicle.setpoints.clear()
    start_cpu_s, start_s = cpu_s(pid), time.monotonic()
    fly(lambda: time.monotonic() > start_s + seconds)
    elapsed_s = time.monotonic() - start_s
    latencies_s.sort()
    rate_hz = len(one.vehicle.setpoints) / elapsed_s
    print(f"processor: {(cpu_s(pid) - start_cpu_s) / elapsed_s:.4f} cores of the bridge")
    print(
        f"set-points: {rate_hz:.1f} Hz, {len(latencies_s)} of {COMMANDS_HZ * elapsed_s:.0f} at once"
    )
    for share in (0.5, 0.95, 1.0):
        value_s = latencies_s[min(int(share * len(latencies_s)), len(latencies_s) - 1)]
        print(f"latency, {100 * share:.0f} %: {1e3 * value_s:.2f} ms")


def main() -> int:
    """Run the bench."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seconds", type=float, default=30.0)
    arguments = parser.parse_args()
    master, port = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_DGRAM)
    os.environ["ROS_MASTER_URI"] = f"http://127.0.0.1:{master}"
    processes = [subprocess.Popen(["roscore", "-p", str(master)], stdout=subprocess.DEVNULL)]
    try:
        time.sleep(3.0)
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            file.write(TEMPLATE.format(port=port))
            file.flush()
            parameters = [f"_vehicles:={file.name}", "_number:=0", "_arm:=true"]
            bridge = subprocess.Popen([sys.executable, str(ROOT / "nodes/vehicle"), *parameters])
            processes.append(bridge)
            measure(port, bridge.pid, arguments.seconds)
    finally:
        for process in reversed(processes):
            process.terminate()
            process.wait(10.0)
    return 0


if __name__ == "__main__":
    sys.exit(main())
