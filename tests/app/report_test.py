#!/usr/bin/env python3
"""The report in a headless Chromium, from disk. Ends with 77 (skipped) where there is no Chromium. report_test.py DIORAMA"""

import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
from browser import PROGRAM, Browser  # noqa: E402

DIORAMA = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT / "build/release/diorama"
EVIL = '<img src=x onerror="window.broken=1">'
KEYS = {
    "camera": ["ate_mean_m", "ate_std_m", "tracked_ratio"],
    "object": ["mean_error_m", "success_5cm_5deg", "reported_ratio", "false_claim_ratio"],
    "timing": ["wall_s", "frames_per_s", "render_ms", "vo_ms", "tracker_ms", "mapper_ms", "dropped_frames"],
}


def run_folder(folder, frames=40, truth=True, lost=False, name="box"):
    """A run as `diorama run` writes it, without a run."""
    pose = lambda k: f"{0.1 + 0.01 * k} 0 0 0 0 0 1"
    (folder / "objects").mkdir(parents=True)
    stamps = [f"{k / 30:.6f}" for k in range(frames)]
    known = [k for k in range(frames) if not lost]
    (folder / "camera_online.txt").write_text("".join(f"{stamps[k]} {pose(k)}\n" for k in range(frames)))
    (folder / f"objects/{name}.txt").write_text("".join(f"{stamps[k]} 0 0 0.5 0 0 0 1\n" for k in known))
    if truth:
        (folder / "truth/objects").mkdir(parents=True)
        (folder / "truth/camera.txt").write_text("".join(f"{stamps[k]} {pose(k)}\n" for k in range(frames)))
        (folder / f"truth/objects/{name}.txt").write_text("".join(f"{stamps[k]} 0 0 0.501 0 0 0 1\n" for k in range(frames)))
    (folder / "timing.csv").write_text("frame,timestamp,odometry_ms,tracker_ms,mapper_ms\n" + "".join(f"{k},{stamps[k]},1,2,0.5\n" for k in range(frames)))
    quoted = '"' + name.replace('"', '""') + '"'
    error = lambda k: "0.001,0.002,0.9" if truth and not lost else ",,"
    (folder / "errors.csv").write_text("frame,timestamp,object,held,err_m,err_rad,visible_fraction\n" + "".join(f"{k},{stamps[k]},{quoted},1,{error(k)}\n" for k in range(frames)))
    (folder / "events.csv").write_text("timestamp,source,event,value,reason\n" + (f'0.5,{quoted},lost,0,"{EVIL.replace(chr(34), chr(34) * 2)}"\n' if frames else ""))
    (folder / "models.json").write_text(json.dumps({name: {"vertices": [0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1], "triangles": [0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3]}}))
    figure = lambda v: v if truth and frames and not lost else None
    metrics = {"scene": EVIL, "method": "fused", "initial": "given", "seed": 1, "frames": frames, "start_frame": 0 if frames else None,
               "camera": {key: figure(0.0123) for key in KEYS["camera"]}, "objects": {name: {key: figure(0.456) for key in KEYS["object"]}},
               "timing": {key: 1.5 for key in KEYS["timing"]}, "peak_memory_mb": 100.5}
    metrics["objects"][name]["reported_ratio"] = 0 if lost else figure(1)
    (folder / "metrics.json").write_text(json.dumps(metrics))
    (folder / "run.yaml").write_text("seed: 1\ntracker:\n  max_samples: 7\n")
    (folder / "command.txt").write_text(f"diorama run '{EVIL}'\n")
    return folder


def report(*folders):
    page = folders[0].parent / f"{folders[0].name}.html"
    subprocess.run([DIORAMA, "report", *folders, "-o", page], check=True, capture_output=True)
    return page


def numbers(metrics):
    for part in ("camera", "timing"):
        yield from ((f"{part}.{key}", value) for key, value in metrics[part].items())
    for name, values in metrics["objects"].items():
        yield from ((f"objects.{name}.{key}", value) for key, value in values.items())


