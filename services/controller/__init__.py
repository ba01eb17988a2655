"""Controller: owns the task, and turns observations and planned paths into setpoints."""
