"""What the measurements of all issues share: the report and how programs are run."""

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
