"""`python docs/problems [NAME ...]`: print the tables, write the figures to out/problems."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))


def main(names: list[str]) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    import problems

    folder = HERE.parents[1] / "out" / "problems"
    folder.mkdir(parents=True, exist_ok=True)
    for name in names or problems.problems():
        print(f"\n{name}")
        cells = problems.table(name).cells
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        for line in cells:
            print("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)))
        problems.draw(name)
        plt.savefig(folder / f"{name}.png", dpi=110)
        plt.close("all")
    print(f"\nfigures in {folder}")


if __name__ == "__main__":
    main(sys.argv[1:])
