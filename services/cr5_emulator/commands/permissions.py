"""Commands that V4 accepts in an alarm, without power, and while a script runs or is paused."""

from __future__ import annotations

IN_ALARM = frozenset(
    {
        "clearerror",
        "geterrorid",
        "emergencystop",
        "stop",
        "robotmode",
        "logexportusb",
        "getexportstatus",
    }
)
"""Commands accepted in an alarm."""
WITHOUT_POWER = IN_ALARM | {
    "poweron",
    "requestcontrol",
}
"""Commands accepted without power."""
DURING_SCRIPT = IN_ALARM | {
    "speedfactor",
    "doinstant",
    "tooldoinstant",
    "aoinstant",
    "pause",
    "continue",
    "positivekin",
    "inversekin",
    "getangle",
    "getpose",
    "getscrname",
    "di",
    "tooldi",
    "ai",
    "toolai",
    "digroup",
    "getdo",
    "getao",
    "getdogroup",
    "settool485",
    "settoolpower",
    "settoolmode",
    "calcuser",
    "calctool",
    "getcurrentcommandid",
}
"""Commands accepted while a script runs."""
DURING_PAUSED_SCRIPT = DURING_SCRIPT | {
    "enablerobot",
    "disablerobot",
    "runto",
    "movejog",
    "pathrecovery",
    "pathrecoverystop",
    "pathrecoverystatus",
    "startdrag",
    "stopdrag",
}
"""Commands accepted while a script is paused."""
