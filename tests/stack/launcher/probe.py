"""Program that prints how it was started, and ends as its argument says."""

from __future__ import annotations

import json
import os
import random
import sys
import time

import numpy as np

if __name__ == "__main__":
    facts = {
        "argv": sys.argv[1:],
        "main": sys.modules["__main__"].__file__,
        "imported": "shared.runtime.live" in sys.modules,
        "parent": os.getppid(),
        "session": os.getsid(0),
        "threads": len(os.listdir("/proc/self/task")),
        "files": sorted(int(number) for number in os.listdir("/proc/self/fd"))[:-1],
        "input": os.readlink("/proc/self/fd/0"),
        "unbuffered": os.environ["PYTHONUNBUFFERED"],
        "random": [random.random(), np.random.default_rng().random()],
    }
    print(json.dumps(facts))
    print("to standard error", file=sys.stderr)
    match sys.argv[1:]:
        case ["code"]:
            sys.exit(3)
        case ["error"]:
            raise RuntimeError("asked to")
        case ["wait", *_]:
            time.sleep(60.0)
