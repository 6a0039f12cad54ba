"""One town of each kind, and one scene's traffic, drawn once for all tests of the synthetic world."""

import numpy as np
import pytest


@pytest.fixture(scope="session", params=[0, 1], ids=["keeps-right", "keeps-left"])
def town(request):
    from ogmkit.synthetic.layout import LOCATIONS, build_layout

    return build_layout(3, LOCATIONS[request.param])


@pytest.fixture(scope="session")
def traffic(town):
    from ogmkit.synthetic.traffic import build_traffic

    return build_traffic(np.random.default_rng(5), town.network, town.car_parks, 8.0)
