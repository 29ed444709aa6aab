"""Write tests/data/nastran anew with pyyeti: ``PYTHONPATH=tests python tests/data/write_with_pyyeti.py``.

The tests do not need pyyeti, only these files. The program also has pyyeti read what `support.exported_files` writes.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from support import exported_files as exported


def main() -> None:
    """Write every file, and check those that have no second program behind them."""
    import pandas as pd  # noqa: PLC0415  # pytest imports this file in search of docstring examples
    from pyyeti.nastran import bulk, op4  # noqa: PLC0415

    for sparse in ("dense", "bigmat", "nonbigmat"):
        for kind in ("text", "binary"):
            path = exported.DATA / f"pyyeti_{kind}_{sparse}.op4"
            op4.write(path, exported.LAYOUTS, binary=kind == "binary", sparse=sparse, digits=16)
    op4.write(exported.DATA / "superelement.op4", exported.superelement(), sparse="dense")
    with (exported.DATA / "superelement.pch").open("w") as stream:
        stream.write("$\n$ EXTRN DATA\n$\n")
        ids = [*exported.GRIDS, *exported.SCALARS]
        bulk.wtextrn(stream, ids, [123456] * len(exported.GRIDS) + [0] * len(exported.SCALARS))
        stream.write("$\n$ BOUNDARY GRID DATA\n$\n")
        bulk.wtgrids(stream, list(exported.GRIDS))
    index = pd.MultiIndex.from_tuples(exported.FORM_PLACES, names=["id", "dof"])
    frames: dict[str, Any] = {
        name: pd.DataFrame(matrix, index=index, columns=index) for name, matrix in exported.FORMS.items()
    }
    frames["cmplx"] = pd.DataFrame(np.full((len(index), 2), 1.0 - 2.0j), index=index, columns=[1, 2])
    bulk.wtdmig(str(exported.DATA / "forms.pch"), frames)
    with TemporaryDirectory() as folder:
        for write in (exported.single_text, exported.single_binary):
            (Path(folder) / "a.op4").write_bytes(write(exported.TWO_WAYS))
            found = op4.read(f"{folder}/a.op4")
            for name, matrix in exported.TWO_WAYS.items():
                np.testing.assert_array_equal(found[name], matrix)


if __name__ == "__main__":
    main()
