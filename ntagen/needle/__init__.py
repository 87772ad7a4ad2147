"""The needle: exact kinematics, the pierced path, circle fit, pose estimate, virtual needle."""
