"""Make the bitcode that the package brings from the templates.

The command is ``python -m saltus.codegen.lowering``. It needs Numba, and a minute or two.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import lzma
import os
import sys
import time
from pathlib import Path

os.environ["NUMBA_LOOP_VECTORIZE"] = "0"  # before Numba is imported

FOLDER = Path(__file__).resolve().parents[2] / "kernels/bitcode"


def made(name: str) -> tuple[bytes, dict]:
    """One bitcode, compressed, and its entry in the manifest."""
    from saltus.codegen import templates
    from saltus.codegen.lowering import frontend
    from saltus.codegen.lowering.bitcode import bitcode

    interface, lanes = templates.BITCODE[name]
    module, entry, inlined = frontend.module_of(interface, lanes)
    code = bitcode(module, entry, f"saltus_{interface.entry}", inlined, interface.arguments)
    data = lzma.compress(code, preset=9 | lzma.PRESET_EXTREME)
    return data, {
        "sources": templates.source_hash(name),
        "texts": templates.text_hash(name),
        "sha256": hashlib.sha256(data).hexdigest(),
    }


def main() -> None:
    """Make the bitcode that isn't current, or all of it."""
    # Numba goes through sets: their order is part of the bitcode
    if os.environ.get("PYTHONHASHSEED") != "0":
        os.environ["PYTHONHASHSEED"] = "0"
        os.execv(
            sys.executable, [sys.executable, "-P", "-m", "saltus.codegen.lowering", *sys.argv[1:]]
        )
    from saltus.codegen import templates
    from saltus.codegen.asker import end_with_asker

    end_with_asker()
    parser = argparse.ArgumentParser(prog="python -m saltus.codegen.lowering", description=__doc__)
    parser.add_argument(
        "names",
        nargs="*",
        help=f"of {', '.join(templates.BITCODE)}; default: those that aren't current",
    )
    parser.add_argument("--all", action="store_true", help="all of them")
    parser.add_argument(
        "--folder",
        type=Path,
        default=FOLDER,
        help="where they are written (default: into the package)",
    )
    parser.add_argument(
        "--print",
        metavar="NAME",
        help="write one bitcode to standard output instead, not compressed",
    )
    given = parser.parse_args()
    if given.print:
        sys.stdout.buffer.write(lzma.decompress(made(given.print)[0]))
        return
    path = given.folder / "manifest.json"
    known = json.loads(path.read_text()) if path.exists() else {"bitcode": {}}
    stale = [
        name
        for name in templates.BITCODE
        if known["bitcode"].get(name, {}).get("sources") != templates.source_hash(name)
    ]
    for name in templates.BITCODE if given.all else given.names or stale:
        begun = time.perf_counter()
        data, entry = made(name)
        given.folder.mkdir(parents=True, exist_ok=True)
        (given.folder / f"{name}.bc.xz").write_bytes(data)
        known["bitcode"][name] = entry
        sys.stdout.write(
            f"{name}: {len(data) / 1000:.0f} kB in {time.perf_counter() - begun:.0f} s\n"
        )
    for name in known["bitcode"].keys() - set(templates.BITCODE):
        del known["bitcode"][name]
    # an edited comment leaves a bitcode current: its hash of the text to the character follows
    for name in known["bitcode"].keys() & set(templates.BITCODE):
        if known["bitcode"][name]["sources"] == templates.source_hash(name):
            known["bitcode"][name]["texts"] = templates.text_hash(name)
    import llvmlite
    import numba

    known["made_with"] = {"numba": numba.__version__, "llvmlite": llvmlite.__version__}
    path.write_text(json.dumps(known, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
