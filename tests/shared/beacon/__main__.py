from __future__ import annotations

from shared.runtime.live import main
from tests.shared.beacon.options import BeaconOptions

if __name__ == "__main__":
    main("tests.shared.beacon", BeaconOptions)
