"""Processor times come from the kernel."""

from __future__ import annotations

import os
import resource
import subprocess
import sys

import pytest

from benchmarks.speed.processor_time import processor_times


def test_times_are_those_that_the_kernel_counts_for_a_process_and_its_ended_children() -> None:
    busy = "import time\nwhile time.process_time() < 0.1: pass"
    before = processor_times(os.getpid())
    subprocess.run([sys.executable, "-c", busy], check=True)
    own, ended = processor_times(os.getpid())
    assert ended - before[1] >= 0.09
    for found, who in ((own, resource.RUSAGE_SELF), (ended, resource.RUSAGE_CHILDREN)):
        usage = resource.getrusage(who)
        assert found == pytest.approx(usage.ru_utime + usage.ru_stime, abs=0.1)
