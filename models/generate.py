#!/usr/bin/python3
"""Writes the models in this folder: OBJ, MTL, textures and the environment file.

    models/generate.py [NAME...]       regenerate all models, or the named ones, in place
    models/generate.py --check         regenerate into a temporary folder and compare byte for byte
"""

import argparse
import filecmp
import sys
import tempfile
from pathlib import Path

from generator.canvas import missing_fonts
from generator.catalogue import MODELS

HERE = Path(__file__).resolve().parent


def generate(names, root):
    for name in names:
        model = MODELS[name]()
        model.write(root / name)
        size = sum(f.stat().st_size for f in (root / name).iterdir())
        print(f"{name:24s} {model.triangles():7d} triangles {size / 1024:8.0f} KiB", flush=True)


def compare(names, root):
    """Files of `names` that differ between this folder and `root`."""
    different = []
    for name in names:
        files = {
            f.name
            for folder in (HERE / name, root / name) if folder.is_dir() for f in folder.iterdir()
        }
        for file in sorted(files):
            a, b = HERE / name / file, root / name / file
            if not (a.is_file() and b.is_file() and filecmp.cmp(a, b, shallow=False)):
                different.append(f"{name}/{file}")
    return different


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="models; all if none is given")
    parser.add_argument("--check", action="store_true", help="compare with what is there")
    arguments = parser.parse_args()
    names = arguments.names or sorted(MODELS)
    unknown = [name for name in names if name not in MODELS]
    if unknown:
        parser.error(f"no model {unknown[0]!r}; there are: {', '.join(sorted(MODELS))}")
    if missing_fonts():
        parser.error(f"fonts are missing: {', '.join(missing_fonts())}; see models/README.md")
    if not arguments.check:
        generate(names, HERE)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        generate(names, Path(folder))
        different = compare(names, Path(folder))
    for file in different:
        print(f"differs: {file}", file=sys.stderr)
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
