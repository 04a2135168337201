"""Errors say file and field in one line, and are the built-in errors they amount to."""

import pickle

import pytest

from per_obspy.errors import CatalogError, PerError, RecordRejected, ServiceError


@pytest.mark.parametrize(("error", "built_in"), [(RecordRejected, ValueError), (CatalogError, ValueError)])
def test_errors_are_also_built_in(error, built_in):
    assert issubclass(error, PerError)
    assert issubclass(error, built_in)
    assert issubclass(ServiceError, ConnectionError)


def test_every_reason_is_in_the_text():
    assert str(RecordRejected("CI.CLC", "clipped at 2 g", "too short: 3 s")) == "CI.CLC: clipped at 2 g; too short: 3 s"


@pytest.mark.parametrize("error", [RecordRejected("CI.CLC", "a", "b"), CatalogError("pairs.csv", "no column gap")])
def test_errors_come_back_from_a_worker_process_as_they_left(error):
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
