"""Contact models under test: impulse laws and force laws for a rigid particle that strikes a plate."""
