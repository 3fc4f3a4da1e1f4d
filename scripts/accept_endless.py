"""20,000 frames: what a long run costs in time and memory."""

import contextlib
import csv
import json
import statistics
import subprocess
import time
from pathlib import Path

from acceptance import DIORAMA, ROOT


def there_and_back(sequence, out, name, frames):
    """A sequence as long as that, of the pictures of another one: forwards, backwards and so on."""
    (out / "objects").mkdir(parents=True)
    for folder in ("rgb", "models"):
        (out / folder).symlink_to(sequence / folder)
    description = (sequence / "sequence.yaml").read_text()
    (out / "sequence.yaml").write_text(description.replace("odometry: odometry.csv\n", ""))
    for file in ("rgb.txt", "groundtruth.txt", f"objects/{name}.txt"):
        rows = [l.split()[1:] for l in (sequence / file).read_text().splitlines() if l[0] != "#"]
        round_trip = rows + rows[-2:0:-1]
        lines = [" ".join([f"{k / 30:.6f}"] + round_trip[k % len(round_trip)]) for k in range(frames)]
        (out / file).write_text("\n".join(lines) + "\n")


def slope(values):
    """Of a line through evenly spaced values, as a share of their mean per value."""
    middle, mean = (len(values) - 1) / 2, statistics.mean(values)
    return sum((k - middle) * (v - mean) for k, v in enumerate(values)) / sum((k - middle) ** 2 for k in range(len(values))) / mean


def rows_written(out):
    """Of the frames that a run has done, as far as its file is on the disk."""
    with contextlib.suppress(OSError, StopIteration):
        return next(out.glob("timing.csv*")).read_bytes().count(b"\n")
    return 0


def measure(report, work, sequence):
    """20,000 frames through the whole stack, with what a run keeps to write its files."""
    frames, out = 20000, work / "endless_run"
    there_and_back(sequence, work / "endless", "orange_juice", frames)
    process = subprocess.Popen([DIORAMA, "run", work / "endless", "-o", out, "--no-video", "--no-report"], cwd=ROOT,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    memory_mb, done = [], []
    while process.poll() is None:
        with contextlib.suppress(OSError, StopIteration):
            status = Path(f"/proc/{process.pid}/status").read_text().splitlines()
            memory_mb.append(int(next(l for l in status if l.startswith("VmRSS")).split()[1]) / 1024)
            done.append(rows_written(out))
        time.sleep(0.5)
    metrics = json.loads((out / "metrics.json").read_text())
    report.note("20,000 frames of the whole stack: frames/s, ATE, mean error, m",
                f"{metrics['timing']['frames_per_s']:.0f}, {metrics['camera']['ate_mean_m']:.5f}, "
                f"{metrics['objects']['orange_juice']['mean_error_m']:.5f}")
    with open(out / "timing.csv") as file:
        ms = [sum(float(row[k]) for k in ("odometry_ms", "tracker_ms", "mapper_ms")) for row in csv.DictReader(file)]
    thousands = [statistics.median(ms[k:k + 1000]) for k in range(1000, frames, 1000)]
    report.limit("20,000 frames: time of a frame, change per 1,000, %", abs(100 * slope(thousands)), "<=", 1)
    first = next(k for k, n in enumerate(done) if n >= 1000)
    last = next(k for k, n in enumerate(done) if n >= 0.95 * frames)  # before the batch solution at the end
    per_thousand = 1000 * (memory_mb[last] - memory_mb[first]) / (done[last] - done[first])
    report.note("20,000 frames: memory, MB, after 1,000 and before the end; kB per frame",
                f"{memory_mb[first]:.0f}, {memory_mb[last]:.0f}; {1.024 * per_thousand:.1f}")
    report.limit("20,000 frames: memory, growth per 1,000, %", 100 * per_thousand / memory_mb[first], "<=", 1)
