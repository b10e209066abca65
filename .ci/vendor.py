"""Fetch the studio's parts of others from the npm registry, pinned, and write them with their licences and digests.

    python .ci/vendor.py

Needs npm. `tests/studio/test_vendored.py` holds what is there against the digests, without a network. What is changed in a file on the
way is written in `PARTS`: a bare import becomes a relative one, for a page has no package manager.
"""

import base64
import hashlib
import json
import shutil
import subprocess
import sys
import tarfile
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

TARGET = Path(__file__).parents[1] / "rcsc" / "studio" / "page" / "vendor"


@dataclass(frozen=True)
class Part:
    """A package: its version, what the registry says of its bytes, and the files that are taken.

    Attributes:
        files: By the path in the package the path in `vendor`.
        changes: What is written in place of what, in every file of it.
    """

    name: str
    version: str
    licence: str
    integrity: str
    files: dict[str, str]
    changes: dict[str, str] = field(default_factory=dict)


PARTS = (
    Part(
        "uplot", "1.6.32", "MIT",
        "sha512-KIMVnG68zvu5XXUbC4LQEPnhwOxBuLyW1AHtpm6IKTXImkbLgkMy+jabjLgSLMasNuGGzQm/ep3tOkyTxpiQIw==",
        {"LICENSE": "uplot/LICENSE", "dist/uPlot.esm.js": "uplot/uPlot.js", "dist/uPlot.min.css": "uplot/uPlot.css"},
    ),
    Part(
        "three", "0.187.0", "MIT",
        "sha512-Qiu7R+Cmh8CstZsY1uJOSWnVlfo7ZtNLV7mF8Jltk3LB3AtDu9cRZlcnRKkAk8Y4z6KKw35z7Y7Urd7jWY8etA==",
        {
            "LICENSE": "three/LICENSE", "build/three.module.js": "three/three.module.js", "build/three.core.js": "three/three.core.js",
            "examples/jsm/controls/OrbitControls.js": "three/OrbitControls.js",
        },
        {"from 'three'": "from './three.module.js'"},
    ),
)  # fmt: skip


def main() -> None:
    """Write everything anew."""
    shutil.rmtree(TARGET, ignore_errors=True)
    said = {}
    with tempfile.TemporaryDirectory() as folder:
        for part in PARTS:
            said[part.name] = taken(part, packed(part, Path(folder)))
    (TARGET / "digests.json").write_text(json.dumps(said, indent=2) + "\n", encoding="utf-8")


def packed(part: Part, folder: Path) -> Path:
    """Have npm fetch the package; its bytes are those that were pinned."""
    command = ["npm", "pack", "--silent", "--pack-destination", str(folder), f"{part.name}@{part.version}"]
    name = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()[-1]
    content = (folder / name).read_bytes()
    integrity = "sha512-" + base64.b64encode(hashlib.sha512(content).digest()).decode()
    if integrity != part.integrity:
        sys.exit(f"{part.name} {part.version} is not what was pinned: {integrity}")
    return folder / name


def taken(part: Part, package: Path) -> dict[str, object]:
    """Write the files that are taken; return what the digests say."""
    files = {}
    with tarfile.open(package) as archive:
        for source, target in part.files.items():
            member = archive.extractfile(f"package/{source}")
            assert member is not None, source
            content = member.read()
            for old, new in part.changes.items():
                content = content.replace(old.encode(), new.encode())
            path = TARGET / target
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
            files[target] = hashlib.sha256(content).hexdigest()
    return {"version": part.version, "licence": part.licence, "package": part.integrity, "files": files}


if __name__ == "__main__":
    main()
