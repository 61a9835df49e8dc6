import io
import math
import shutil
import subprocess

import msgspec
import numpy as np
import pytest
from dockpose.app.experiment import Row
from dockpose.app.export.data import (
    csv_table,
    latex_table,
    mean_and_rms,
    summaries,
    table,
    to_latex,
)
from dockpose.app.web.panels import experiment_rows as log

from tests.support.rows import changed

NASTY = 'a & b_c %x $y$ #1 {z} ~^\\ <script>alert("1")</script> | "q" *s* `c`\nθ ü 水'


def test_boxes_show_what_a_row_has():
    texts = log.texts_of(changed(measured_z_cm=110.25, distance_cm=120.0, notes="n"))
    assert (texts["measured_x_cm"], texts["measured_z_cm"], texts["distance_cm"]) == ("", "110.25", "120")
    values = log.values_of(texts | {"measured_x_cm": " 1,5 "})
    assert [values[name] for name in ("measured_x_cm", "measured_y_cm", "measured_z_cm")] == [1.5, None, 110.25]
    assert values["notes"] == "n"
    assert (values["measured_x_cm"], values["distance_cm"]) == (1.5, 120)
    assert log.values_of(log.BLANK)["measured_z_cm"] is None


def row(number, z_cm, measured_z_cm, **more):
    known = {"time": "2026-01-01T00:00:00+00:00", "source": "tank", "sha256": "", "status": "ok"}
    known |= {"number": number, "file": f"frames/{number:04d}.png", "z_cm": z_cm, "measured_z_cm": measured_z_cm}
    return msgspec.convert(known | more, Row)


ROWS = [
    row(1, 101.0, 100.0, x_cm=5.0, theta_y_deg=-10.0, measured_theta_y_deg=-12.0),
    row(2, 197.0, 200.0, notes=NASTY),
    row(3, None, 300.0, status="no_lights"),
]


def test_mean_and_rms_by_hand():
    assert mean_and_rms([1.0, -3.0]) == (-1.0, pytest.approx(math.sqrt(5)))  # sqrt((1 + 9) / 2)
    assert mean_and_rms([]) == (None, None)
    total = summaries(ROWS)
    assert total["Compared"] == ("0", "0", "2", "0", "1")
    assert total["Mean error"] == ("–", "–", "-1.00", "–", "+2.00")


def test_cells_are_estimated_with_measured_in_brackets():
    content = table(ROWS)
    assert content.body[0] == (
        *("1", "5.00", "–", "101.00 (100.00)", "–", "-10.00 (-12.00)"),
        *("–", "–", "+1.00", "–", "+2.00", ""),
    )
    assert content.body[2][3] == "– (300.00)"
    assert content.foot[1][8] == "-1.00"
    assert {len(cells) for cells in (content.head, *content.body, *content.foot)} == {12}
    assert {len(cells) for cells in table(ROWS, with_errors=False).body} == {7}


@pytest.mark.extra
def test_pandas_reads_the_csv_with_the_same_numbers():
    import pandas  # pyright: ignore[reportMissingImports]

    read = pandas.read_csv(io.StringIO(csv_table(ROWS)))
    np.testing.assert_allclose(read["error_z_cm"], [1, -3, np.nan])
    np.testing.assert_allclose(read["measured_z_cm"], [100, 200, 300])
    assert list(read["notes"])[1] == NASTY
    formula = csv_table([row(1, 1.0, 1.0, notes='=HYPERLINK("http://x")', source="+1")])
    assert list(pandas.read_csv(io.StringIO(formula))["notes"]) == ['\'=HYPERLINK("http://x")']


def test_latex_escapes_by_hand():
    assert to_latex("50 % & a_b") == r"50 \% \& a\_b"
    assert to_latex("é θ ±2° \\input{x}\n^~") == (
        r"é θ $\pm$2$^\circ$ \textbackslash{}input\{x\} \textasciicircum{}\textasciitilde{}"
    )


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="no TeX here")
def test_latex_compiles(tmp_path):
    characters = "".join(map(chr, [*range(32, 127), *range(0xC0, 0x100)])) + "°±×µ²³·–…"
    rows = [*ROWS, row(4, 1.0, 1.0, notes=" ".join(characters))]
    document = r"\documentclass{article}\usepackage{longtable}\begin{document}" + latex_table(rows) + r"\end{document}"
    (tmp_path / "table.tex").write_text(document, encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "table.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=120)
    assert done.returncode == 0, done.stdout[-800:]
    assert (tmp_path / "table.pdf").read_bytes().startswith(b"%PDF")
