"""Without the extra `vda5050`, the files of this folder are skipped before they are imported; a broker for the rest."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from importlib.util import find_spec
from pathlib import Path
from typing import NoReturn

import pytest

from swarm.installation import hint_for_extra
from tests.bridge.vda5050.brokers import Broker

LACKS = hint_for_extra("vda5050")
MASTER = "test_process.py"  # the file that needs a master of others
LACKS_MASTER = None if find_spec("vda5050") else "vda5050-sdk is not installed: pip install 'vda5050-sdk[mqtt]'"

StartBroker = Callable[..., Broker]


class Skipped(pytest.Module):
    """A file of tests that cannot be imported here."""

    def collect(self) -> NoReturn:
        pytest.skip(f"{LACKS or LACKS_MASTER}", allow_module_level=True)


def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Module | None:
    lacks = LACKS or (LACKS_MASTER if module_path.name == MASTER else None)
    return None if lacks is None else Skipped.from_parent(parent, path=module_path)


@pytest.fixture
def start_broker(tmp_path: Path) -> Iterator[StartBroker]:
    """Start brokers on ports of their own; they end with the test."""
    with ExitStack() as stack:

        def start(*settings: str) -> Broker:
            return stack.enter_context(Broker(tmp_path, *settings))

        yield start


@pytest.fixture
def broker(start_broker: StartBroker) -> Broker:
    return start_broker()
