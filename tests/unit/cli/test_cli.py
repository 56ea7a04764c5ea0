"""The command line: quick to help, teaches by example, ends every fault with a message and the
right exit code.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from saltus.cache import entry
from saltus.cli import commands
from saltus.cli.commands import app
from saltus.results.files import known

COMMANDS = [
    "demo",
    "run",
    "status",
    "resume",
    "plot",
    "reproduce",
    "models",
    "doctor",
    "schema",
    "cache",
    "cache show",
    "cache clear",
]


def saltus(*arguments: str):
    """The result of a command; faults that should have been caught surface as exceptions."""
    return CliRunner().invoke(app, arguments, catch_exceptions=False)


def test_help_imports_nothing_heavy():
    """What makes `saltus --help` take less than 0.5 s; measured by the modules, since a clock would
    depend on the load.
    """
    code = (
        "import sys; from saltus.cli import main\n"
        "sys.argv = ['saltus', '--help']\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print('HEAVY', sorted({'numpy', 'llvmlite', 'xarray', 'pandas', 'scipy', 'matplotlib', "
        "'pint', 'pydantic'} & set(sys.modules)))"
    )
    out = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout
    assert "demo" in out
    assert out.splitlines()[-1] == "HEAVY []"


@pytest.mark.parametrize("command", COMMANDS)
def test_help_teaches_with_an_example(command):
    result = saltus(*command.split(), "--help")
    assert result.exit_code == 0
    assert f"saltus {command}" in result.output.split("Example", 1)[1]


def test_no_arguments_shows_the_commands():
    assert all(command.split()[0] in saltus().output for command in COMMANDS)


def test_ctrl_c_while_the_command_starts_ends_it_with_a_word():
    code = (
        "import signal, sys\n"
        "from saltus.cli import main\n"
        "class Press:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'typer': signal.raise_signal(signal.SIGINT)\n"
        "sys.meta_path.insert(0, Press())\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "saltus: stopped.\n")


def test_memory_that_is_used_up_is_said(monkeypatch):
    def full():
        raise MemoryError

    monkeypatch.setattr("saltus.models.describe", full)
    result = saltus("models", "chain")
    assert result.exit_code == 2
    assert "memory is used up. Ask for fewer starts" in result.output


def test_unknown_command():
    result = saltus("dmo")
    assert result.exit_code == 2
    assert "dmo" in result.output


def test_a_fault_has_no_traceback(tmp_path):
    result = saltus("run", str(tmp_path / "none.toml"))
    assert result.exit_code == 2
    assert result.output.startswith("saltus: the study")
    assert "Traceback" not in result.output


def test_brackets_in_messages_stay(tmp_path):
    """rich reads [simulate] as markup unless told not to."""
    (tmp_path / "a.toml").write_text(
        '[study]\nname = "a"\n[simulate]\nstart = { x = "0 mm" }\nperiods = true\n'
    )
    assert "[simulate] periods = true" in saltus("run", str(tmp_path / "a.toml")).output


def test_ctrl_c_ends_with_a_message(monkeypatch, tmp_path):
    def stopped(path):
        raise KeyboardInterrupt

    monkeypatch.setattr("saltus.study.read.read", stopped)
    result = saltus("run", str(tmp_path / "a.toml"))
    assert result.exit_code == 130
    assert "stopped" in result.output
    assert "Traceback" not in result.output


def test_ctrl_c_tells_the_command_that_goes_on(monkeypatch, tmp_path):
    def stopped(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr("saltus.study.run.study.run_study", stopped)
    (tmp_path / "rig.py").write_text(
        'import saltus as sl\n\n@sl.system(states="x v")\ndef rig(t, '
        "x, v, *, k=2.0):\n    return v, -k * x\n"
    )
    (tmp_path / "a.toml").write_text(
        '[study]\nname = "a"\n[system]\n[poincare]\nsurface = "x turns"\nt_end = "1 s"\n'
    )
    own, out = f"{tmp_path / 'rig.py'}:rig", tmp_path / "an answer"
    said = " ".join(
        saltus("run", str(tmp_path / "a.toml"), "--system", own, "--out", str(out)).output.split()
    )
    assert f"saltus resume '{out}' --system {own}" in said


def test_a_file_that_cannot_be_written(monkeypatch, tmp_path):
    def refused(path):
        raise PermissionError(13, "Permission denied", "/out/demo.csv")

    monkeypatch.setattr("saltus.study.read.read", refused)
    result = saltus("run", str(tmp_path / "a.toml"))
    assert result.exit_code == 2
    assert result.output.startswith("saltus: /out/demo.csv: Permission denied.")


def test_schema_is_json():
    assert json.loads(saltus("schema").output)["title"] == "Study"


def test_models():
    from saltus.models import MODELS

    lines = saltus("models").output.splitlines()
    assert [line.split()[0] for line in lines[2:]] == list(MODELS), "one line each"
    (rig,) = (line for line in lines if line.startswith("two_masses"))
    assert rig.split(maxsplit=3)[1:3] == ["4", "1"]
    assert "NLvib, example 03" in rig
    shown = saltus("models", "thrown_mass").output
    assert all(text in shown for text in ("-gravity", "10 m/s^2", "SDND108", "falls onto"))
    assert "sl.models.energy" not in shown
    assert 'sl.models.energy("delangre")' in saltus("models", "delangre").output
    result = saltus("models", "delange")
    assert result.exit_code == 2
    assert "Did you mean 'delangre'?" in result.output


def test_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("SALTUS_CACHE", str(tmp_path))
    tmp_path.chmod(0o700)
    entry.write(tmp_path / "0123456789abcdef.kernel", "rig, ode45", b"machine code")
    assert "rig, ode45" in saltus("cache", "show").output
    assert saltus("cache").output == saltus("cache", "show").output
    assert "deleted 1 entry from" in saltus("cache", "clear").output
    assert list(tmp_path.iterdir()) == []


def test_what_cache_clear_keeps_is_said_and_goes_when_asked(monkeypatch, tmp_path):
    monkeypatch.setenv("SALTUS_CACHE", str(tmp_path))
    known.note("ab" * 32)
    assert "kept the checksums of 1 result file" in saltus("cache", "clear").output
    assert known.is_known("ab" * 32)
    assert "forgot 1 result file\n" in saltus("cache", "clear", "--all").output
    assert not known.is_known("ab" * 32)
    assert "result file" not in saltus("cache", "clear").output


def test_doctor_fails_if_a_check_fails(monkeypatch):
    from saltus.cli import doctor

    monkeypatch.setattr(
        doctor, "checks", lambda: [doctor.Comparison("a case", float("nan"), 1e-14)]
    )
    result = saltus("doctor")
    assert result.exit_code == 1
    assert "FAILED" in result.output


def test_cases_of_the_demo_are_those_of_the_rig():
    from saltus.models.delangre import CASES

    assert [case.value for case in commands.Case] == list(CASES)


def test_papers_are_listed_and_a_wrong_name_gets_the_nearest():
    listed = saltus("reproduce")
    assert listed.exit_code == 0
    assert "saunders2021" in listed.output
    wrong = saltus("reproduce", "sanders2021")
    assert wrong.exit_code == 2
    assert "'saunders2021'" in wrong.output


def test_a_wrong_figure_gets_those_that_there_are(tmp_path):
    wrong = saltus("reproduce", "saunders2021", "--figure", "44", "--out", str(tmp_path))
    assert wrong.exit_code == 2
    assert "2, 3, 4, 5, 6" in wrong.output


@pytest.mark.parametrize(
    ("command", "how"),
    [
        (["models"], "nobody reads on"),
        (["models"], "closed from the start"),
        (["models"], "closed on the way"),
        (["schema"], "nobody reads on"),
        (["models", "delangre"], "closed on the way"),
    ],
)
@pytest.mark.slow
def test_a_closed_output_ends_quietly(command, how):
    """``saltus models | head``, ``saltus models >&-``: nothing is wrong with a file, so nothing is
    said about one.
    """
    close = {
        "nobody reads on": "",
        "closed from the start": "os.close(1); ",
        "closed on the way": "os.close(1); ",
    }[how]
    call = "cli.commands.app(prog_name='saltus')" if how == "closed on the way" else "cli.main()"
    code = (
        f"import os, sys; import saltus.cli.commands; from saltus import cli; sys.argv = "
        f"['saltus', *{command!r}]; {close}{call}"
    )
    read, write = os.pipe()
    os.close(read)
    try:
        done = subprocess.run(
            [sys.executable, "-c", code],
            stdout=write,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    finally:
        os.close(write)
    assert done.stderr == ""
    assert done.returncode in (0, 1)


def test_a_file_never_takes_the_place_of_a_closed_output(tmp_path):
    """What is printed must not land in the next file that is opened."""
    code = (
        "import os; os.close(1)\n"
        "from saltus import cli\n"
        "cli._replace_closed_streams()\n"
        f"file = open({str(tmp_path / 'result')!r}, 'w'); assert file.fileno() > 2\n"
        "print('told'); file.write('kept')\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    assert (tmp_path / "result").read_text() == "kept"
