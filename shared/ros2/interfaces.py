"""Fields of the standard services, actions and messages that `rosbags` does not have.

Source: the packages std_srvs, action_msgs, control_msgs, object_recognition_msgs and moveit_msgs of
ROS 2 Jazzy.
"""

from __future__ import annotations

MESSAGES = {
    "control_msgs/msg/JointTolerance": """
        string name
        float64 position
        float64 velocity
        float64 acceleration
    """,
    "control_msgs/msg/JointComponentTolerance": """
        string joint_name
        uint16 component
        float64 position
        float64 velocity
        float64 acceleration
    """,
    "object_recognition_msgs/msg/ObjectType": """
        string key
        string db
    """,
    "moveit_msgs/msg/CollisionObject": """
        std_msgs/msg/Header header
        geometry_msgs/msg/Pose pose
        string id
        object_recognition_msgs/msg/ObjectType type
        shape_msgs/msg/SolidPrimitive[] primitives
        geometry_msgs/msg/Pose[] primitive_poses
        shape_msgs/msg/Mesh[] meshes
        geometry_msgs/msg/Pose[] mesh_poses
        shape_msgs/msg/Plane[] planes
        geometry_msgs/msg/Pose[] plane_poses
        string[] subframe_names
        geometry_msgs/msg/Pose[] subframe_poses
        byte operation
    """,
}
"""Text of messages by their type, in an order in which each needs earlier ones only."""
SERVICES = {
    "std_srvs/srv/Trigger": "---\nbool success\nstring message",
    "action_msgs/srv/CancelGoal": """
        action_msgs/msg/GoalInfo goal_info
        ---
        int8 return_code
        action_msgs/msg/GoalInfo[] goals_canceling
    """,
}
"""Text of services by their type."""
ACTIONS = {
    "control_msgs/action/FollowJointTrajectory": """
        trajectory_msgs/msg/JointTrajectory trajectory
        trajectory_msgs/msg/MultiDOFJointTrajectory multi_dof_trajectory
        control_msgs/msg/JointTolerance[] path_tolerance
        control_msgs/msg/JointComponentTolerance[] component_path_tolerance
        control_msgs/msg/JointTolerance[] goal_tolerance
        control_msgs/msg/JointComponentTolerance[] component_goal_tolerance
        builtin_interfaces/msg/Duration goal_time_tolerance
        ---
        int32 error_code
        string error_string
        ---
        std_msgs/msg/Header header
        string[] joint_names
        trajectory_msgs/msg/JointTrajectoryPoint desired
        trajectory_msgs/msg/JointTrajectoryPoint actual
        trajectory_msgs/msg/JointTrajectoryPoint error
        string[] multi_dof_joint_names
        trajectory_msgs/msg/MultiDOFJointTrajectoryPoint multi_dof_desired
        trajectory_msgs/msg/MultiDOFJointTrajectoryPoint multi_dof_actual
        trajectory_msgs/msg/MultiDOFJointTrajectoryPoint multi_dof_error
    """,
}
"""Text of actions by their type."""
