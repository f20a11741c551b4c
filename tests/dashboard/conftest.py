from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True, scope="module")
def strict() -> Iterator[None]:
    """Let Rerun raise what it would only warn of."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RERUN_STRICT", "1")
        yield
