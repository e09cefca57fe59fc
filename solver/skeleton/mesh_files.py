"""Bone meshes from files (VTP, OBJ, STL), thinned to what a browser draws quickly, and kept on disk."""

import base64
import hashlib
import os
import re
import sys
import zipfile
import zlib
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

import numpy as np
import trimesh
from defusedxml import DefusedXmlException
from jaxtyping import Float, Int

from solver.capture.atomic import made_folder, whole_file
from solver.common.errors import CaptureError, ModelError
from solver.skeleton.osim_document import bounded_parser

SUFFIXES = (".vtp", ".obj", ".stl")
_DTYPES = {
    "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4",
    "Int64": "i8", "UInt64": "u8", "Float32": "f4", "Float64": "f8",
}  # fmt: skip
_LARGEST_ARRAY = 256 * 2**20  # bytes; a bone has thousands of points, a bomb has billions
_MOST_NUMBERS = 4_000_000  # of an array in plain text: corners of more than a million triangles
_MOST_BLOCKS = 100_000  # of a compressed array; VTK makes 8192 of the largest
_APPENDED = re.compile(rb"<AppendedData\b([^>]*)>\s*_")


TRIANGLES_PER_SQUARE_METRE = 5000.0  # ribs and vertebrae are all surface
TRIANGLES_PER_METRE = 800.0  # of the bounding box's diagonal, for the slender bones of hand and foot
FEWEST_TRIANGLES = 60  # below this a phalanx is a splinter
MOST_TRIANGLES = 2500  # a whole body stays near 12 000, which software rendering still moves
AGGRESSIONS = (3, 5, 7)  # gentle first: 7 tears ribs, but 3 cannot thin a dense phalanx
LARGEST_FILE = 64 * 2**20  # bytes; a bone scan of a million triangles
_THINNING = (TRIANGLES_PER_SQUARE_METRE, TRIANGLES_PER_METRE, FEWEST_TRIANGLES, MOST_TRIANGLES, AGGRESSIONS)


def load_mesh(path: Path) -> trimesh.Trimesh:
    """A thinned mesh, in the file's own unit and frame.

    Raises:
        ModelError: the file is missing, too large, of another format, or holds no triangle.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise ModelError(f"{path}: bone meshes are read from {', '.join(SUFFIXES)}.")
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise ModelError(f"{path}: larger than {LARGEST_FILE // 2**20} MB. Thin the mesh first.")
        content = path.read_bytes()
    except OSError as error:
        raise ModelError(f"{path}: cannot be read ({error.strerror}).") from error
    key = hashlib.sha256(content + path.suffix.lower().encode() + repr(_THINNING).encode()).hexdigest()[:32]
    kept = cache_folder() / "bones" / f"{key}.npz"
    mesh = _kept_mesh(kept)
    if mesh is None:
        mesh = _thinned(_read(path))
        _keep(mesh, kept)
    return mesh


def cache_folder() -> Path:
    """Where this user's programs keep what they can make again."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "addb-viewer"


def _read(path: Path) -> trimesh.Trimesh:
    if path.suffix.lower() == ".vtp":
        points, triangles = read_vtp(path)
        mesh = trimesh.Trimesh(points, triangles, process=True)
    else:
        try:
            with path.open("rb") as file:
                # No path goes along, so an .obj cannot make us open its material files.
                mesh = trimesh.load_mesh(file, file_type=path.suffix.lower()[1:], skip_materials=True)
        except Exception as error:  # trimesh's readers raise whatever their parsing met
            raise ModelError(f"{path}: not a readable mesh ({error}). Export it again.") from error
        if not isinstance(mesh, trimesh.Trimesh):
            raise ModelError(f"{path}: holds no triangles.")
    if len(mesh.faces) == 0 or not np.isfinite(mesh.vertices).all():
        raise ModelError(f"{path}: holds no triangles with finite corners.")
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)


