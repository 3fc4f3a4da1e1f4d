"""What the measurements of all issues share: the report and how programs are run."""

import json
import math
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DIORAMA = ROOT / "build/release/diorama"
SCENE = "scenes/orange_juice.yaml"


class Report:
    def __init__(self):
        self.missed = 0

    def note(self, text, figure):
        print(f"--      {text:<74} {figure}", flush=True)

    def line(self, text, figure, good):
        self.missed += not good
        print(f"{'ok    ' if good else 'MISSED'}  {text:<74} {figure}", flush=True)

    def limit(self, text, value, relation, bound):
        good = value is not None and {"<=": value <= bound, ">=": value >= bound, "==": value == bound}[relation]
        self.line(f"{text} {relation} {bound:g}", "unknown" if value is None else f"{value:.6g}", good)


def sh(*command, check=True, **options):
    result = subprocess.run([str(c) for c in command], cwd=ROOT, capture_output=True, text=True, **options)
    if check and result.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: exit {result.returncode}\n{result.stdout[-2000:]}{result.stderr[-2000:]}")
    return result


def render(out, *arguments, scene=SCENE, **options):
    return sh(DIORAMA, "render", scene, "-o", out, *arguments, **options)


def add_scenes(parser):
    parser.add_argument("--scenes", type=Path, metavar="DIR",
                        help="sequences rendered before, DIR/orange_juice and so on; others are rendered here")


def sequence_of(work, scene, scenes):
    name = Path(scene).name
    if scenes and (scenes / name).exists():
        return scenes / name
    if not (work / f"{name}_sequence").exists():
        render(work / f"{name}_sequence", scene=f"scenes/{scene}.yaml")
    return work / f"{name}_sequence"


def run(out, *arguments):
    sh(DIORAMA, "run", *arguments, "-o", out, "--no-video")
    return json.loads((out / "metrics.json").read_text())


def bench(binary, selection, time):
    """Milliseconds of each benchmark by its name, without the parts that only say how it is repeated."""
    result = sh(f"build/release/bench/{binary}", f"--benchmark_filter={selection}", "--benchmark_format=json")
    return {r["name"].split("/iterations")[0]: r[time] for r in json.loads(result.stdout)["benchmarks"]}


def compare_to_other_tracker(report, run_folder, reference, median_mm, worst_mm):
    """The cube video's path against POSES: one line a frame, index and the 16 numbers of camera_T_object, row-major."""
    rows = [l.split() for l in next((run_folder / "objects").iterdir()).read_text().splitlines() if l and l[0] != "#"]
    path = [[float(v) for v in row[1:4]] for row in rows]
    report.limit("real cube, ebt: frames with a pose", len(path), "==", 218)
    if reference is None:
        report.note("real cube against another tracker", "not measured (--visp POSES)")
        return
    poses = {int(l.split()[0]): [float(l.split()[i]) for i in (4, 8, 12)] for l in reference.read_text().splitlines()}
    gaps = sorted(1e3 * math.dist(p, poses[k]) for k, p in enumerate(path) if k in poses)
    report.limit("real cube: median distance to the other tracker, mm", gaps[len(gaps) // 2], "<=", median_mm)
    report.limit("real cube: worst distance to the other tracker, mm", gaps[-1], "<=", worst_mm)


def tests(report, text, *selection, preset="release"):
    result = sh("ctest", "--test-dir", f"build/{preset}", "--no-tests=error", *selection, check=False)
    summary = [l for l in result.stdout.splitlines() if "tests passed" in l]
    report.line(text, summary[0] if summary else result.stdout[-200:] + result.stderr[-200:], result.returncode == 0)


def printed(report, text, binary, selection, pattern, **options):
    """Runs tests of one binary; the figures are the lines they print that contain the pattern."""
    result = sh(f"build/release/tests/{binary}", f"--gtest_filter={selection}", check=False, **options)
    lines = [l.strip() for l in result.stdout.splitlines() if pattern in l]
    ran = any("[  PASSED  ]" in l and " 0 tests" not in l for l in result.stdout.splitlines())
    report.line(text, "; ".join(lines) if lines else result.stdout[-200:], ran and result.returncode == 0)
