"""`python -m tests.site [FOLDER]`: the site; status 1 where a link leads nowhere."""

import sys
import tempfile
from pathlib import Path

from tests.site.build import REPO, site, staged


def main() -> int:
    out = Path(sys.argv[1] if len(sys.argv) > 1 else REPO / "build" / "site").resolve()
    with tempfile.TemporaryDirectory() as docs:
        staged(Path(docs))
        faults = site(Path(docs), out)
    print("\n".join([*faults, f"python -m http.server -d {out}"]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
