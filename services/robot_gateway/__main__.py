"""`python -m services.robot_gateway`: this service alone, live on the bus."""

from __future__ import annotations

from shared.runtime.live import main

if __name__ == "__main__":
    from services.robot_gateway.service import GatewayOptions

    main("services.robot_gateway", GatewayOptions)
