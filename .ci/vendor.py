"""Fetch the studio's parts of others from the npm registry, pinned, and write them with their licences and digests.

    python .ci/vendor.py

Needs npm. `tests/page/test_vendored.py` holds what is there against the digests, without a network. What is changed in a file on the
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

TARGET = Path(__file__).parents[1] / "rcsc" / "desk" / "studio" / "page" / "vendor"


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


_CODEMIRROR = (
    (
        "@codemirror/autocomplete", "6.20.4", "dist/index.js",
        "sha512-yF8RhOf2SXlg00+qtupzLhrglcas61boqaONiNcbPIebHCpJocpqTBA6dyrtUrQO47hqyTdeob/3XnYilT7TaQ==",
    ),
    (
        "@codemirror/commands", "6.11.1", "dist/index.js",
        "sha512-O/4hG3SC1YwcmQ0d2UVNDs+AsaNWd1iHVxbTeEBuqH+6bExAiPK3iS/BvpY6rZGURALv4ZD3sIgcCmRvw3ehBg==",
    ),
    (
        "@codemirror/language", "6.13.1", "dist/index.js",
        "sha512-zfvU2r3TyylQLMj/te+5CnQ0rSqZi8B1oTCBbQkagcLW4Xc6imab6qN+pEJhsuNOLaJqiRyBXp9UhWA1DhVvDw==",
    ),
    (
        "@codemirror/lint", "6.9.8", "dist/index.js",
        "sha512-qNvtcE73xUto/D1RvtgSRI4A1Hg8ekxlvtZpjHpdpisLBnhyu82EUEJMEgaxkjuQCA8vqnrylENWKOsEDCOHcw==",
    ),
    (
        "@codemirror/search", "6.7.2", "dist/index.js",
        "sha512-gUYkYhT2+n/+VGZ+8EzE5WFkYZUZYm1VOKDudIsNqh42uRVQJ0a6Yss9sdKT3MeOYfuL1N6AZA57oza0Oyr0LA==",
    ),
    (
        "@codemirror/state", "6.7.6", "dist/index.js",
        "sha512-kAz+AncRtKuIknedxT1bq4XwXv4UowhbkHU1myPrtVb/jZtImWuV5BXzv5vK6i3kYACsdiZiQKFQQ5Mq7elW8w==",
    ),
    (
        "@codemirror/streamparser", "6.0.0", "dist/index.js",
        "sha512-JTFPF6xrfjt0mnfGPgzcLiMwYmvIyNaoizp8BYzv8FE8KrT6GBGDZ190rtt+O7Wke3gG/MFHyiY9YGNeimof4w==",
    ),
    (
        "@codemirror/view", "6.43.15", "dist/index.js",
        "sha512-HHsfpqFeHyXLs983pSRe38Xajs0vFWZQ2BuX0m7Ki8w3jZ5iD8cuR3lBz2/5/X53Dhf32SBHKh6rtSTB6tKeGw==",
    ),
    (
        "@lezer/common", "1.5.5", "dist/index.js",
        "sha512-Pw7PVCndruF1pb3ebCxpSVpkMHSDjwRCLcTRw+RizUKco5QbWylwq2g4lnG/RYN7yTTQDXE9F77MwtkAyphrjg==",
    ),
    (
        "@lezer/highlight", "1.2.5", "dist/index.js",
        "sha512-O1GMVKgtf5YspFaRzpmqkVgMtIk2HG9uMAbH6wdAIdNh3TVzCsch/+cRi+6l2//UGDKe6NB9BW3cvuR5ezMQ0w==",
    ),
    (
        "@lezer/lr", "1.4.12", "dist/index.js",
        "sha512-On9HU4oMMiHPMkQDgoTnGahjgG5n/MkN38CgG77sMraKLL+3JBbeQNi1FcCXV9QRqwF9/BUXP3caHyJC1fBOTQ==",
    ),
    (
        "@marijn/find-cluster-break", "1.0.4", "src/index.js",
        "sha512-Wy0V7+SGUjnF9/TkiM1hKVDPj7jKXduPNboMVtHTA8dySMURWqfg/JZ9E2Sq8JgSJmkl7k7Qe9FLeMSrSraWmQ==",
    ),
    (
        "crelt", "1.0.7", "index.js",
        "sha512-aK6BbWfhf4U/wCcLHKPJl/xa6VkVstRaPywWtMKGwuOLc/wZTyQYuoxgvZnNsBvv7Kg3YTBQYYBCggcviQczuA==",
    ),
    (
        "style-mod", "4.1.5", "src/style-mod.js",
        "sha512-WQ2llCZa9sZSkJA+aOwpg5DkfbAXFKGh//t3MRTBeruFiSBC+GXUmbBzrw3bXyboCWAbtCW9InDfBsXrRD/rAg==",
    ),
    (
        "w3c-keyname", "2.2.8", "index.js",
        "sha512-dpojBhNsCNN7T82Tm7k26A6G9ML3NkhDsnw9n/eoxSRlVBB4CEtIQ/KTCLI2Fwf3ataSXRhYFkQi3SlnFwPvPQ==",
    ),
)  # fmt: skip
"""CodeMirror and what it is made of: name, version, the module, and what the registry says of its bytes; all MIT."""


def _flat(name: str) -> str:
    """A package's folder in `vendor`: without its scope."""
    return f"codemirror/{name.rpartition('/')[2]}"


_AMONG_THEM = {
    f"from '{name}'": f"from '../{_flat(name).removeprefix('codemirror/')}/index.js'"
    for name, *_ in _CODEMIRROR
}
_ADOPTED = {"if (!root.head && root.adoptedStyleSheets": "if (root.adoptedStyleSheets"}
"""The page's policy has no style in the page: rules are a sheet that the document adopts, as they are in a shadow tree."""
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
    *(
        Part(
            name, version, "MIT", integrity,
            {"LICENSE": f"{_flat(name)}/LICENSE", module: f"{_flat(name)}/index.js"},
            {**_AMONG_THEM, **(_ADOPTED if name == "style-mod" else {})},
        )
        for name, version, module, integrity in _CODEMIRROR
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
