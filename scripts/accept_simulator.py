"""The simulator: two renderers, speed, truth that proves itself, identical bytes, hostile input."""

import json
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import accept_tampering
from acceptance import DIORAMA, ROOT, SCENE, printed, render, sh, tests

SMALL = [f"--set={key}" for key in ("camera.width=160", "camera.height=120", "camera.fx=130.7", "camera.fy=130.85",
                                    "camera.cx=79.27", "camera.cy=60.4")]


def agreement(report, work):
    for camera in ("pinhole", "distorted"):
        printed(report, f"ray and raster on 20 frames, {camera}: ids 99.9%, depth 0.5 mm", "sim/sim_e2e_test",
                f"*RendererAgreement*/{camera}", "with another id")
    tests(report, "sub-pixel corners: 0.02 px (ray), 0.05 px (raster)", "-R", "CheckerboardCorner|PixelCentre")


def truth(report, work):
    for text, selection in {
        "distortion against cv::projectPoints": "Camera.ProjectsLikeOpenCv",
        "blur against 64 sharp sub-frames": "Blur",
        "noise variance follows its model": "Sensor.Noise",
        "rolling rows carry their own pose": "RollingShutter",
        "recorded poses are reproduced": "RecordedPath",
        "flow closes with depth and poses in memory, 0.01 px": "Flow",
        "BOP boxes, counts and conventions; TUM and EuRoC to the letter": "Bop|Euroc|Tum",
    }.items():
        tests(report, text, "-R", selection)


def benchmark():
    """Frames a second of each benchmark, and the scene's triangles."""
    result = sh("build/release/bench/sim_bench", "--benchmark_filter=BM_RenderFrame", "--benchmark_format=json")
    runs = json.loads(result.stdout)["benchmarks"]
    return {r["name"].split("/")[1]: 1e3 / r["real_time"] for r in runs}, runs[0].get("triangles")


def speed(report, work):
    rates, triangles = benchmark()
    report.limit("triangles of the scene", triangles, ">=", 80000)
    for name, bound in {"ray_draft": 80, "ray_standard": 30, "ray_high": 10, "raster_draft": 10}.items():
        report.limit(f"BM_RenderFrame/{name}, frames/s", rates.get(name), ">=", bound)
    render(work / "warm", "--frames", "0:1", "--quality", "draft")  # the light is baked and kept
    times = []
    for frames in (1, 201):
        begin = time.monotonic()
        render(work / f"files_{frames}", "--frames", f"0:{frames}")
        times.append(time.monotonic() - begin)
    ratio = 200 / (times[1] - times[0]) / rates["ray_standard"]
    report.limit("frames/s with files written over those of ray_standard, both without the start", ratio, ">=", 0.7)
    report.note("the start of render, with its first frame, s", f"{times[0]:.1f}")


def baking(report, work):
    begin = time.monotonic()
    render(work / "baked", "--frames", "0:1", "--quality", "draft",
           env={**os.environ, "DIORAMA_CACHE": str(work / "empty_cache")})
    report.limit("first frame with an empty cache, s", time.monotonic() - begin, "<=", 30)


def fractions(report, work):
    printed(report, "visible fractions within 0.02 at every frame", "sim/sim_e2e_test", "*OccludedScene*", "off by at most")


def scenes(report, work):
    for file in sorted([*(ROOT / "scenes").glob("*.yaml"), *(ROOT / "scenes/stress").glob("*.yaml")]):
        out = work / "scene"
        render(out, "--frames", "0:6", "--quality", "draft", "--truth", "normal,flow", scene=file)
        check(report, f"check of {file.relative_to(ROOT)}, 6 frames", out)
        shutil.rmtree(out)
    render(work / "small", "--frames", "0:200", "--quality", "draft", *SMALL)
    check(report, "check of 200 frames of 160 x 120", work / "small")


def check(report, text, sequence):
    result = sh(DIORAMA, "check", sequence, "--json", check=False)
    findings = json.loads(result.stdout)["findings"]
    report.line(text, f"{len(findings)} findings" + "".join(f"; {f['file']}: {f['what']}" for f in findings[:2]),
                result.returncode == 0)


def tampering(report, work):
    accept_tampering.measure(report, work)


def identical(report, work):
    manifests = []
    for name, cores in (("two", "0,1"), ("one", "0"), ("again", "0,1")):
        sh("taskset", "-c", cores, DIORAMA, "render", SCENE, "-o", work / name, "--frames", "0:6")
        manifests.append((work / name / "manifest.csv").read_bytes())
    report.line("same bytes twice, with 1 and 2 threads", "sums of all files", len(set(manifests)) == 1)
    tests(report, "same bytes after kill -9 and --resume, and for frames A:B alone", "-R", "Sequences.Killed")


def memory(report, work):
    out = work / "long"
    process = subprocess.Popen([DIORAMA, "render", ROOT / "scenes/stress/handheld.yaml", "-o", out, "--frames", "0:2010",
                                "--quality", "draft"], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    resident = {}
    while process.poll() is None and len(resident) < 2:
        done = sum(1 for folder in (out / "rgb", out / "partial/rgb") if folder.is_dir() for _ in folder.iterdir())
        for frame in (200, 2000):
            if done >= frame and frame not in resident:
                status = Path(f"/proc/{process.pid}/status").read_text()
                resident[frame] = int(status.split("VmRSS:")[1].split()[0]) / 1024
        time.sleep(0.05)
    process.kill()
    process.wait()
    ratio = resident[2000] / resident[200] if len(resident) == 2 else None
    report.limit(f"memory at frame 2000 over that at frame 200 ({resident.get(200, 0):.0f} MB)", ratio, "<=", 1.05)


def hostile(report, work):
    printed(report, "1000 mutated scenes, 1000 mutated meshes", "sim/sim_test", "Hostile.MutatedScenes:Hostile.MutatedMeshes",
            "[       OK ]", env={**os.environ, "DIORAMA_MUTATIONS": "1000"})


def avx2(report, work):
    """The same binary on an emulated Haswell, which ends a program at its first AVX-512 instruction."""
    if shutil.which("qemu-x86_64") is None:
        report.note("the same binary on a processor with AVX2 only", "not measured (needs Debian's qemu-user)")
        return
    arguments = ["render", SCENE, "--frames", "0:1", *SMALL]
    sh(DIORAMA, *arguments, "-o", work / "native")
    emulated = sh("qemu-x86_64", "-cpu", "Haswell", DIORAMA, *arguments, "-o", work / "emulated", check=False)
    same = emulated.returncode == 0 and all(
        (work / "native" / f).read_bytes() == (work / "emulated" / f).read_bytes() for f in ("rgb/000000.png", "depth/000000.png"))
    report.line("the same binary on a processor with AVX2 only (emulated Haswell)",
                f"exit {emulated.returncode}, {'the same' if same else 'other'} bytes", emulated.returncode == 0)


PIECES = {f.__name__: f for f in (agreement, truth, speed, baking, fractions, scenes, tampering, identical, memory, hostile, avx2)}


def add_arguments(parser):
    parser.add_argument("--only", nargs="+", choices=PIECES, default=list(PIECES), metavar="PIECE",
                        help="some of: " + " ".join(PIECES))


def measure(report, arguments):
    with tempfile.TemporaryDirectory(prefix="diorama-accept-") as folder:
        for name in arguments.only:
            work = Path(folder) / name
            work.mkdir()
            PIECES[name](report, work)
            shutil.rmtree(work)
    report.note("frames of each scene that a stranger takes for photographs", "to be looked at")
