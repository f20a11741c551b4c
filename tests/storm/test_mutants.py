"""Planting a fault changes one line of a copy; the output of a storm about it is parsed."""

import re
from pathlib import Path

from benchmarks.mutants import BROKE, MUTANTS, ROOT, Mutant, mend, missing, plant
from world.storm.plans.profiles import PROFILES

GONE = Mutant("gone", "all", "swarm/traffic/reservations/rules.py", "a text that is in no file", "pass")
OFTEN = Mutant("often", "all", "swarm/traffic/reservations/rules.py", "claim", "pass")
MOVED = Mutant("moved", "all", "swarm/none.py", "claim", "pass")


def test_a_fault_whose_text_is_not_there_exactly_once_is_named() -> None:
    named = missing((GONE, OFTEN, MOVED))
    assert [line.split(":")[0] for line in named] == ["gone", "often", "moved"]


def test_a_fault_is_planted_and_mended(tmp_path: Path) -> None:
    mutant = Mutant("numbers", "claims", "swarm/traffic/reservations/rules.py", "class Reservations(", "class Other(")
    (tmp_path / mutant.file).parent.mkdir(parents=True)
    mend(mutant, tmp_path)
    plant(mutant, tmp_path)
    original, planted = ((root / mutant.file).read_text() for root in (ROOT, tmp_path))
    assert planted == original.replace("class Reservations(", "class Other(") != original
    mend(mutant, tmp_path)
    assert (tmp_path / mutant.file).read_text() == original


def test_faults_have_names_and_profiles_of_their_own() -> None:
    assert len({mutant.name for mutant in MUTANTS}) == len(MUTANTS) >= 30
    assert {profile for mutant in MUTANTS for profile in mutant.profiles.split(",")} <= set(PROFILES)
    assert all(mutant.before != mutant.after for mutant in MUTANTS)


def test_what_a_storm_says_of_a_failure_is_understood() -> None:
    match = re.match(BROKE, "claims 13: no overlap, tick 795: r1 and r2 hold cell 12")
    assert match is not None
    assert match.groups() == ("claims", "13", "no overlap")
