"""The kernels that say who is in range of whom, against the definition."""

from math import dist

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from swarm.traffic.peers.radio_range import find_hidden_robots, list_pairs_in_range

REACH, HEARD = 5.0, 4.0  # m
places = st.lists(
    st.tuples(st.integers(-40, 40), st.integers(-40, 40)).map(lambda at: (at[0] / 7, at[1] / 7)), max_size=12
)


@given(places, st.data())
def test_pairs_in_range_are_all_but_a_robot_and_itself(at: list[tuple[float, float]], data: st.DataObject) -> None:
    some = st.lists(st.sampled_from(range(len(at))), unique=True) if at else st.just([])
    senders = sorted(data.draw(some))
    found = list_pairs_in_range(np.array(at, np.float64).reshape(-1, 2), np.array(senders, np.int64), REACH).tolist()
    assert found == [
        [one, other]
        for one in range(len(at))
        for other in senders
        if one != other and dist(at[one], at[other]) <= REACH
    ]


@given(places)
def test_a_robot_is_missed_if_somebody_near_is_far_from_it(at: list[tuple[float, float]]) -> None:
    near = [place for place in at if dist(place, (0.0, 0.0)) <= REACH]
    found = find_hidden_robots(np.array(at, np.float64).reshape(-1, 2), 0.0, 0.0, REACH, HEARD).tolist()
    assert found == [any(dist(place, other) > HEARD for other in near) for place in at]
