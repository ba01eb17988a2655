"""`lariat certs`: credentials for the bus of a cell that spans containers or machines."""

from __future__ import annotations

import json as jsons
from pathlib import Path
from typing import Annotated

import tyro

from stack.credentials.cell_credentials import SETTINGS_FILE, make_credentials


def main(
    folder: Annotated[Path, tyro.conf.Positional],
    /,
    address: tuple[str, ...] = ("localhost", "127.0.0.1"),
    namespace: str = "cell",
    days: int = 365,
    renew: bool = False,
    json: bool = False,
) -> int:
    """Make certificates and access rules for each user of a cell's bus.

    FOLDER/USER/bus.json is what the user's process takes as --settings, and all that its machine
    needs. FOLDER/authority signs the others; keep it away from the cell. What exists and is valid
    for another 30 days stays as it is.

    Examples:
      lariat certs credentials --address 192.168.5.2
      lariat status --mode client --connect tls/192.168.5.2:7448 --settings lariat/bus.json

    Args:
        folder: Folder of the credentials.
        address: Host names and IP addresses at which the router is reached.
        namespace: Name of the cell on the bus.
        days: Time for which a certificate is valid [d].
        renew: Make all credentials anew, the authority included: the former ones are refused.
        json: Answer with one JSON object on standard output.
    """
    made = make_credentials(folder, address, namespace, days, renew=renew)
    if json:
        print(jsons.dumps({"folder": str(folder), "made": made}))
    elif made:
        print(f"made {folder}/*/{SETTINGS_FILE} for {', '.join(made)}")
    else:
        print(f"the credentials in {folder} are valid")
    return 0
