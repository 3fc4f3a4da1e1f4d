"""Objects that nobody sees for 5 s while the camera moves, and an object that is found from another one's prediction."""

import csv
import math

from acceptance import render, run

# Scene, object, and what hides it: a board before it, and a camera that looks past the desk's end, and at the far wall.
HIDDEN = {
    "covered": ("multi_object", "pasta_box",
                "occlude=[{object: pasta_box, occluder: board, visible_fraction: [[2.0, 1.0], [2.6, 0.0], [7.6, 0.0], [8.2, 1.0]]}]"),
    "aside": ("orange_juice", "orange_juice", "path.glances=[{t: [2.0, 8.6], turn_s: 1.0, look_at: [1.2, -0.8, 0.0]}]"),
    "away": ("orange_juice", "orange_juice", "path.glances=[{t: [2.0, 8.6], turn_s: 1.0, look_at: [1.8, -0.3, 1.0]}]"),
}
# At the far wall `vo` drifts by centimetres: there the object is looked for, as anywhere else in the picture. Elsewhere there is no detector.
DETECTED = (("away", "vo"),)
VISIBLE = 0.3
ENOUGH_S = 4.8  # hidden; "5 s" but for the frames in which it goes


def sequence(work, case, scenes):
    scene, _, hide = HIDDEN[case]
    if scenes and (scenes / f"absence_{case}").exists():
        return scenes / f"absence_{case}"
    out = work / f"absence_{case}"
    if not out.exists():
        render(out, "--quality", "draft", "--frames", "0:330", "--set", hide, scene=f"scenes/{scene}.yaml")
    return out


def absence(report, text, out, name):
    """Of the first long absence: the predicted pose's error at its end, and when the object is tracked again."""
    with open(out / "errors.csv") as file:
        rows = [r for r in csv.DictReader(file) if r["object"] == name]
    seen = [float(r["visible_fraction"] or 0) for r in rows]
    first = next(k for k, fraction in enumerate(seen) if fraction <= 0.001)
    last = next(k for k in range(first, len(seen)) if seen[k] > 0.001) - 1
    hidden_s = float(rows[last]["timestamp"]) - float(rows[first]["timestamp"])
    report.limit(f"{text}: hidden for, s", hidden_s, ">=", ENOUGH_S)
    report.limit(f"{text}: predicted at the end, m", float(rows[last]["err_m"] or "inf"), "<=", 0.02)
    report.limit(f"{text}: predicted at the end, degrees", math.degrees(float(rows[last]["err_rad"] or "inf")), "<=", 2)
    back = next(k for k in range(last, len(seen)) if seen[k] >= VISIBLE)
    again = next((k for k in range(last + 1, len(seen)) if rows[k]["held"] == "1"), math.inf)
    report.limit(f"{text}: tracked again, frames after 30% visible", again - back, "<=", 5)


def without_odometry(measurements, out, from_s):
    """The measurements of a run, those of the odometry until a time only."""
    lines = measurements.read_text().splitlines()
    kind = lines[0].split(",").index("kind")
    kept = [l for l in lines[1:] if l.split(",")[kind] != "odometry" or int(l.split(",")[0]) < 1e9 * from_s]
    out.write_text("\n".join(lines[:1] + kept) + "\n")


def measure(report, work, scenes):
    for case, (_, name, _) in HIDDEN.items():
        for odometry in ("vo", "simulated"):
            out = work / f"absence_{case}_{odometry}"
            initial = "detect" if (case, odometry) in DETECTED else "given"
            run(out, sequence(work, case, scenes), "--initial", initial, "--odometry", odometry, "--no-report")
            absence(report, f"{name} {case}, odometry {odometry}", out, name)
    # Detection is off, since the initial poses are given; the camera is known from the objects that are seen.
    cut = work / "without_odometry.csv"
    without_odometry(work / "absence_covered_vo" / "measurements.csv", cut, 2.7)
    out = work / "absence_helped"
    run(out, sequence(work, "covered", scenes), "--initial", "given", "--odometry", f"replay:{cut}", "--no-report")
    absence(report, "pasta_box from the bottle, no odometry, no detection", out, "pasta_box")
