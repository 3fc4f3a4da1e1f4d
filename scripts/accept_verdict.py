"""The verdict: the paper's tables, the occlusion sweep, and the report."""

import csv
import json
import os
import random
import signal
import subprocess
import tempfile
import time
from pathlib import Path

from acceptance import DIORAMA, ROOT, sh, tests

SMALL_SWEEP = """
scene: {scene}
frames: 0:20
quality: draft
seeds: [1, 2]
time_limit_s: {limit}
file_limit_mb: {megabytes}
factors:
  - {{name: samples, path: tracker.max_samples, values: [100, 300]}}
  - {{name: noise, path: effects.read_noise_e, values: [0, 12]}}
  - {{name: method, values: [ebt, fused]}}
"""


def add_arguments(parser):
    parser.add_argument("--quick", action="store_true", help="the tables from 150 frames a scene, no occlusion sweep")
    parser.add_argument("--output", type=Path, metavar="DIR", help="keep the results there, and go on with what is there")


def timed(*command, **options):
    begin = time.monotonic()
    result = sh(*command, check=False, **options)
    return result, time.monotonic() - begin


def children_left(folder):
    """Processes whose command line names the folder."""
    left = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and int(entry.name) != os.getpid() and str(folder) in (entry / "cmdline").read_text():
                left.append(int(entry.name))
        except OSError:
            pass
    return left


def paper_tables(report, work, quick):
    folder = work / ("reproduce_quick" if quick else "reproduce")
    command = [DIORAMA, "reproduce", "-o", folder, *(["--quick"] if quick else [])]
    fresh = not folder.exists()
    result, seconds = timed(*command)
    report.line("reproduce ends well", result.stderr.strip().splitlines()[-1:] or "", result.returncode == 0)
    if result.returncode != 0:
        return
    if fresh:
        report.limit(f"reproduce{' --quick' if quick else ''}, minutes", seconds / 60, "<=", 6 if quick else 40)
    report.limit("reproduce again, s", timed(*command)[1], "<=", 5)
    for line in (folder / "tables.md").read_text().splitlines():
        report.note(line[:110], line[110:])
    runs = {}
    for path in (folder / "runs").iterdir():
        scene, method = path.name.rsplit("-", 2)[:2]
        runs[scene, method] = json.loads((path / "metrics.json").read_text())
    for scene in sorted({s for s, _ in runs}):
        of = {m: runs[scene, m] for m in ("vo", "ebt", "fused")}
        objects = {m: next(iter(of[m]["objects"].values())) for m in of}
        fused = objects["fused"]["mean_error_m"]
        best = min(v["mean_error_m"] for v in objects.values() if v["mean_error_m"] is not None)
        report.limit(f"{scene}: fused against the best method, m", fused, "<=", max(1.05 * best, best + 0.0002))
        report.limit(f"{scene}: mean error, m", fused, "<=", 0.004)
        ates = {m: of[m]["camera"]["ate_mean_m"] for m in ("vo", "fused")}
        report.limit(f"{scene}: ATE mean, fused, m", ates["fused"], "<=", 0.005)
        if ates["vo"] is not None:
            report.limit(f"{scene}: ATE against odometry alone, m", ates["fused"], "<=", max(1.05 * ates["vo"], ates["vo"] + 0.0002))
        since = of["fused"]["frames"] - (of["fused"]["start_frame"] or 0)
        report.limit(f"{scene}: frames below 0.5 m since start_frame", round(objects["fused"]["ratio_below_0_5_m"] * of["fused"]["frames"]) / since, ">=", 1)


def occlusion(report, work):
    folder = work / "occlusion"
    fresh = not folder.exists()
    result, seconds = timed(DIORAMA, "sweep", "scenes/sweeps/occlusion.yaml", "-o", folder, "-j", 2, "--resume")
    if fresh:
        report.limit("sweep occlusion.yaml -j 2, minutes", seconds / 60, "<=", 60)
    for line in result.stdout.splitlines():
        if line.startswith(("met", "missed")):
            report.line("occlusion: " + line.split(": ", 1)[1][:65], line.split(" (")[-1], line.startswith("met"))
    rows = list(csv.DictReader((folder / "results.csv").open()))
    report.limit("occlusion: cells recorded", len(rows), "==", 450)


def spec(work, name, limit=120, megabytes=2000, scene=None):
    file = work / name
    file.write_text(SMALL_SWEEP.format(scene=scene or ROOT / "scenes/orange_juice.yaml", limit=limit, megabytes=megabytes))
    return file


def stopped_and_resumed(report, work):
    file = spec(work, "small.yaml")
    whole = work / "whole"
    sh(DIORAMA, "sweep", file, "-o", whole)
    wanted = (whole / "results.csv").read_bytes()
    folder, left, numbers = work / "killed", 0, random.Random(1)
    for _ in range(10):
        process = subprocess.Popen([DIORAMA, "sweep", file, "-o", folder, "-j", "2", "--resume"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(numbers.uniform(0.1, 4))
        process.send_signal(signal.SIGKILL)
        process.wait()
        time.sleep(0.2)
        left += len(children_left(folder))
    sh(DIORAMA, "sweep", file, "-o", folder, "-j", 2, "--resume")
    report.limit("processes left after kill -9, ten times", left, "==", 0)
    report.line("results.csv after ten kill -9 and resumes: the same bytes", "", (folder / "results.csv").read_bytes() == wanted)
    shards = [work / f"shard{i}" for i in range(4)]
    for i, shard in enumerate(shards):
        sh(DIORAMA, "sweep", file, "-o", shard, "--shard", f"{i}/4")
    merged = work / "merged"
    sh(DIORAMA, "sweep", file, "-o", merged, *[word for shard in shards for word in ("--merge", shard)])
    report.line("shards 0/4..3/4 merged equal the whole", "", (merged / "results.csv").read_bytes() == wanted)


def statuses(work, file, name):
    sh(DIORAMA, "sweep", file, "-o", work / name, check=False)
    return {row["status"] for row in csv.DictReader((work / name / "results.csv").open())}


def broken_cells(report, work):
    too_slow = statuses(work, spec(work, "slow.yaml", limit=0.05), "slow")
    report.line("a cell that hangs is a row", too_slow, bool(too_slow) and all("timeout" in s for s in too_slow))
    too_big = statuses(work, spec(work, "big.yaml", megabytes=0.05), "big")
    report.line("a cell that cannot write its files is a row", too_big, bool(too_big) and all("crashed" in s or "failed" in s for s in too_big))
    missing = statuses(work, spec(work, "missing.yaml", scene="nowhere.yaml"), "missing")
    report.line("a cell that fails is a row", missing, bool(missing) and all("failed" in s for s in missing))


def measure(report, arguments):
    with tempfile.TemporaryDirectory(prefix="diorama-accept-") as scratch:
        work = Path(scratch)
        kept = (arguments.output or work).resolve()
        kept.mkdir(parents=True, exist_ok=True)
        paper_tables(report, kept, arguments.quick)
        stopped_and_resumed(report, work)
        broken_cells(report, work)
        if not arguments.quick:
            occlusion(report, kept)
    tests(report, "report in headless Chromium", "-R", "report_in_browser")
    tests(report, "eval equals the definitions of evo", "-R", "TrajectoryErrors|Umeyama")
    tests(report, "every command of the docs", "-R", "Documentation")
