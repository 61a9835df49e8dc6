import csv
import io
import xml.etree.ElementTree

from dockpose.app.export.judged import judged_files
from dockpose.app.processing.judged import Judged
from dockpose.app.processing.losses import Losses
from dockpose.pose.known import PoseError

ROWS = [
    Judged("=a.png", "hats", 90, Losses(10, 1, 2, 3), "ok", PoseError(0.012, 0.0, True)),
    Judged("b.png", "kapur", None, Losses(10, 10, 0, 0), "no_lights", None),
]


def test_the_table_has_each_result_and_no_formula():
    first, second = csv.DictReader(io.StringIO(judged_files(ROWS)["methods.csv"]().decode()))
    assert first == {
        "picture": "'=a.png", "method": "hats", "level": "90", "lights": "10", "missed": "1", "run_together": "2",
        "strays": "3", "status": "ok", "right": "True", "off_m": "0.012", "off_deg": "0.0",
    }  # fmt: skip
    assert (second["level"], second["missed"], second["right"], second["off_m"]) == ("", "10", "", "")


def test_the_table_in_latex_has_a_line_a_method_by_the_papers_names():
    lines = judged_files(ROWS)["methods.tex"]().decode().splitlines()
    assert lines[2:4] == [
        r"HATS & 1 & 9 of 10 & 2 & 3 & 0 & 1 & 1 & 12.0 & 0.0 \\",
        r"maximum entropy & 1 & 0 of 10 & 0 & 0 & 0 & 0 & 0 & - & - \\",
    ]
    assert lines[0] == r"\begin{tabular}{lrrrrrrrrr}"


def test_the_plot_names_each_method():
    svg = judged_files(ROWS)["methods.svg"]()
    texts = "".join(xml.etree.ElementTree.fromstring(svg).itertext())
    assert "HATS" in texts
    assert "maximum entropy" in texts
    assert judged_files(ROWS)["methods.png"]()[:4] == b"\x89PNG"
