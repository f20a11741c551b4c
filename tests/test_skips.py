"""`tests/skips.py`: a reason for which tests are skipped is told once."""

import pytest


def test_each_reason_is_told_once_with_its_number_of_tests(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        "import pytest\n"
        '@pytest.mark.parametrize("n", [1, 2])\ndef test_a(n): pytest.skip("no browser: install one")\n'
        'def test_b(): pytest.skip("no broker")\ndef test_c(): pass\n'
    )
    done = pytester.runpytest_inprocess("-p", "tests.skips", "-p", "no:cacheprovider")
    lines = [line.strip() for line in done.outlines]
    assert lines.count("2 tests no browser: install one") == lines.count("1 test  no broker") == 1