class Report(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory(prefix="diorama-report-")
        cls.browser = Browser()

    @classmethod
    def tearDownClass(cls):
        cls.browser.__exit__()
        cls.scratch.cleanup()

    def folder(self, place, **options):
        return run_folder(Path(self.scratch.name) / place, **options)

    def open(self, page, width=1280):
        self.browser.resize(width, 900)
        self.browser.open(page)
        self.assertEqual(self.browser.errors, [])
        self.assertEqual([r for r in self.browser.requests if not r.startswith(("file:", "data:", "blob:"))], [])
        self.assertEqual(len([r for r in self.browser.requests if r.startswith("file:")]), 1)
        self.assertLess(Path(page).stat().st_size, 3_000_000)
        self.assertFalse(self.browser.value("window.broken === 1"))
        self.assertLessEqual(self.browser.value("document.documentElement.scrollWidth"), width)

    def test_shows_every_figure_of_metrics_json(self):
        folder = self.folder("figures")
        self.open(report(folder))
        shown = self.browser.value("Object.fromEntries([...document.querySelectorAll('[data-path]')].map((n) => [n.dataset.path, n.dataset.value]))")
        for path, value in numbers(json.loads((folder / "metrics.json").read_text())):
            with self.subTest(path):
                self.assertEqual(json.loads(shown[path]), value)
        self.assertEqual(self.browser.value("document.querySelector('h1').textContent"), EVIL)

    def test_what_is_not_known_is_a_dash(self):
        self.open(report(self.folder("unknown", truth=False)))
        shown = self.browser.value("[...document.querySelectorAll('[data-value=null]')].map((n) => n.textContent)")
        self.assertGreater(len(shown), 3)
        self.assertEqual(set(shown), {"–"})

    def test_the_parts_move_together(self):
        self.open(report(self.folder("moves")))
        place = "document.querySelector('.playhead').style.left"
        picture = "diorama.viewer.canvas.toDataURL()"
        settle = "new Promise((done) => setTimeout(done, 300))"
        self.browser.value(settle)
        before = self.browser.value(place), self.browser.value(picture)
        self.browser.key("ArrowRight")
        self.assertEqual(self.browser.value("diorama.timeline.index"), 1)
        self.browser.key("End")
        self.browser.value(settle)
        self.assertEqual(self.browser.value("diorama.timeline.index"), 39)
        after = self.browser.value(place), self.browser.value(picture)
        self.assertNotEqual(before[0], after[0])
        self.assertNotEqual(before[1], after[1])
        box = self.browser.value("(({x, y, width, height}) => [x + width / 2, y + height / 2])(diorama.viewer.canvas.getBoundingClientRect())")
        self.browser.drag(*box, 120, 40)
        self.browser.value(settle)
        self.assertNotEqual(self.browser.value(picture), after[1])
        self.browser.key(" ", "Space", " ")
        self.browser.wait("diorama.timeline.index < 39 && diorama.timeline.playing")
        self.browser.key(" ", "Space", " ")

    def test_without_truth_lost_and_empty(self):
        for name, options in {"no_truth": {"truth": False}, "lost": {"lost": True}, "empty": {"frames": 0}, "markup": {"name": "<b>a&amp;\"b\"<b>"}}.items():
            with self.subTest(name):
                for width in (1280, 390):
                    self.open(report(self.folder(f"{name}{width}", **options)), width)
                    self.assertGreater(self.browser.value("document.body.innerText.length"), 500)

    def test_two_runs_side_by_side(self):
        self.open(report(self.folder("first"), self.folder("second", frames=30)))
        self.assertIn("Run B", self.browser.value("document.body.innerText"))

    def test_light_and_dark(self):
        page = report(self.folder("themes"))
        colors = []
        for dark in (False, True):
            self.browser.dark(dark)
            self.open(page)
            colors.append(self.browser.value("getComputedStyle(document.body).backgroundColor"))
        self.browser.key("t", "KeyT", "t")
        colors.append(self.browser.value("getComputedStyle(document.body).backgroundColor"))
        self.assertNotEqual(colors[0], colors[1])
        self.assertEqual(colors[0], colors[2])
        self.browser.value("localStorage.clear()")


if __name__ == "__main__":
    if not PROGRAM:
        print("no Chromium: the report is not looked at")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
