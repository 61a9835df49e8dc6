import numpy as np
from dockpose.study.table import FACTORS, Factor, columns_of, of_method


def test_bins_hold_their_lower_edge_and_the_last_its_upper_one_too():
    factor = Factor("x", "x", (0, 1, 3))
    assert factor.bins_of(np.array([-0.1, 0, 0.99, 1, 3, 3.1, np.nan])).tolist() == [-1, 0, 0, 1, 1, -1, -1]
    assert factor.labels == ["0 to 1", "1 to 3"]


def test_counted_bins_are_named_by_their_numbers():
    factor = Factor("n", "n", (0, 1, 4, 7), is_whole=True)
    assert factor.labels == ["0", "1 to 3", "4 to 7"]
    assert factor.bins_of(np.array([0.0, 3, 4, 7])).tolist() == [0, 1, 2, 2]


def test_listed_bins_are_named_by_their_value():
    assert FACTORS["width_px"].labels == ["320", "640", "800", "1280", "1920"]
    assert FACTORS["width_px"].bins_of(np.array([320.0, 1920])).tolist() == [0, 4]


def test_columns_are_numbers_but_for_words():
    columns = columns_of("scene,method,status,z_m\n0,hats,ok,1.5\n0,otsu,no_lights,\n")
    assert columns["z_m"][0] == 1.5
    assert np.isnan(columns["z_m"][1])
    assert of_method(columns, "otsu")["status"].tolist() == ["no_lights"]
