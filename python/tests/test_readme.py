"""The Python of the README, run as it stands, prints what the README says."""

from __future__ import annotations

import subprocess
import sys

from conftest import PROJECT


def test_the_ten_lines_of_the_readme_print_what_it_says():
    _, section = (PROJECT / "README.md").read_text(encoding="utf-8").split("## From a CSV file to a located contact\n")
    code = section.split("```python\n")[1].split("```")[0]
    output = section.split("```\n")[2].split("```")[0]
    done = subprocess.run([sys.executable, "-c", code], cwd=PROJECT, capture_output=True, encoding="utf-8", timeout=300)
    assert (done.returncode, done.stdout) == (0, output), done.stderr
