"""The map: exact smoothing at a constant cost, the gate, wrong measurements, the feedback loop."""

import csv
import json
import math
import re
import tempfile
from pathlib import Path

import accept_absence
import accept_endless
from acceptance import printed, render, run, sh, tests

SCENES = ("orange_juice", "pasta_box", "detergent", "orange_juice_occluded", "pasta_box_occluded",
          "detergent_occluded", "multi_object")


def sequence_of(work, scene, scenes, *arguments, folder="scenes"):
    if scenes and (scenes / scene).exists():
        return scenes / scene
    if not (work / f"{scene}_sequence").exists():
        render(work / f"{scene}_sequence", *arguments, scene=f"{folder}/{scene}.yaml")
    return work / f"{scene}_sequence"


def from_start(out, name, metrics):
    """success_5cm_5deg counts all frames of the sequence; here those from start_frame on."""
    whole = metrics["objects"][name]["success_5cm_5deg"]
    frames, start = metrics["frames"], metrics["start_frame"] or 0
    return min(1.0, whole * frames / max(1, frames - start))


def paths_of(out, name):
    """Errors of the object in the frames that have one, by time stamp: its reported pose against the truth's."""
    rows = [l.split() for l in (out / "objects" / f"{name}.txt").read_text().splitlines() if l and l[0] != "#"]
    return {round(float(r[0]), 4): [float(v) for v in r[1:4]] for r in rows}


def rotate(q, v):
    x, y, z, w = q
    t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])]
    return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2], v[2] + w * t[2] + x * t[1] - y * t[0]]


def true_positions(sequence, name):
    """T_camera_object's translation at each time stamp."""
    def stamped(path):
        rows = [l.split() for l in path.read_text().splitlines() if l and l[0] != "#"]
        return {round(float(r[0]), 4): [float(v) for v in r[1:8]] for r in rows}
    camera, objects = stamped(sequence / "groundtruth.txt"), stamped(sequence / "objects" / f"{name}.txt")
    return {t: rotate([-c[3], -c[4], -c[5], c[6]], [a - b for a, b in zip(objects[t][:3], c[:3])])
            for t, c in camera.items() if t in objects}


def mean_errors(sequence, name, outs):
    """Mean translation error of several runs over the frames that all of them report."""
    truth, paths = true_positions(sequence, name), [paths_of(out, name) for out in outs]
    common = set(truth).intersection(*paths)
    return [sum(math.dist(p[t], truth[t]) for t in common) / max(1, len(common)) for p in paths]


def decisions(out, event):
    with open(out / "events.csv") as file:
        return sum(row["event"] == event for row in csv.DictReader(file))


def moving(report, work, scenes):
    """An object that is pushed about: followed all the time, static when it rests."""
    sequence = sequence_of(work, "moving_object", scenes, "--quality", "draft", folder="scenes/stress")
    for odometry in ("simulated", "vo"):
        outs = {m: work / f"moving_{odometry}_{m}" for m in ("vo", "fused")}
        alone, fused = (run(out, sequence, "--method", m, "--odometry", odometry, "--initial", "detect", "--no-report")
                        for m, out in outs.items())
        text, tracked = f"moving_object, odometry {odometry}", fused["objects"]["orange_juice"]
        report.limit(f"{text}: mean_error_m", tracked["mean_error_m"], "<=", 0.004)
        report.limit(f"{text}: success_5cm_5deg", tracked["success_5cm_5deg"], ">=", 0.99)
        report.limit(f"{text}: found to move, times", decisions(outs["fused"], "moving"), ">=", 1)
        report.limit(f"{text}: found to rest, times", decisions(outs["fused"], "resting"), ">=", 1)
        report.note(f"{text}: ATE; of the odometry alone, m",
                    f"{fused['camera']['ate_mean_m']:.6f}; {alone['camera']['ate_mean_m']:.6f}")


