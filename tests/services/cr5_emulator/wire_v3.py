"""Calls of the vendor's V3 Python client and ROS driver, and the expected replies.

An answer is `error,{values},echo;`. Beside each text stands the error when it is negative, else how
many numbers there are between the braces, or exactly what stands there.
"""

from __future__ import annotations

POSE = "473.000000,-141.000000,469.000000,180.000000,0.000000,-90.000000"
UP = "473.000000,-141.000000,489.000000,180.000000,0.000000,-90.000000"
JOINTS = "0.000000,0.000000,-90.000000,0.000000,90.000000,0.000000"

UNKNOWN = (
    # Methods of the client that none of its demos calls, and settings without a use here.
    "BrakeControl(1,1)",
    "AO(1,5.000000)",
    "Arch(0)",
    "SetArmOrientation(1,1,-1,1)",
    "SetCollideDrag(0)",
    "SetTerminal485(115200,8,N,1)",
    "TCPSpeed(200)",
    "DOGroup(4,1,6,0,2,1,7,0)",
    # The client would send a comma behind the last one.
    "DOGroup(4,1,)",
    "RunScript(demo)",
    "SetUser(1,{10,0,0,0,0,0})",
    "SetAxisLimit(-357,357,-178,178,-160,160,-178,178,-178,178,-357,357)",
    # SetPayload is V4's; the client's own lacks its commas besides.
    "SetPayload(1.0000001,2,3,)",
)
"""What a client of V3 may also send to port 29999, each answered once with -10000."""

DASHBOARD: list[tuple[str, int | str]] = [
    ("PowerOn()", 0),
    ("ClearError()", 0),
    ("DisableRobot()", 0),
    ("EnableRobot()", 0),
    ("EnableRobot(1.500000)", 0),
    ("EnableRobot(1.500000,0.000000,0.000000,30.500000)", 0),
    ("ResetRobot()", 0),
    ("SpeedFactor(50)", 0),
    ("User(0)", 0),
    ("User(1)", -1),
    ("Tool(0)", 0),
    ("RobotMode()", "5"),
    ("PayLoad(1.000000,0.100000)", 0),
    ("DO(1,1)", 0),
    ("DOExecute(1,0)", 0),
    ("ToolDO(1,1)", 0),
    ("ToolDOExecute(1,0)", 0),
    ("AccJ(50)", 0),
    ("AccL(50)", 0),
    ("SpeedJ(50)", 0),
    ("SpeedL(50)", 0),
    ("CP(0)", 0),
    ("GetErrorID()", "[[],[],[],[],[],[],[]]"),
    (f"PositiveSolution({JOINTS},0,0)", 6),
    (f"InverseSolution({POSE},0,0)", 6),
    (f"InverseSolution({POSE},0,0,1,{{{JOINTS}}})", 6),
    # With the option its comma is missing and Python's quotes are there.
    (f"InverseSolution({POSE},0,01'{{{JOINTS}}}')", -30008),
    ("SetCollisionLevel(3)", 0),
    ("GetAngle()", 6),
    ("GetPose()", 6),
    ("GetPose(User=0,Tool=0)", 6),
    ("GetPose(User=1,Tool=1)", -1),
    ("DI(1)", "0"),
    ("DI(33)", -40001),
    ("ToolDI(1)", "0"),
    ("StartDrag()", 0),
    ("RobotMode()", "6"),
    ("StopDrag()", 0),
    ("pause()", 0),
    ("RobotMode()", "10"),
    ("continue()", 0),
    *((call, -10000) for call in UNKNOWN),
    ("EmergencyStop()", 0),
    ("RobotMode()", "9"),
    ("GetErrorID()", "[[116],[],[],[],[],[],[]]"),
    ("EnableRobot()", -1),
]
"""Port 29999."""

MOTION: list[tuple[str, int | str]] = [
    (f"MovJ({UP})", 0),
    (f"MovJ({POSE},User=0,Tool=0,SpeedJ=50,AccJ=50)", 0),
    (f"MovL({UP},SpeedL=60,AccL=50)", 0),
    # The first of the options is the user frame.
    (f"MovL({POSE},60)", -40007),
    (f"JointMovJ({JOINTS},SpeedJ=60,AccJ=50)", 0),
    # As the client's own example has it: Python's tuples.
    (f"MovLIO({POSE},(0, 50, 1, 0),(1, 1, 2, 1))", -10000),
    (f"Arc({UP},{POSE})", -10000),
    (f"MovL({POSE})", 0),
    ("RelMovJTool(1.000000,0.000000,0.000000,0.000000,0.000000,0.000000, 0)", 0),
    (
        "RelMovJTool(1.000000,0.000000,0.000000,0.000000,0.000000,0.000000, 0,"
        " SpeedJ=20, AccJ=20, User=0)",
        0,
    ),
    ("RelMovLTool(1.000000,0.000000,0.000000,0.000000,0.000000,0.000000, 0)", 0),
    # It names the joints' options for a straight motion.
    (
        "RelMovLTool(1.000000,0.000000,0.000000,0.000000,0.000000,0.000000, 0,"
        " SpeedJ=20, AccJ=20, User=0)",
        -20000,
    ),
    ("RelMovJUser(1.000000,0.000000,0.000000,0.000000,0.000000,0.000000, 0,SpeedJ=20)", 0),
    ("RelMovLUser(1.000000,0.000000,0.000000,0.000000,0.000000,0.000000, 0,SpeedL=20,Tool=0)", 0),
    ("RelJointMovJ(1.000000,0.000000,0.000000,0.000000,0.000000,0.000000,SpeedJ=20)", 0),
    (f"ServoJ({JOINTS},0.100000,50.000000,500.000000)", 0),
    (f"ServoJ({JOINTS},t=0.100000,lookahead_time=50.000000,gain=500.000000)", 0),
    (f"ServoJ({JOINTS},0.010000,50.000000,500.000000)", -40007),
    # The ROS driver's.
    (f"servoj({JOINTS},t=0.100,aheadtime=50.0)", 0),
    (f"ServoJS({JOINTS})", -10000),
    (f"ServoP({POSE})", 0),
    ("MoveJog(J1+)", 0),
    ("MoveJog(j2-,CoordType=1,User=0,Tool=0)", 0),
    ("MoveJog(X+,1,0,0)", 0),
    ("MoveJog()", 0),
    # Whatever the queue had: points are in no queue that could be waited for for ever.
    ("Sync()", 0),
    ("GetPose()", -10000),
]
"""Port 30003, on an arm that is enabled and stands at POSE."""
