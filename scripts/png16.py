"""Grey PNG images of 8 or 16 bits, read and written without any package."""

import struct
import zlib
from pathlib import Path


def read(path):
    """Rows of pixel values, and the bits of a pixel."""
    data = Path(path).read_bytes()
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", body[:10])
            if colour != 0 or bits not in (8, 16):
                raise ValueError(f"{path} is not grey of 8 or 16 bits")
        elif kind == b"IDAT":
            packed += body
        at += 12 + size
    raw, step = zlib.decompress(packed), bits // 8
    stride = width * step
    rows, above = [], bytearray(stride)
    for y in range(height):
        start = y * (stride + 1)
        line = unfiltered(raw[start], bytearray(raw[start + 1:start + 1 + stride]), above, step)
        rows.append(list(struct.unpack(f">{width}H", line)) if bits == 16 else list(line))
        above = line
    return rows, bits


def unfiltered(kind, line, above, step):
    for i in range(len(line) if kind else 0):
        left, up = (line[i - step] if i >= step else 0), above[i]
        corner = above[i - step] if i >= step else 0
        line[i] = (line[i] + {1: left, 2: up, 3: (left + up) // 2, 4: paeth(left, up, corner)}[kind]) & 255
    return line


def paeth(left, up, corner):
    guess = left + up - corner
    return min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2]


def write(path, rows, bits):
    pack = (lambda row: struct.pack(f">{len(row)}H", *row)) if bits == 16 else bytes
    body = zlib.compress(b"".join(b"\0" + pack(row) for row in rows), 1)
    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), bits, 0, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        for kind, content in ((b"IHDR", header), (b"IDAT", body), (b"IEND", b"")):
            file.write(struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content)))