def closed_loop(report, work, scene, sequence):
    outs = {m: work / f"{scene}_{m}" for m in ("vo", "ebt", "fused")}
    metrics = {m: run(out, sequence, "--method", m, "--odometry", "vo", "--initial", "detect")
               for m, out in outs.items()}
    fused, free = metrics["fused"], "occluded" not in scene
    ate, vo_ate = fused["camera"]["ate_mean_m"], metrics["vo"]["camera"]["ate_mean_m"]
    report.limit(f"{scene}, fused: ate_mean_m", ate, "<=", 0.003 if free else 0.005)
    report.line(f"{scene}: ATE no worse than vo's", f"{ate} against {vo_ate}",
                vo_ate is None or ate <= vo_ate + max(0.05 * vo_ate, 0.0002))
    report.limit(f"{scene}, fused: static objects found to move", decisions(outs["fused"], "moving"), "==", 0)
    for name, tracked in fused["objects"].items():
        report.limit(f"{scene}, fused, {name}: success_5cm_5deg from the start on",
                     from_start(outs["fused"], name, fused), ">=", 0.99)
        report.limit(f"{scene}, fused, {name}: mean_error_m", tracked["mean_error_m"], "<=", 0.002 if free else 0.004)
        report.note(f"{scene}, fused, {name}: map_nees", tracked["map_nees"])
        for other in ("vo", "ebt"):
            ours, theirs = mean_errors(sequence, name, (outs["fused"], outs[other]))
            report.line(f"{scene}, {name}: error no worse than {other}'s, common frames, m", f"{ours:.6f} against {theirs:.6f}",
                        ours <= theirs + max(0.05 * theirs, 0.0002))
            ratio = metrics[other]["objects"][name]["ratio_below_0_5_m"]
            report.limit(f"{scene}, {name}: ratio_below_0_5_m as {other}'s", tracked["ratio_below_0_5_m"], ">=", ratio)


def numbers(path):
    return [float(v) for l in path.read_text().splitlines() if l[0] != "#" for v in l.split()]


def repeatable(report, work, sequence):
    """A run's measurements, replayed to the mapper alone, give the run's poses, but for the rounding of the file."""
    first, again = work / "replay_first", work / "replay_again"
    run(first, sequence, "--method", "fused", "--odometry", "simulated", "--frames", "0:150")
    source = f"replay:{first / 'measurements.csv'}"
    run(again, sequence, "--method", "fused", "--odometry", source, "--tracker", source, "--frames", "0:150")
    for path in ("camera_online.txt", "camera.txt"):
        pairs = list(zip(numbers(first / path), numbers(again / path)))
        report.limit(f"replayed measurements: largest difference in {path}", max(abs(a - b) for a, b in pairs), "<=", 1e-9)


def smoother(report):
    tests(report, "unit tests of mapper and pipeline", "-R", "Mapper|Smoother|Gate|WrongMeasurements|Pipeline|Factor")
    printed(report, "clean measurements at the gate (99.9 +- 0.1%, 6 +- 0.1)", "mapper/mapper_test", "Gate.PassesClean*", "clean:")
    printed(report, "wrong measurements (25/25/25, 25/23/11, 11/-/-, 25/25/25)", "mapper/mapper_e2e_test", "WrongMeasurements.*", "wrong 50")
    exact = sh("build/release/tests/mapper/mapper_test", "--gtest_filter=ChainSmoother.EqualsCeres*", check=False)
    for text, pattern in (("cost, relative", r"Ceres (\S+) relative"), ("poses, m, rad", r"poses off by (\S+) m, (\S+) rad"),
                          ("joint covariance, in sigmas", r"covariance off by (\S+)")):
        found = [abs(float(v)) for m in re.finditer(pattern, exact.stdout) for v in m.groups()]
        report.limit(f"against the batch solution after full passes: {text}", max(found, default=None), "<=", 1e-6)
    result = sh("build/release/bench/mapper_bench", "--benchmark_filter=BM_Smoother|BM_CeresStep", "--benchmark_format=json")
    found = {r["name"].split("/iterations")[0]: r for r in json.loads(result.stdout)["benchmarks"]}
    times = {name: r["cpu_time"] for name, r in found.items()}
    long, short = times["BM_SmootherStep/20000"], times["BM_SmootherStep/1000"]
    report.limit("BM_SmootherStep/20000, ms", long, "<=", 0.05)
    report.limit("BM_SmootherStep: 20000 poses over 1000", long / short, "<=", 1.3)
    report.note("BM_SmootherStep/1000, 5000, ms", f"{short:.4f}, {times['BM_SmootherStep/5000']:.4f}")
    for poses in (1000, 5000, 20000):
        report.limit(f"memory with {poses} poses, kB per pose", found[f"BM_SmootherStep/{poses}"]["kB_per_pose"], "<=", 4)
    for poses in (1000, 5000):
        report.note(f"BM_CeresStep/{poses}, ms; times BM_SmootherStep",
                    f"{times[f'BM_CeresStep/{poses}']:.1f}; {times[f'BM_CeresStep/{poses}'] / times[f'BM_SmootherStep/{poses}']:.0f}")
    whole = found["BM_SmootherRun/20000"]
    report.note("20,000 steps: median, 99.9%, longest step, ms",
                ", ".join(f"{whole[key]:.3f}" for key in ("median_ms", "p99.9_ms", "max_ms")))
    report.limit("20,000 steps: time of a step, change per 1,000, %", abs(whole["time_slope_%"]), "<=", 1)
    report.limit("20,000 steps: memory of a pose, change per 1,000, %", abs(whole["memory_slope_%"]), "<=", 1)


