"""The search for joint plans: a separate checker accepts its plans, and it reports if there is none."""

from collections.abc import Sequence
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.distances import FAR
from swarm.traffic.mapf import planner as joint_search
from swarm.traffic.mapf.best_first import BestFirst
from swarm.traffic.mapf.check import list_plan_faults
from swarm.traffic.mapf.lacam import LacamSearch, SearchState, remove_detours
from swarm.traffic.mapf.pibt import TieBreak
from swarm.traffic.mapf.planner import Budget, JointSearch, SearchOutcome, SearchResult
from swarm.traffic.mapf.precedence import order_of
from swarm.traffic.mapf.schedule import Schedule, makespan_and_flowtime
from tests.shared import needs_data
from tests.traffic.maps import BAY, HARD, RING, TREE, Drawn, public


def joined(cells: CellMap) -> dict[int, tuple[int, ...]]:
    return {cell: cells.neighbours[cell] for cell in range(len(cells)) if cells.stands[cell]}


def search(
    cells: CellMap,
    starts: tuple[int, ...],
    goals: tuple[int, ...],
    budget: Budget,
    share: int = 100,
    eager: Sequence[int] | None = None,
) -> SearchResult:
    """Search to the end, a share at a time; a plan that comes out is a good one."""
    tables = [cells.distances(goal) for goal in goals]
    searching = JointSearch(cells.neighbours, tables, starts, goals, budget=budget, random=Random(1), eager=eager)
    result = None
    while result is None:
        result = searching.advance(share)
    if result.outcome is SearchOutcome.SOLVED:
        assert list_plan_faults(result.steps, starts=starts, goals=goals, joined=joined(cells)) == []
        assert result.order is not None
        makespan_and_flowtime(result.steps)  # raises where the order runs in a circle
    return result


@pytest.mark.parametrize(
    ("drawn", "starts", "goals"),
    [(BAY, "ab", "ba"), (BAY, "abc", "bac"), (TREE, "abc", "bca"), (TREE, "abcd", "badc"), (RING, "aceg", "gace")],
    ids=["bay", "bay with a rester", "tree", "tree, all swap", "ring"],
)
def test_small_maps_are_solved(drawn: Drawn, starts: str, goals: str) -> None:
    assert search(drawn.cells, drawn.at(starts), drawn.at(goals), Budget()).outcome is SearchOutcome.SOLVED


@needs_data
@pytest.mark.parametrize("name", HARD)
def test_hard_maps_are_solved(name: str) -> None:
    drawn, starts, goals = public(name)
    robots, bound = HARD[name]
    assert len(starts) == robots
    tables = [drawn.cells.distances(goal) for goal in goals]
    assert sum(table[start] for table, start in zip(tables, starts, strict=True)) >= bound
    assert search(drawn.cells, starts, goals, Budget(starts=4)).outcome is SearchOutcome.SOLVED


@needs_data
@pytest.mark.parametrize("name", ["random-32-32-20", "room-32-32-4", "maze-32-32-4", "empty-16-16"])
def test_fifty_robots_are_solved_at_the_first_start(name: str) -> None:
    drawn, starts, goals = public(name, 50)
    result = search(drawn.cells, starts, goals, Budget(starts=1))
    assert result.outcome is SearchOutcome.SOLVED
    assert result.expansions < 300


def test_a_pair_that_cannot_pass_is_named() -> None:
    """Two swap in a corridor without a bay; bystanders elsewhere would make an exhaustive search hopeless."""
    drawn = Drawn("########", "a......b", "########", "c...d...", "e...f...", "........")
    result = search(drawn.cells, drawn.at("cdefab"), drawn.at("dcfeba"), Budget())
    assert result.outcome is SearchOutcome.UNSOLVABLE
    assert result.who == (4, 5)


def test_a_group_that_cannot_all_arrive_is_found_by_exhaustion() -> None:
    """Three that reverse their order need two bays; each pair alone could do with the one there is."""
    drawn = Drawn("#####", "abc..", "###.#")
    result = search(drawn.cells, drawn.at("abc"), drawn.at("cba"), Budget(expansions=200_000))
    assert result.outcome in {SearchOutcome.SOLVED, SearchOutcome.FOR_ONE}
    full = Drawn("####", "abc.", "####")
    assert search(full.cells, full.at("abc"), full.at("acb"), Budget()).outcome is SearchOutcome.FOR_ONE
    result = search(full.cells, full.at("abc"), full.at("acb"), Budget(), eager=(2,))
    assert result.outcome is SearchOutcome.UNSOLVABLE
    assert result.who == (0, 1, 2)


