//! From muscle activation and arm posture to Cartesian stiffness.