def _thinned(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    wanted = TRIANGLES_PER_SQUARE_METRE * mesh.area + TRIANGLES_PER_METRE * diagonal
    target = int(np.clip(wanted, FEWEST_TRIANGLES, MOST_TRIANGLES))
    thinned = mesh
    for aggression in AGGRESSIONS:
        if len(thinned.faces) <= 1.1 * target:
            break
        thinned = mesh.simplify_quadric_decimation(face_count=target, aggression=aggression)
    # In single precision, as it's kept: the second time must give what the first gave.
    return trimesh.Trimesh(thinned.vertices.astype(np.float32), thinned.faces, process=False)


def _kept_mesh(path: Path) -> trimesh.Trimesh | None:
    try:
        with np.load(path, allow_pickle=False) as arrays:
            return trimesh.Trimesh(arrays["vertices"], arrays["faces"], process=False)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def _keep(mesh: trimesh.Trimesh, path: Path) -> None:
    """Whole or not at all.

    A home that cannot be written costs half a second at the next start, nothing else.
    """
    with suppress(CaptureError), whole_file(made_folder(path.parent) / path.name) as file:
        np.savez(file, vertices=mesh.vertices.astype(np.float32), faces=mesh.faces.astype(np.int32))


def read_vtp(path: Path) -> tuple[Float[np.ndarray, "points 3"], Int[np.ndarray, "triangles 3"]]:
    """Points [the file's unit] and triangles; polygons are split into fans, strips into triangles.

    Raises:
        ModelError: the file is no PolyData, is truncated, or names points that it does not hold.
    """
    try:
        points, triangles = _PolyData(path.read_bytes()).surface()
    except (ParseError, DefusedXmlException, ValueError, KeyError, zlib.error) as error:
        raise ModelError(
            f"{path}: not a readable VTK PolyData mesh ({error}). Export it again as .vtp, .obj or .stl."
        ) from error
    if triangles.size and (triangles.min() < 0 or triangles.max() >= len(points)):
        raise ModelError(f"{path}: a polygon names point {triangles.max()}, but there are {len(points)}.")
    return points, triangles


@dataclass(frozen=True)
class _Header:
    """How binary arrays are led: integer type, byte order, compressed or not."""

    integer: str
    order: str
    compressed: bool


class _PolyData:
    def __init__(self, content: bytes) -> None:
        self.appended, self.appended_raw = b"", False
        lead = _APPENDED.match(content, max(0, content.find(b"<AppendedData")))
        end = content.rfind(b"</AppendedData", lead.end()) if lead else -1
        if lead is not None and end >= 0:  # cut out, as raw bytes are no XML
            self.appended = content[lead.end() : end]
            self.appended_raw = b"raw" in lead.group(1)
            content = content[: lead.end() - 1] + content[end:]
        parser = bounded_parser(longest_text=2 * _LARGEST_ARRAY)
        parser.feed(content)
        root = parser.close()
        if root.tag != "VTKFile" or root.get("type") != "PolyData":
            raise ValueError(f"the root element is <{root.tag} type='{root.get('type')}'>")
        self.pieces = root.findall("./PolyData/Piece")
        self.header = _Header(
            integer=_DTYPES[root.get("header_type", "UInt32")],
            order=">" if root.get("byte_order") == "BigEndian" else "<",
            compressed=root.get("compressor") is not None,
        )
        if root.get("compressor") not in (None, "vtkZLibDataCompressor"):
            raise ValueError(f"compressor {root.get('compressor')}")

    def surface(self) -> tuple[np.ndarray, np.ndarray]:
        points, triangles = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int64)]
        for piece in self.pieces:
            first = sum(len(p) for p in points)
            array = piece.find("./Points/DataArray")
            if array is not None:
                points.append(self._array(array).astype(float).reshape(-1, 3))
            for tag, split in (("Polys", _fans), ("Strips", _strips)):
                connectivity, offsets = self._cells(piece, tag)
                triangles.append(split(connectivity, offsets) + first)
        return np.concatenate(points), np.concatenate(triangles)

    def _cells(self, piece: Element, tag: str) -> tuple[np.ndarray, np.ndarray]:
        arrays = {a.get("Name"): a for a in piece.findall(f"./{tag}/DataArray")}
        if "connectivity" not in arrays or "offsets" not in arrays:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        connectivity, offsets = (self._array(arrays[k]).astype(np.int64) for k in ("connectivity", "offsets"))
        if offsets.size and (
            np.any(np.diff(offsets) < 0) or offsets[0] < 0 or offsets[-1] > connectivity.size
        ):
            raise ValueError(f"<{tag}> offsets point outside the connectivity")
        return connectivity, offsets

    def _array(self, array: Element) -> np.ndarray:
        dtype = np.dtype(_DTYPES[array.get("type", "Float32")])
        form = array.get("format", "ascii")
        if form == "ascii":
            words = (array.text or "").split(maxsplit=_MOST_NUMBERS)
            if len(words) > _MOST_NUMBERS:
                raise ValueError(f"a data array holds more than {_MOST_NUMBERS} numbers")
            return np.array(words, dtype=dtype)
        dtype = np.dtype(self.header.order + dtype.str[1:])
        if form == "binary":
            return np.frombuffer(self._encoded((array.text or "").strip().encode()), dtype=dtype)
        if form != "appended":
            raise ValueError(f"data array format '{form}'")
        stretch = self.appended[int(array.get("offset", "0")) :]
        content = _unpacked(stretch, self.header) if self.appended_raw else self._encoded(stretch)
        return np.frombuffer(content, dtype=dtype)

    def _encoded(self, text: bytes) -> bytes:
        """Base64: lead and data encoded as one; if compressed (some writers: always) one after the other."""
        width = np.dtype(self.header.integer).itemsize
        if not self.header.compressed:
            lead = _decoded(text, width)
            size = int(self._integers(lead, 1)[0])
            if text[: _encoded_length(width)].endswith(b"="):
                return _decoded(text[_encoded_length(width) :], size)
            return _unpacked(_decoded(text, width + size), self.header)
        blocks = _checked_blocks(int(self._integers(_decoded(text, width), 1)[0]))
        lead_bytes = width * (3 + blocks)
        lead = _decoded(text, lead_bytes)
        data = _decoded(text[_encoded_length(lead_bytes) :], int(self._integers(lead, 3 + blocks)[3:].sum()))
        return _unpacked(lead + data, self.header)

    def _integers(self, content: bytes, count: int) -> np.ndarray:
        return np.frombuffer(content, dtype=self.header.order + self.header.integer, count=count).astype(
            np.int64
        )


