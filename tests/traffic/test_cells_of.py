"""What a scenario makes of traffic's constants."""

import pytest

from swarm.traffic.cells_of import DEAF, LOSSY, UNHEARD, traffic_settings
from swarm.traffic.settings import TrafficSettings
from tests.shared import scenario_of
from tests.traffic.test_settings import ORDERS

USUAL = TrafficSettings()


@pytest.mark.parametrize("every", [1, 4, 10])
@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3, 0.5, 0.7, 0.8, LOSSY, 1.0])
def test_the_lossier_the_radio_the_longer_a_robot_waits_before_it_takes_another_for_silent(
    loss: float, every: int
) -> None:
    """Two that each take the other for silent may both take a cell: nobody asks them."""
    settings = traffic_settings(scenario_of(radio={"loss": loss, "every": every}).settings)
    worst = min(loss, LOSSY)
    assert worst ** (settings.fresh // every) <= DEAF
    assert worst ** (settings.listen // settings.often) <= UNHEARD
    if loss == 0.0:
        assert (settings.fresh, settings.listen) == (USUAL.fresh, USUAL.listen), "no longer than that takes"


@pytest.mark.parametrize("loss", [0.3, 0.5, 0.7, 0.8, LOSSY])
@pytest.mark.parametrize("why", ORDERS)
def test_constants_keep_their_order_however_lossy_the_radio(why: str, loss: float) -> None:
    settings = traffic_settings(scenario_of(radio={"loss": loss}).settings)
    values = [getattr(settings, name) for name in ORDERS[why]]
    assert values == sorted(set(values)), dict(zip(ORDERS[why], values, strict=True))
