"""Process that is ready and does nothing, for the launcher to watch."""

from __future__ import annotations

import signal

if __name__ == "__main__":
    print("ready", flush=True)
    signal.pause()