def test_who_only_makes_room_is_like_any_other() -> None:
    """For f to pass, five would have to be on this side of the fork, which has four cells: proven within the budget."""
    drawn = Drawn("e.bf", ".#h#", "g#di", "ac##")
    result = search(drawn.cells, drawn.at("abcdef"), drawn.at("ahgdic"), Budget(), eager=(5,))
    assert result.outcome is SearchOutcome.UNSOLVABLE


def test_out_of_budget_is_not_called_unsolvable() -> None:
    result = search(BAY.cells, BAY.at("ab"), BAY.at("ba"), Budget(expansions=3))
    assert result.outcome is SearchOutcome.NOT_FOUND


def test_a_goal_that_no_way_leads_to() -> None:
    drawn = Drawn("a#b")
    assert drawn.cells.distances(drawn.at("b")[0])[drawn.at("a")[0]] == FAR
    assert search(drawn.cells, drawn.at("a"), drawn.at("b"), Budget()).outcome is SearchOutcome.UNSOLVABLE


def test_a_goal_that_no_way_leads_to_is_known_without_a_search() -> None:
    """However many others there are, whose configurations a search would go through."""
    cells, (a, b, c, d) = (drawn := Drawn("a#b", "###", "c.d")).cells, drawn.at("abcd")
    for goals, state in (
        ((a, d), SearchState.RUNNING),
        ((b, d), SearchState.UNSOLVABLE),
        ((a, b), SearchState.UNSOLVABLE),
    ):
        tables = [cells.distances(goal) for goal in goals]
        once = LacamSearch(cells.neighbours, tables, (a, c), goals, ties=next(iter(TieBreak)), random=Random(1))
        assert (once.state, once.expansions) == (state, 0)


def test_changes_are_tried_until_so_many_in_a_row_are_no_quicker(monkeypatch: pytest.MonkeyPatch) -> None:
    """The seventh change is quicker; the plan itself stays the same."""
    tried: list[Schedule] = []

    class Same:
        pops = 0

        def __init__(self, *_: object) -> None:
            pass

        def replan_robots(self, plan: Schedule) -> Schedule:
            tried.append(plan)
            return plan._replace(last=plan.last - (len(tried) == 7))

    monkeypatch.setattr(joint_search, "PlanImprover", Same)
    assert search(BAY.cells, BAY.at("ab"), BAY.at("ba"), Budget(starts=1)).outcome is SearchOutcome.SOLVED
    assert len(tried) == 7 + 100


# fmt: off
STARTS: dict[str, tuple[list[int], Budget, list[int], SearchOutcome]] = {  # what each start needs; what each start gets
    "none ends: twice as long every fourth time, and what is left at last":
        ([],             Budget(expansions=1000),           [44] * 4 + [88] * 4 + [176, 176, 120], SearchOutcome.NOT_FOUND),
    "after a plan, four times its cost and 30 more":
        ([10],           Budget(starts=3),                  [10, 70, 70],                          SearchOutcome.SOLVED),
    "a cheaper plan limits the starts after it":
        ([10, 5],        Budget(starts=3),                  [10, 5, 50],                           SearchOutcome.SOLVED),
    "a dearer one does not":
        ([10, 20],       Budget(starts=3),                  [10, 20, 70],                          SearchOutcome.SOLVED),
    "all that is left":
        ([10],           Budget(starts=3, expansions=100),  [10, 70, 20],                          SearchOutcome.SOLVED),
    "no start after enough":
        ([10],           Budget(starts=9, enough=80),       [10, 70],                              SearchOutcome.SOLVED),
}
# fmt: on


class Scripted:
    """A search that finds a way from a to b after so many expansions."""

    def __init__(self, needs: int) -> None:
        self.expansions, self.needs, self.steps = 0, needs, [BAY.at("a"), BAY.at("b")]

    def advance(self, expansions: int) -> SearchState:
        self.expansions += min(expansions, self.needs - self.expansions)
        return SearchState.SOLVED if self.expansions == self.needs else SearchState.RUNNING


