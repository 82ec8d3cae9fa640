"""The program's own sources, by which results and receipts know its version."""

from tipdamp.engine.sources import packages, sources


def test_sources_in_a_folder_called_report(tmp_path):
    """The program may be installed anywhere; only its own report is no part of the other stages'
    key."""
    package = tmp_path / "report" / "program"
    for name in ("law.py", "report/page.py"):
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).touch()
    assert sources([package], False) == [package / "law.py"]
    assert sources([package], True) == [package / "law.py", package / "report" / "page.py"]


def test_all_packages_are_there():
    """Those behind links, too; their pages alone go without the report."""
    named = {path.relative_to(packages()[0]).as_posix() for path in sources(packages(), True)}
    assert {"cli.py", "hbm/laws/base.py", "modal/body.py", "report/page.py"} <= named
    assert not [name for name in named if "__pycache__" in name]
    fewer = set(sources(packages(), False))
    assert {path.parts[-3] for path in set(sources(packages(), True)) - fewer} >= {"report"}