def _unpacked(content: bytes, header: _Header) -> bytes:
    """The array behind its lead: a byte count; compressed, [blocks, block size, last block size, sizes…]."""
    dtype = np.dtype(header.order + header.integer)
    if not header.compressed:
        size = _checked(int(np.frombuffer(content, dtype, 1)[0]))
        return _exactly(content[dtype.itemsize :], size)
    blocks, size, last = (int(n) for n in np.frombuffer(content, dtype, 3))
    sizes = np.frombuffer(content, dtype, 3 + _checked_blocks(blocks))[3:].astype(np.int64)
    whole = _checked(size * max(blocks - 1, 0) + (last or size))
    start, parts = dtype.itemsize * (3 + blocks), []
    for packed in sizes:
        block = _exactly(content[start : start + _checked(int(packed))], int(packed))
        parts.append(zlib.decompressobj().decompress(block, max(whole, 1)))  # 0: no limit
        whole -= len(parts[-1])
        start += int(packed)
        if whole < 0:
            raise ValueError("a data array's blocks hold more than it announces")
    return b"".join(parts)


def _decoded(text: bytes, size: int) -> bytes:
    return _exactly(base64.b64decode(text[: _encoded_length(_checked(size))]), size)


def _encoded_length(size: int) -> int:
    return 4 * ((size + 2) // 3)


def _exactly(content: bytes, size: int) -> bytes:
    if len(content) < size:
        raise ValueError(f"a data array is cut off: {len(content)} of {size} bytes")
    return content[:size]


def _checked(size: int) -> int:
    if not 0 <= size <= _LARGEST_ARRAY:
        raise ValueError(f"a data array claims {size} bytes")
    return size


def _checked_blocks(count: int) -> int:
    if not 0 <= count <= _MOST_BLOCKS:
        raise ValueError(f"a data array claims {count} compressed blocks")
    return count


def _fans(connectivity: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    starts = np.append(0, offsets)[:-1]
    counts = offsets - starts
    polygon = np.repeat(np.arange(len(offsets)), np.maximum(counts - 2, 0))
    first = np.concatenate([[0], np.cumsum(np.maximum(counts - 2, 0))])[:-1]
    step = np.arange(len(polygon)) - first[polygon]
    corner = starts[polygon]
    return connectivity[np.stack([corner, corner + step + 1, corner + step + 2], axis=1)]


def _strips(connectivity: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    triangles = []
    for start, end in zip(np.append(0, offsets)[:-1], offsets, strict=True):
        strip = connectivity[start:end]
        for i in range(len(strip) - 2):
            triangles.append(strip[i : i + 3] if i % 2 == 0 else strip[[i + 1, i, i + 2]])
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)
