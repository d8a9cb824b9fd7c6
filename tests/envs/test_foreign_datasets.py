"""Hugging Face's package of the same name is recognised and named."""

import subprocess
import sys
from pathlib import Path

from configs.source_code import PROJECT_ROOT


def test_foreign_datasets_package_is_named(tmp_path: Path) -> None:
    (tmp_path / "datasets").mkdir()
    (tmp_path / "datasets" / "__init__.py").touch()
    # An editable install finds our modules whatever stands on the path; here the path alone shall decide.
    path_only = "sys.meta_path[:] = [f for f in sys.meta_path if 'editable' not in getattr(f, '__module__', '')]"
    code = f"import sys; {path_only}; sys.path[:0] = [{str(tmp_path)!r}, {str(PROJECT_ROOT)!r}]; import envs"
    result = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert result.returncode == 1
    last = result.stderr.strip().splitlines()[-1]
    assert last.startswith(f"ImportError: the package 'datasets' was found at {tmp_path}")
