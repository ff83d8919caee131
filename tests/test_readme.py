"""The README's Python runs as it stands and prints what its comments say; its robot file loads."""

import re
from pathlib import Path

import numpy as np

import tendonrod

README = Path(__file__).parent.parent / "README.md"


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)


def test_python_runs_and_its_comment_is_true():
    code, bench = blocks("python")
    names: dict = {}
    exec(compile(code, "README.md", "exec"), names)
    (numbers,) = re.findall(r"# m: \[(.*?)\]", code)
    printed = [float(word) for word in numbers.split()]
    assert np.allclose(names["shape"].tip, printed, atol=5e-6)
    assert names["plan"].tension.shape == (20,)
    exec(compile(bench, "README.md", "exec"), names)
    assert names["shape"].contacts.total[1] < 0.0
    assert names["shape"].stable


def test_robot_file_loads(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(blocks("toml")[0], encoding="utf-8")
    robot = tendonrod.load_robot(path)
    assert robot.section.A == tendonrod.load_robot("exonav-1").section.A
    assert robot.section.torsion_stiffness < 0.1 * tendonrod.load_robot("exonav-1").section.torsion_stiffness


def test_every_command_named_exists():
    from tendonrod.cli import main

    lines = [line for block in blocks("sh") for line in block.splitlines()]
    commands = {line.split()[1] for line in lines if line.startswith("tendonrod ")}
    assert commands
    for command in commands:
        assert main([command, "--help"]) == 0