def add_arguments(parser):
    parser.add_argument("--scenes", type=Path, metavar="DIR", help="sequences rendered before, DIR/orange_juice and so on")
    parser.add_argument("--only", choices=list(PIECES), help="measure one piece")
    parser.add_argument("--seeds", type=int, default=20, help="runs for the mean of map_nees")


def consistency(report, work, seeds):
    """Mean map_nees over seeds of the first frames of a scene."""
    nees = []
    for seed in range(1, seeds + 1):
        metrics = run(work / f"nees_{seed}", "scenes/orange_juice.yaml", "--frames", "0:100", "--seed", str(seed), "--quality", "draft")
        nees.append(metrics["objects"]["orange_juice"]["map_nees"])
    mean = sum(nees) / len(nees)
    report.line(f"mean map_nees of {seeds} seeds between 4 and 9", f"{mean:.2f}", 4 <= mean <= 9)


def worst_errors(metrics):
    """The errors that time may spoil: of the camera, and of each object."""
    errors = {"ATE": metrics["camera"]["ate_mean_m"]}
    for name, tracked in metrics["objects"].items():
        errors[name] = tracked["mean_error_m"]
        errors[f"{name} in the map"] = tracked["map_error_m"]
    return errors


def no_worse(report, text, errors, reference, share):
    for name, bound in reference.items():
        report.limit(f"{text}: {name}, m", errors[name], "<=", (1 + share) * bound + 0.001)


RESULTS = ("camera_online.txt", "camera.txt", "map.json", "frames.csv", "measurements.csv", "events.csv")


def in_time(report, work, scene, sequence):
    """Real time and latencies against lock-step, on the first 10 s of one object."""
    common = (sequence, "--initial", "detect", "--frames", "0:300", "--no-report")
    lock_step = run(work / f"{scene}_lock_step", *common)
    started = run(work / f"{scene}_realtime", *common, "--realtime")
    report.limit(f"{scene}, --realtime: frames dropped of {started['frames']}",
                 started["timing"]["dropped_frames"], "<=", 0.02 * started["frames"])
    no_worse(report, f"{scene}, --realtime", worst_errors(started), worst_errors(lock_step), 0.2)
    late = ("--set", "pipeline.latency_s.tracker=0.04", "--set", "pipeline.latency_s.odometry=0.01")
    outs = [work / f"{scene}_late_{k}" for k in (1, 2)]
    delayed = [run(out, *common, *late) for out in outs]
    no_worse(report, f"{scene}, latencies", worst_errors(delayed[0]), worst_errors(lock_step), 0.1)
    same = all((outs[0] / f).read_bytes() == (outs[1] / f).read_bytes() for f in RESULTS)
    report.line(f"{scene}, latencies: two runs, the same bytes", "same" if same else "different", same)


def speed(report, work, scene, sequence, bound):
    """Frames per second of the whole stack, reading included; best of three, since others may be at work as well."""
    runs = [run(work / f"{scene}_speed_{k}", sequence, "--initial", "given", "--frames", "0:300", "--no-report") for k in range(3)]
    report.limit(f"{scene}, {len(runs[0]['objects'])} objects: frames/s of the stack",
                 max(r["timing"]["frames_per_s"] for r in runs), ">=", bound)


def schedulers(report, work, scenes):
    for scene in ("pasta_box", "detergent"):
        in_time(report, work, scene, sequence_of(work, scene, scenes))
    for scene, bound in (("pasta_box", 200), ("multi_object", 120)):
        speed(report, work, scene, sequence_of(work, scene, scenes), bound)


def loop(report, work, scenes):
    for scene in SCENES:
        closed_loop(report, work, scene, sequence_of(work, scene, scenes))
    repeatable(report, work, sequence_of(work, "orange_juice", scenes))


PIECES = {
    "smoother": lambda report, work, arguments: smoother(report),
    "loop": lambda report, work, arguments: loop(report, work, arguments.scenes),
    "schedulers": lambda report, work, arguments: schedulers(report, work, arguments.scenes),
    "absence": lambda report, work, arguments: accept_absence.measure(report, work, arguments.scenes),
    "moving": lambda report, work, arguments: moving(report, work, arguments.scenes),
    "endless": lambda report, work, arguments: accept_endless.measure(
        report, work, sequence_of(work, "orange_juice", arguments.scenes)),
    "consistency": lambda report, work, arguments: consistency(report, work, arguments.seeds),
}


def measure(report, arguments):
    for name, piece in PIECES.items():
        if arguments.only in (None, name):
            with tempfile.TemporaryDirectory(prefix="diorama-accept-") as folder:
                piece(report, Path(folder), arguments)
