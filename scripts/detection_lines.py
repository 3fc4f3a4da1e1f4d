"""The detector on unrelated views: what is there, and what is not."""

import csv
import math

from acceptance import ROOT, render, sh
from random_views import scene_of_views

VIEWS, SEED = 334, 2002  # not the views that the detector was made with
# Of right detections, asked; and an object that the scene does not have.
SCENES = {"orange_juice": (0.95, "pasta_box"), "pasta_box": (0.95, "detergent_bottle"), "detergent": (0.80, "orange_juice_carton")}


def is_right(row):
    return row["found"] == "1" and float(row["err_m"]) <= 0.05 and float(row["err_rad"]) <= math.radians(5)


def detection(report, work):
    absent = false = 0
    for name, (bound, missing) in SCENES.items():
        scene, sequence = work / f"{name}_views.yaml", work / f"{name}_views"
        scene.write_text(scene_of_views((ROOT / f"scenes/{name}.yaml").read_text(), VIEWS, SEED))
        render(sequence, "--quality", "draft", scene=scene)
        out = sh("build/release/bench/detector_views", sequence, "--absent", ROOT / f"models/{missing}/{missing}.obj").stdout
        rows = list(csv.DictReader(out.splitlines()))
        seen = [r for r in rows if r["present"] == "1" and float(r["visible_fraction"]) >= 0.5][:200]
        wrong = sum(r["found"] == "1" and not is_right(r) for r in seen)
        report.limit(f"{name}, {len(seen)} unrelated views: found within 5 cm, 5 deg", sum(map(is_right, seen)) / len(seen), ">=", bound)
        report.limit(f"{name}, {len(seen)} unrelated views: wrong detections", wrong / len(seen), "<=", 0.005)
        absent += sum(r["present"] == "0" for r in rows)
        false += sum(r["present"] == "0" and r["found"] == "1" for r in rows)
    report.limit(f"objects that are not there, {absent} frames: false detections", false, "<=", 1)
