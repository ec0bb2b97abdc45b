"""Files that a program here makes and the tree keeps: the command line that writes them or compares them."""

import pathlib
import sys


def main(out, files, argv):
    """Writes `files` (name to text) to the folder `out`; with --check compares instead. Returns the exit code."""
    stale = []
    for name, text in files.items():
        path = out / name
        if "--check" in argv[1:]:
            if not path.is_file() or path.read_text(encoding="ascii") != text:
                stale.append(name)
        else:
            out.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="ascii", newline="\n")
    for name in stale:
        print(f"{out / name} differs from what {pathlib.Path(argv[0]).name} writes", file=sys.stderr)
    return 1 if stale else 0