@pytest.mark.parametrize("name", STARTS)
def test_how_many_expansions_each_start_gets(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """For one robot with a way of 7 steps: its first starts may cost 2 x 7 + 30 expansions."""
    needs, budget, given, outcome = STARTS[name]
    begun: list[Scripted] = []

    def begin(*_: object, **__: object) -> Scripted:
        begun.append(Scripted(dict(enumerate(needs)).get(len(begun), 10**9)))
        return begun[-1]

    monkeypatch.setattr(joint_search, "LacamSearch", begin)
    monkeypatch.setattr(joint_search, "LATE", 99)  # so that nothing else is tried
    tables = [BAY.cells.distances(BAY.at("b")[0])]
    assert tables[0][BAY.at("a")[0]] == 7
    once = JointSearch(BAY.cells.neighbours, tables, BAY.at("a"), BAY.at("b"), budget=budget, random=Random(1))
    result = once.advance(10_000)
    assert result is not None
    assert [search.expansions for search in begun] == given
    assert (result.outcome, result.expansions) == (outcome, sum(given))


def test_after_the_proof_that_not_all_can_arrive_no_start_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """The longest way has one step: four starts of 32 expansions and one of 64 come before the proof."""
    full = Drawn("####", "abc.", "####")
    monkeypatch.setattr(joint_search, "LacamSearch", lambda *_, **__: Scripted(10**9))
    result = search(full.cells, full.at("abc"), full.at("acb"), Budget(), share=10**6)
    assert (result.outcome, result.expansions) == (SearchOutcome.FOR_ONE, 4 * 32 + 64)


def test_a_long_search_for_any_plan_spends_its_share_in_each_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """The start that proves that not all can arrive counts as one expansion."""
    spent: list[int] = []

    class Long:
        expansions = 0

        def __init__(self, *_: object) -> None:
            pass

        def advance(self, expansions: int) -> SearchState:
            self.expansions += min(expansions, 30)
            spent.append(min(expansions, 30))
            return SearchState.RUNNING

    never = Scripted(0)
    monkeypatch.setattr(never, "advance", lambda _: SearchState.UNSOLVABLE)
    monkeypatch.setattr(joint_search, "LacamSearch", lambda *_, **__: never)
    monkeypatch.setattr(joint_search, "BestFirst", Long)
    tables = [BAY.cells.distances(BAY.at("b")[0])]
    once = JointSearch(BAY.cells.neighbours, tables, BAY.at("a"), BAY.at("b"), budget=Budget(), random=Random(1))
    assert [(once.advance(100), sum(spent)) for _ in range(4)] == [(None, 100 * step - 1) for step in range(1, 5)]


def test_two_robots_with_one_goal_are_refused() -> None:
    tables = [BAY.cells.distances(BAY.at("b")[0])] * 2
    with pytest.raises(ValueError, match="two robots in one cell"):
        JointSearch(BAY.cells.neighbours, tables, BAY.at("ab"), BAY.at("bb"), budget=Budget(), random=Random(1))


@given(share=st.integers(1, 400), ties=st.sampled_from(TieBreak))
def test_the_share_of_a_step_does_not_change_the_plan(share: int, ties: TieBreak) -> None:
    starts, goals = TREE.at("abc"), TREE.at("bca")
    tables = [TREE.cells.distances(goal) for goal in goals]

    def plan(portion: int) -> list[tuple[int, ...]]:
        once = LacamSearch(TREE.cells.neighbours, tables, starts, goals, ties=ties, random=Random(3))
        while once.advance(portion) is SearchState.RUNNING:
            pass
        return once.steps

    assert plan(share) == plan(10_000)


@given(st.data())
def test_random_crowds(data: st.DataObject) -> None:
    """On a full floor of 4 x 4, whatever the places: the plan is a good one, or its absence is certain."""
    drawn = Drawn("....", "....", "....", "....")
    count = data.draw(st.integers(1, 12))
    starts = tuple(data.draw(st.permutations(range(16)))[:count])
    goals = tuple(data.draw(st.permutations(range(16)))[:count])
    assert search(drawn.cells, starts, goals, Budget(starts=2), eager=()).outcome is SearchOutcome.SOLVED


def test_where_a_plan_for_all_takes_long_one_robot_after_the_other_is_brought_to_its_goal() -> None:
    """Eight robots on sixteen cells: until all are at their goals at once, they move for minutes."""
    drawn = Drawn("abc", "d#e", "f#g", "h#i", "jkl", "##m", "nop")
    starts, goals = drawn.at("mkpidjfg"), drawn.at("ekjcpbfn")
    for eager, outcome in (((), SearchOutcome.SOLVED), ((7, 0), SearchOutcome.FOR_ONE)):
        result = search(drawn.cells, starts, goals, Budget(60, 20_000, 6_250), eager=eager)
        assert result.outcome is outcome
        if outcome is SearchOutcome.SOLVED:
            for_all = makespan_and_flowtime(result.steps)[0]
    assert result.who == (7,)
    ends = result.steps[-1]
    assert ends[7] == goals[7]
    assert list_plan_faults(result.steps, starts=starts, goals=ends, joined=joined(drawn.cells)) == []
    assert 2 * (makespan_and_flowtime(result.steps)[0] + joint_search.NEXT) < for_all


def test_a_plan_for_all_stays_where_one_after_the_other_takes_as_long(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = Drawn("abc", "d#e", "f#g", "h#i", "jkl", "##m", "nop")
    starts, goals = drawn.at("mkpidjfg"), drawn.at("ekjcpbfn")
    monkeypatch.setattr(joint_search, "NEXT", 1e3)
    assert search(drawn.cells, starts, goals, Budget(60, 20_000, 6_250), eager=(7, 0)).outcome is SearchOutcome.SOLVED


@given(st.data())
def test_a_crowd_visits_one_cell_on_its_way(data: st.DataObject) -> None:
    """Like robots that share a target: one after the other is there, and goes on to its own goal."""
    drawn = Drawn("....", "....", "....", "....")
    count = data.draw(st.integers(2, 6))
    starts, goals = (tuple(data.draw(st.permutations(range(16)))[:count]) for _ in range(2))
    visits = data.draw(st.integers(0, 15))
    tables = [drawn.cells.distances(goal) for goal in goals]
    vias = [drawn.cells.distances(visits), *data.draw(st.permutations([drawn.cells.distances(visits), None])) * count]
    searching = JointSearch(
        drawn.cells.neighbours, tables, starts, goals, budget=Budget(4), random=Random(1), vias=vias[:count]
    )
    result = searching.advance(10**6)
    assert result is not None
    assert result.outcome is SearchOutcome.SOLVED
    assert list_plan_faults(result.steps, starts=starts, goals=goals, joined=joined(drawn.cells)) == []
    for robot, way in enumerate(zip(*result.steps, strict=True)):
        assert vias[robot] is None or visits in way


def test_a_search_for_ways_through_a_cell_gives_up_early_and_proves_nothing() -> None:
    """Two swap in a corridor: without a cell to visit, that is proven to be impossible."""
    drawn = Drawn("a..b")
    (a, b), tables = drawn.at("ab"), [drawn.cells.distances(cell) for cell in drawn.at("ba")]
    for vias, outcome in (((), SearchOutcome.UNSOLVABLE), ((tables[0], None), SearchOutcome.NOT_FOUND)):
        searching = JointSearch(
            drawn.cells.neighbours, tables, (a, b), (b, a), budget=Budget(), random=Random(1), vias=vias
        )
        result = searching.advance(10**6)
        assert result is not None
        assert result.outcome is outcome


def test_a_detour_to_a_cell_that_is_visited_stays() -> None:
    assert remove_detours([(0, 9), (1, 9), (0, 9)], (1, -1)) == [(0, 9), (1, 9), (0, 9)]
    assert remove_detours([(0, 9), (1, 9), (0, 9)], (2, -1)) == [(0, 9)]


def test_a_needless_detour_is_cut() -> None:
    assert remove_detours([(0, 9), (1, 9), (0, 9)]) == [(0, 9)]
    passed = [(0, 5), (1, 0), (0, 3)]  # robot 1 is in cell 0 meanwhile
    assert remove_detours(passed) == passed


def test_the_order_of_entries() -> None:
    order = order_of([(0, 3), (1, 3), (2, 1), (2, 0)])
    assert order.ways == ((0, 1, 2), (3, 1, 0))
    assert order.after == ({}, {1: (0, 1), 2: (0, 0)})


def test_a_ring_of_movers_is_a_circle_of_waits() -> None:
    with pytest.raises(ValueError, match="circle"):
        makespan_and_flowtime([(0, 1, 2, 3), (1, 2, 3, 0)])


# --- what each part may cost ---


class Costly:
    """A search that gets nowhere: for one robot or for all, one moving at a time; ``most`` expansions at a time."""

    most = 7
    asked: list[int]  # expansions that all of them were told to spend at most
    begun: int

    def __init__(self, *_: object) -> None:
        type(self).begun += 1
        self.expansions = 0

    def advance(self, expansions: int) -> SearchState:
        self.asked.append(expansions)
        self.expansions += min(expansions, self.most)
        return SearchState.RUNNING


def late(monkeypatch: pytest.MonkeyPatch, names: str, most: int, eager: Sequence[int] | None = None) -> JointSearch:
    """Return a search that has no plan although it was begun often: pairs are tried, then one robot at a time."""
    monkeypatch.setattr(joint_search, "LATE", -1)
    monkeypatch.setattr(joint_search, "BestFirst", Costly)
    monkeypatch.setattr(joint_search, "OneRobot", Costly)
    monkeypatch.setattr(Costly, "most", most)
    monkeypatch.setattr(Costly, "asked", [], raising=False)
    monkeypatch.setattr(Costly, "begun", 0, raising=False)
    floor = Drawn("abcd", "efgh")
    starts, goals = floor.at(names), floor.at(names[1:] + names[0])
    tables = [floor.cells.distances(goal) for goal in goals]
    return JointSearch(floor.cells.neighbours, tables, starts, goals, budget=Budget(), random=Random(1), eager=eager)


# fmt: off
PAIRS: dict[str, tuple[str, list[int] | None, int, list[int]]] = {
    # robots; who is eager; expansions: what each search is told to spend at most, those for pairs first
    "two":                      ("ab",  None, 15, [2000, 2000]),            # 1 + 2 x 14 / 2
    "two, and one left":        ("ab",  None, 16, [2000, 2000, 1]),
    "one is eager":             ("ab",  [0],  8,  [2000]),                  # 1 + 2 x 7 / 2
    "one is, and one left":     ("ab",  [0],  9,  [2000, 1]),
    "three: one pair":          ("abc", None, 10, [2000] * 2),              # 1 + 2 x 14 / 3
    "three: two pairs":         ("abc", None, 20, [2000] * 4),
    "three: all, and one left": ("abc", None, 31, [2000] * 6 + [1]),
}
# fmt: on


@pytest.mark.parametrize("name", PAIRS)
def test_what_trying_pairs_costs_counts_for_all_robots(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    names, eager, expansions, asked = PAIRS[name]
    assert late(monkeypatch, names, 7, eager).advance(expansions) is None
    assert Costly.asked == asked


def test_a_question_to_the_search_of_one_at_a_time_costs_10000_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    """The pair costs two searches of 2000 expansions."""
    once = late(monkeypatch, "ab", 10**6)
    for expansions in (1 + 2 * 4000 // 2, 9_999, 1, 1):
        assert once.advance(expansions) is None
    assert Costly.asked == [2000, 2000, 9_999, 1], "the last one goes into a search for all at once"
    assert Costly.begun == 3


@pytest.mark.parametrize(("enough", "changes"), [(26, 2), (27, 3)])
def test_expansions_of_a_change_cost_a_part_of_those_of_all_robots(
    enough: int, changes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two robots: each change costs 1 + (20 + 40 / 10) / 2."""
    tried: list[Schedule] = []

    class Vain:
        pops = 0

        def __init__(self, *_: object) -> None:
            pass

        def replan_robots(self, plan: Schedule) -> None:
            tried.append(plan)
            self.pops += 40

    monkeypatch.setattr(joint_search, "PlanImprover", Vain)
    search(TREE.cells, TREE.at("ab"), TREE.at("ba"), Budget(starts=1, enough=enough))
    assert len(tried) == changes


def test_the_limits_of_a_search_that_is_told_none() -> None:
    assert Budget() == Budget(starts=4, expansions=20_000, enough=20_000)


def test_the_search_of_one_at_a_time_keeps_so_many_configurations_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    for most, expansions in ((2, 1), (1, 0)):
        monkeypatch.setattr("swarm.traffic.mapf.best_first.MOST_KEPT", most)
        once = BestFirst(BAY.cells.neighbours, [BAY.cells.distances(BAY.at("b")[0])], BAY.at("a"))
        assert once.advance(1) is SearchState.RUNNING
        assert once.expansions == expansions


def test_the_search_of_one_at_a_time_spends_what_it_is_given_and_no_more() -> None:
    tables = [TREE.cells.distances(goal) for goal in TREE.at("ba")]
    once = BestFirst(TREE.cells.neighbours, tables, TREE.at("ab"))
    for spent in (2, 4, 6):
        assert once.advance(2) is SearchState.RUNNING
        assert once.expansions == spent


def test_nobody_takes_no_time() -> None:
    assert makespan_and_flowtime([]) == makespan_and_flowtime([()]) == (0.0, 0.0)
